// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// An element and its instrument: plays what a write or an erase did in the product, and listens.

import { Material } from './material.js';

const CHUNK = 10; // steps that are run at once; moves begin between them
const KEPT = 512; // samples of either end
const TAIL = 150; // time units that a read listens after the first crossing
const FAINTEST = 1e-13; // least threshold
const HALF = 0.5;

export class Element {
  /** @param {object} preset as mlmem_lab.tab_presets tells it */
  constructor(preset) {
    Object.assign(this, preset);
    this.material = new Material(preset.cells, CHUNK);
    this.steps = 0;
    this.strain = 0;
    this.waiting = []; // events to come, in order
    this.ramp = null;
    this.held = null;
    this.listener = null;
    const { v, n } = this.material;
    this.recent = { left: Array(KEPT).fill(v[0]), right: Array(KEPT).fill(v[n - 1]) };
  }

  get time() { return this.steps * this.dt; }

  /** Length of a run in time units. */
  get chunk() { return CHUNK * this.dt; }

  /** Begin events, whose times count from now. */
  play(events) {
    const now = this.time;
    this.waiting.push(...events.map((event) => ({ ...event, at: event.at + now })));
    this.waiting.sort((a, b) => a.at - b.at);
  }

  /** Fire the pulse of an end and listen; `echo` and `listening` tell of it. */
  probe(end) {
    const probe = this.probes[end];
    const rest = this.rest(end, Math.ceil((16 * Math.PI) / probe.omega_c / this.dt));
    const reach = (probe.weights.length - 1) / 2;
    this.listener = { end, probe, reach, rest, v: this.recent[end].slice(-reach).map((v) => v - rest) };
    this.begin({ end, kind: 'pulse', duration: 12 * probe.sigma, rest, ...probe });
  }

  get listening() { return this.listener !== null; }

  /** Phase in which an end rests: 1 active, 0 inactive. */
  phase(end) {
    const j = end === 'left' ? 0 : this.cells.n - 1;
    return this.material.delta(j) > (this.phases[0] + this.phases[1]) / 2 ? 1 : 0;
  }

  /** Places of the walls, counted from 1, the first on the left. */
  get walls() {
    const found = [], middle = (this.phases[0] + this.phases[1]) / 2;
    for (let j = 1; j < this.cells.n; j++) {
      const [a, b] = [this.material.delta(j - 1) - middle, this.material.delta(j) - middle];
      if (a > 0 !== b > 0) found.push(j + a / (a - b));
    }
    return found;
  }

  /** Levels at which walls rest, the lowest first; the chain shows them, an instrument has to listen. */
  get levels() {
    const { defects } = this.about;
    const nearest = (wall) => defects.reduce((best, site, level) => (Math.abs(site - wall) < Math.abs(defects[best] - wall) ? level : best), 0);
    return [...new Set(this.walls.map(nearest))];
  }

  /** Advance by one chunk. */
  run() {
    const { material, dt } = this, steps = CHUNK;
    while (this.waiting.length && this.waiting[0].at <= this.time + 1e-6) this.begin(this.waiting.shift());
    const times = Array.from({ length: steps * this.nodes.length }, (_, i) => (Math.floor(i / this.nodes.length) + this.nodes[i % this.nodes.length]) * dt);
    this.straining(times);
    const ends = material.advance(steps, this.driving(times));
    this.steps += steps;
    for (const [row, end] of ['left', 'right'].entries()) this.hear(end, ends[row]);
  }

  begin(event) {
    if (event.times) {
      this.ramp = { ...event, from: this.time };
      return;
    }
    const site = event.end === 'left' ? 1 : this.cells.n;
    this.held = { ...event, site, from: this.time, start: this.material.v[site - 1], rest: event.rest ?? this.rest(event.end, 64) };
  }

  rest(end, samples) {
    const recent = this.recent[end].slice(-samples);
    return recent.reduce((sum, v) => sum + v, 0) / recent.length;
  }

  /** Put the displacement of the substrate's end into the material's memory. */
  straining(times) {
    const { ramp, material } = this;
    if (ramp) {
      const since = this.time - ramp.from;
      times.forEach((t, i) => { this.strain = cubic(ramp, since + t); material.V_N[i] = this.strain * this.length; });
      if (since + times.at(-1) >= ramp.times.at(-1)) this.ramp = null;
    } else {
      material.V_N.fill(this.strain * this.length);
    }
  }

  /** Put the motion of a driven end into the material's memory; return which it is, and how long. */
  driving(times) {
    const { held, material } = this;
    if (!held) return undefined;
    const since = this.time - held.from;
    let driven = 0;
    for (const t of times) {
      if (since + t > lasts(held) + 1e-9) break;
      const [v, speed] = motion(held, since + t);
      material.motion[driven] = v;
      material.speeds[driven] = speed;
      driven += 1;
    }
    if (driven < times.length) this.held = null;
    return { site: held.site, driven };
  }

