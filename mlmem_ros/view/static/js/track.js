// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The configuration over time: columns with their times, strains and walls.

const KEPT = 4000; // columns of a running element: two minutes

export class Track {
  constructor() {
    this.t = [];
    this.columns = [];
    this.walls = [];
    this.strain = { t: [], y: [] };
  }

  /** Add what a running element shows. */
  push(t, column, walls, strain) {
    if (this.t.length && t <= this.t[this.t.length - 1]) return;
    this.t.push(t);
    this.columns.push(column);
    this.walls.push(walls);
    this.strain.t.push(t);
    this.strain.y.push(strain);
    if (this.t.length > 1.25 * KEPT) {
      const over = this.t.length - KEPT;
      for (const list of [this.t, this.columns, this.walls, this.strain.t, this.strain.y]) list.splice(0, over);
    }
  }

  /** Return a track of a frame of columns that lie behind each other. */
  static of(t, data, walls, strain) {
    const track = new Track();
    const rows = t.length ? data.length / t.length : 0;
    track.t = t;
    track.columns = t.map((_, i) => data.subarray(i * rows, (i + 1) * rows));
    track.walls = walls;
    track.strain = strain;
    return track;
  }

  get begin() { return this.t.length ? this.t[0] : 0; }
  get end() { return this.t.length ? this.t[this.t.length - 1] : 0; }
}

/** Return the index of the last entry of an ascending list that is not above a value; -1: none. */
export function last(list, value) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle + 1; else high = middle;
  }
  return low - 1;
}
