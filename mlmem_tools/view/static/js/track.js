// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Configuration and strain over time. A real element shows its strain alone.

const KEPT = 4000; // samples of a running element: two minutes

export class Track {
  /** @param {object} frame t of the columns in `data`, strain: [times, values] */
  constructor({ t = [], strain = [[], []], data } = {}) {
    const rows = t.length ? data.length / t.length : 0;
    this.t = t;
    this.columns = t.map((_, i) => data.subarray(i * rows, (i + 1) * rows));
    this.strain = { t: strain[0], y: strain[1] };
  }

  /** Add what a running element shows. */
  push(t, strain, column) {
    if (t <= this.end) return;
    this.strain.t.push(t);
    this.strain.y.push(strain);
    if (column) {
      this.t.push(t);
      this.columns.push(column);
    }
    for (const list of [this.t, this.columns, this.strain.t, this.strain.y]) {
      if (list.length > 1.25 * KEPT) list.splice(0, list.length - KEPT);
    }
  }

  get begin() { return Math.min(this.t[0] ?? Infinity, this.strain.t[0] ?? Infinity, this.end); }
  get end() { return Math.max(this.t.at(-1) ?? 0, this.strain.t.at(-1) ?? 0); }
}

/** Return the index of the last entry of an ascending list up to a value; -1 if there is none. */
export function last(list, value) {
  let low = 0, high = list.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (list[middle] <= value) low = middle + 1; else high = middle;
  }
  return low - 1;
}