  hear(end, samples) {
    const recent = this.recent[end];
    recent.push(...samples);
    recent.splice(0, recent.length - KEPT);
    const { listener } = this;
    if (listener?.end !== end) return;
    for (const v of samples) listener.v.push(v - listener.rest);
  }

  /**
   * What is heard so far: the demodulated signal, and where it crosses the threshold first.
   *
   * @returns {object} end, x and y of v_c, delay or null, level or null, delays, done
   */
  echo() {
    const { end, probe, reach, v } = this.listener, { dt } = this;
    const loud = [], sums = [0];
    for (let i = 0; i + 2 * reach < v.length; i++) {
      let carried = 0;
      for (let k = 0; k <= 2 * reach; k++) carried += probe.weights[k] * v[i + k];
      loud.push(Math.abs(carried));
      sums.push(sums[i] + loud[i]);
    }
    const x = [], y = [];
    let delay = null;
    for (let i = 0; i + probe.half < loud.length; i++) {
      const t = (i + 1) * dt;
      const v_c = (sums[i + probe.half + 1] - sums[Math.max(0, i - probe.half)]) / (2 * probe.half + 1);
      if (delay === null && t > probe.blanking && v_c > Math.max(probe.v_th * Math.exp(-probe.gain * t), FAINTEST)) delay = t;
      if (t > probe.blanking) { x.push(t); y.push(v_c); }
    }
    const heard = x.at(-1) ?? 0;
    const done = heard > probe.listen || (delay !== null && heard > delay + TAIL && probe.delays.length > 0);
    return { end, x, y, delay, level: delay === null ? null : nearest(probe.delays, delay), delays: probe.delays, done };
  }

  silence() { this.listener = null; }
}

/** Return the strain of a move at a time since it began: cubics through its points. */
function cubic({ times, strains, rates }, t) {
  if (t >= times.at(-1)) return strains.at(-1);
  const k = times.findLastIndex((start) => start <= t), width = times[k + 1] - times[k];
  const x = (t - times[k]) / width, rise = strains[k + 1] - strains[k];
  const [early, late] = rates.length ? [width * rates[k], width * rates[k + 1]] : [rise, rise];
  const c3 = early - rise + (late - rise), c2 = rise - early - c3;
  return strains[k] + x * (early + x * (c2 + x * c3));
}

/** Return how long an end is held. */
const lasts = ({ kind, duration, start, target, speed, hold = 0 }) =>
  (kind === 'pulse' ? duration : Math.abs(target - start) / speed + hold);

/** Return displacement and velocity of a held end; see mlmem/instrument/end.py. */
function motion(held, t) {
  if (held.kind === 'pulse') {
    const x = (t - 6 * held.sigma) / held.sigma, envelope = held.A * Math.exp(-HALF * x * x);
    const wave = Math.sin(held.omega_c * t), slope = held.omega_c * Math.cos(held.omega_c * t);
    return [held.rest + envelope * wave, envelope * (slope - (x / held.sigma) * wave)];
  }
  const way = held.target - held.start;
  if (held.kind === 'move') {
    const velocity = Math.sign(way) * held.speed;
    return [held.start + velocity * t, velocity];
  }
  const rate = way ? held.speed / Math.abs(way) : 0, s = Math.min(t * rate, 1);
  const x = s + held.late * s * (s - 1), clock = 1 + held.late * (2 * s - 1);
  return [held.start + way * x * x * (3 - 2 * x), 6 * way * rate * x * (1 - x) * clock];
}

function nearest(delays, delay) {
  if (!delays.length) return null;
  return delays.reduce((best, each, level) => (Math.abs(each - delay) < Math.abs(delays[best] - delay) ? level : best), 0);
}

/** Return how a register is brought from one word to another: see mlmem/moves/kick.py. */
export function wordWay(element, present, wanted) {
  const { register, about } = element, [inactive, active] = element.phases;
  const walls = (word) => [...Array(about.levels).keys()].filter((level) => (word >> level) & 1);
  const [kept, all] = [walls(present), walls(wanted)];
  const stay = kept.every((level, k) => all[all.length - kept.length + k] === level);
  const events = [];
  let at = 0;
  if (!stay) {
    events.push({ at, ...register.clearing_pulse });
    at += register.clearing_pulse.duration + register.cleared;
  }
  for (let k = stay ? kept.length : 0; k < all.length; k++) {
    const speed = register.speeds[k % 2][all[all.length - 1 - k]];
    const event = { at: rounded(at), end: 'left', kind: 'kick', target: k % 2 ? inactive : active, speed, late: register.late, hold: register.hold };
    events.push(event);
    at = event.at + (active - inactive) / speed + register.hold + register.settle;
  }
  return { events, duration: at };
}

const rounded = (t) => 20 * Math.ceil(t / 20);
