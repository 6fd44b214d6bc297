// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The material: Eq. (1a) over a rigid substrate by PEFRL, as mlmem/physics/pefrl.py steps it.
// Times are in time units. Its results differ from the product's in the last bits.

const NODES = 5; // times in a step at which PEFRL needs the prescribed motion
const STILL = { site: 1, driven: 0 };

export class Material {
  /**
   * @param {object} cells n, v, height, origin, mobility, under, decay, kick, push, drifts, a, b,
   *   stuck; a list of one number stands for all cells
   * @param {number} steps the most of a run
   */
  constructor(cells, steps) {
    const { n } = cells, nodes = NODES * steps;
    Object.assign(this, { n, a: cells.a, b: cells.b, stuck: cells.stuck, drifts: cells.drifts });
    this.end = 0; // displacement of the substrate's end
    for (const name of ['v', 'height', 'origin', 'under']) this[name] = spread(cells[name], n);
    for (const name of ['decay', 'kick', 'push']) this[name] = cells[name].map((row) => spread(row, n));
    this.du = new Float64Array(n);
    this.before = new Float64Array(n); // displacements at a kick
    this.V_N = new Float64Array(nodes);
    this.shake = new Float64Array(nodes);
    this.motion = new Float64Array(nodes); // displacements and
    this.speeds = new Float64Array(nodes); // velocities of a driven end
  }

  /**
   * Advance by whole steps, whose prescribed motion is in V_N and shake.
   *
   * @param {object} held site of a driven end, and at how many nodes `motion` drives it
   * @returns displacements of the first and the last cell after every step
   */
  advance(steps, { site, driven } = STILL) {
    const { n, v, du, drifts, motion, speeds, V_N } = this;
    const ends = [new Float64Array(steps), new Float64Array(steps)];
    for (let k = 0; k < steps; k++) {
      const first = NODES * k, held = first + NODES <= driven;
      for (let j = 0; j < n; j++) v[j] += drifts[0] * du[j];
      for (let stage = 0; stage < 4; stage++) {
        const node = first + [1, 0, 3, 2][stage];
        if (held) v[site - 1] = motion[node];
        this.kickAndDrift(stage, V_N[node], this.shake[node]);
      }
      const last = first + NODES - 1;
      this.carryStuck(V_N[last]);
      if (held) [v[site - 1], du[site - 1]] = [motion[last], speeds[last]];
      [ends[0][k], ends[1][k]] = [v[0], v[n - 1]];
    }
    return ends;
  }

  /** Kick all cells at their places, then let them drift. */
  kickAndDrift(stage, end, shake) {
    const { n, v, du, before, a, b, height, origin, under } = this;
    const inner = stage === 1 || stage === 2 ? 1 : 0, drift = this.drifts[stage + 1];
    const [decay, kick, push] = [this.decay[inner], this.kick[inner], this.push[inner]];
    this.carryStuck(end);
    before.set(v);
    for (let j = 0; j < n; j++) {
      const here = before[j], left = before[Math.max(j - 1, 0)], right = before[Math.min(j + 1, n - 1)];
      const y = here - end * under[j] - origin[j], square = y * y;
      const slope = height[j] * (a + 3 * b * square);
      const pull = left - 2 * here + right - slope * Math.sin(y * (a + b * square));
      du[j] = decay[j] * du[j] + kick[j] * pull - push[j] * shake;
      v[j] = here + drift * du[j];
    }
    for (const j of this.stuck) [v[j], du[j]] = [before[j], 0];
  }

  /** Let stuck cells follow the substrate. */
  carryStuck(end) {
    for (const j of this.stuck) this.v[j] += (end - this.end) * this.under[j];
    this.end = end;
  }

  /** Return the configuration of a cell, counted from 0. */
  delta(j) { return this.v[j] - this.end * this.under[j]; }
}

function spread(values, n) {
  return values.length === 1 ? new Float64Array(n).fill(values[0]) : Float64Array.from(values);
}
