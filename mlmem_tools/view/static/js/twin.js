// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The twin of an element: alpha of every cell as fitted, with its 95 % interval, beside the design;
// and how the last read compares with its forecast.

import { tone } from './colours.js';
import { name } from './page.js';
import { axis, lines, sizeOf } from './plot.js';

const BESIDE = 1.96; // standard deviations to either side of a 95 % interval

/** Return site, alpha over the design's in %, and both ends of its interval; null without a twin. */
export function fitted({ alpha, alpha_std: std } = {}) {
  if (!alpha) return null;
  const [ratio, spread] = [alpha, std].map((text) => text.split(' ').map(Number));
  const percent = (factor) => ratio.map((value, i) => 100 * (value - 1 + factor * spread[i]));
  return [ratio.map((_, i) => i + 1), percent(0), percent(BESIDE), percent(-BESIDE)];
}

/** Return the cell that has changed since the survey; null if none is known to. */
export const accused = ({ changed, site } = {}) => (changed === 'cell' ? Number(site) : null);

/** Return in words how the last read compares with its forecast. */
export function compared(text, { chi2, residual_left: left, residual_right: right }) {
  if (chi2 == null) return 'no read compared yet';
  const ends = [left, right].map((value) => Number(value).toExponential(1)).join(' and ');
  return `${text}; residual ${ends} cells at the ends, ${Number(chi2).toFixed(1)} per datum`;
}

export class Twin {
  constructor(root) {
    this.card = root.querySelector('.twin');
    this.root = root.querySelector('.cells');
    this.words = root.querySelector('.residual');
    new ResizeObserver(() => this.build()).observe(this.root);
  }

  /** @param {object} part text and values of the twin in the health, if there are any */
  show(part) {
    const data = fitted(part?.values);
    this.card.hidden = !data;
    if (!data) return;
    this.words.textContent = compared(part.text, part.values);
    this.site = accused(part.values);
    const told = `${part.values.alpha} ${this.site}`;
    if (this.told === told) return;
    this.told = told;
    this.data = data;
    this.build();
  }

  build() {
    this.plot?.destroy();
    this.plot = null;
    if (!this.data || !this.root.clientWidth) return;
    const points = { show: false }, edge = { stroke: 'transparent', points };
    this.plot = new uPlot({
      ...sizeOf(this.root), legend: { show: false }, cursor: { points },
      scales: { x: { time: false } },
      axes: [axis({ label: 'cell', size: 26 }), axis({ label: 'alpha, % off the design', grid: lines(), size: 48 })],
      bands: [{ series: [2, 3], fill: tone('active') + '44' }],
      series: [{}, { stroke: tone('active'), width: 1.5, points }, edge, edge,
        { stroke: tone('muted'), dash: [5, 4], points }],
      hooks: { draw: [(plot) => this.site && this.mark(plot)] },
    }, [...this.data, this.data[0].map(() => 0)], this.root);
    name(this.plot.ctx.canvas, `Alpha of every cell over the design's${this.site ? `: cell ${this.site} is marked` : ''}`);
  }

  /** Mark the cell that has changed. */
  mark({ ctx, bbox: { left, top, width, height }, valToPos }) {
    const x = valToPos(this.site, 'x', true), ratio = devicePixelRatio || 1, text = `cell ${this.site}`;
    ctx.save();
    ctx.fillStyle = tone('bad');
    ctx.fillRect(x - ratio, top, 2 * ratio, height);
    ctx.font = `600 ${12 * ratio}px Inter, sans-serif`;
    ctx.textAlign = x > left + width / 2 ? 'right' : 'left';
    ctx.fillText(text, x + (ctx.textAlign === 'left' ? 6 : -6) * ratio, top + 13 * ratio);
    ctx.restore();
  }
}
