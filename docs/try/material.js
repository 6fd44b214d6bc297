// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The material: the product's loop as WebAssembly, over one memory. Times are in time units.

const NODES = 5; // times in a step at which PEFRL needs the prescribed motion
const STILL = { site: 1, driven: 0 };

export class Material {
  /**
   * @param {object} loop `run` and `memory` of pefrl.wasm
   * @param {object} cells n, v, height, origin, mobility, under, decay, kick, push, drifts, a, b,
   *   stuck; a list of one number stands for all cells
   * @param {number} steps the most of a run
   */
  constructor(loop, cells, steps) {
    const { n } = cells, nodes = NODES * steps;
    this.loop = loop;
    this.cells = cells;
    this.end = 0; // displacement of the substrate's end
    let at = 64; // below it, what the loop returns
    const place = (length, kind = Float64Array) => {
      const from = at;
      at += 8 * length;
      const missing = Math.ceil((at - loop.memory.buffer.byteLength) / 65536);
      if (missing > 0) loop.memory.grow(missing);
      return { from, length, kind };
    };
    const plan = {
      u: place(n + 2), du: place(n), x: place(2 * (n + 2)),
      height: place(n), origin: place(n), mobility: place(n), under: place(n),
      decay: place(2 * n), kick: place(2 * n), push: place(2 * n), drifts: place(5),
      V_N: place(nodes), shake: place(nodes), motion: place(2 * nodes), ends: place(2 * steps),
      stuck: place(cells.stuck.length, BigInt64Array),
    };
    this.from = Object.values(plan).map(({ from }) => from);
    for (const [name, { from, length, kind }] of Object.entries(plan)) this[name] = new kind(loop.memory.buffer, from, length);
    for (const name of ['height', 'origin', 'mobility', 'under', 'drifts']) spread(this[name], cells[name]);
    for (const name of ['decay', 'kick', 'push']) cells[name].forEach((row, k) => spread(this[name].subarray(k * n, (k + 1) * n), row));
    this.stuck.set(cells.stuck.map(BigInt));
    this.v = this.u.subarray(1, n + 1);
    spread(this.v, cells.v);
  }

  /**
   * Advance by whole steps, whose prescribed motion is in V_N and shake.
   *
   * @param {object} held site of a driven end, and at how many nodes `motion` drives it
   * @returns displacements of the first and the last cell after every step
   */
  advance(steps, { site, driven } = STILL) {
    const { n, a, b, stuck } = this.cells;
    const whole = [n, stuck.length, steps, driven, site].map(BigInt);
    if (this.loop.run(0, 32, ...this.from, ...whole, a, b, this.end)) throw new Error('the loop failed');
    this.end = this.V_N[NODES * steps - 1];
    return [this.ends.subarray(0, steps), this.ends.subarray(steps, 2 * steps)];
  }

  /** Return the configuration of a cell, counted from 0. */
  delta(j) { return this.v[j] - this.end * this.under[j]; }
}

/** Where the loop looks for the velocities of a driven end, behind its displacements. */
export const velocities = (steps) => NODES * steps;

function spread(into, values) {
  if (values.length === 1) into.fill(values[0]); else into.set(values);
}
