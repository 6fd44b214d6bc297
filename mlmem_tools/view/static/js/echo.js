// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The last echo: its envelope over time, and where delays are read the threshold, its delay, and that of every level.

import { COUNTS, tone } from './colours.js';
import { name, Tip } from './page.js';
import { axis, lines, sizeOf } from './plot.js';

/** Return the end that was probed: as the outcome says; without one, left if that end is active. */
export const probed = (values, column) =>
  (values.end ? values.end === 'left' : column?.[0] >= COUNTS / 2) ? 'left' : 'right';

export class Echo {
  constructor(root) {
    this.root = root.querySelector('.wave');
    this.words = root.querySelector('.delay');
    new ResizeObserver(() => this.fit()).observe(this.root);
  }

  set(about) {
    this.about = about;
    this.build();
  }

  /** @param {object} echo x, y, end, delay, level, delays; or null for none */
  show(echo) {
    this.echo = echo;
    this.build();
  }

  fit() {
    if (!this.plot) return this.build();
    if (this.root.clientWidth) this.plot.setSize(sizeOf(this.root));
  }

  build() {
    this.plot?.destroy();
    this.plot = null;
    if (!this.about || !this.root.clientWidth) return;
    const echo = this.echo;
    const { threshold, gain } = this.about.probes[echo?.end ?? 'left'];
    this.words.textContent = !echo ? 'none yet' : !threshold ? 'at the left'
      : echo.delay != null ? `from the ${echo.end}, delay ${echo.delay.toFixed(2)}` : `from the ${echo.end}`;
    const delays = (threshold && echo?.delays) || [];
    const faint = threshold ?? (echo ? Math.max(...echo.y) / 40 : 1e-4);
    const x = echo ? Array.from(echo.x) : [0, 1000];
    const y = echo ? Array.from(echo.y, (v, i) => Math.max(v * Math.exp(gain * x[i]), faint / 400)) : [null, null];
    const furthest = Math.max(...x, ...delays) * 1.02;
    const highest = Math.max(faint * 20, ...y) * 1.6;
    this.plot = new uPlot({
      ...sizeOf(this.root), legend: { show: false }, padding: [26, 10, 0, 0],
      cursor: { drag: { x: true, y: false, setScale: true }, points: { show: false }, y: false },
      scales: { x: { time: false, range: (_, low, high) => (this.zoomed(low, high) ? [low, high] : [0, furthest]) }, y: { distr: 3, range: () => [faint / 60, highest] } },
      axes: [
        axis({ label: 'delay in time units', size: 26 }),
        axis({ label: 'v_c in cells, damping compensated', grid: lines(), size: 48, splits: () => decades(faint / 60, highest), values: (_, all) => all.map(power) }),
      ],
      series: [{}, { stroke: tone('active'), width: 1.5, fill: tone('active') + '1e', points: { show: false }, fillTo: faint / 60 }],
      hooks: { draw: [(plot) => threshold && this.mark(plot, echo, threshold, delays)], setCursor: [(plot) => this.point(plot)] },
    }, [x, y], this.root);
    this.limits = [x[0], x[x.length - 1]];
    this.tip = new Tip(this.plot.over);
    name(this.plot.ctx.canvas, `Last echo: ${this.words.textContent}`);
  }

  zoomed(low, high) {
    return this.limits && (low > this.limits[0] + 1e-9 || high < this.limits[1] - 1e-9);
  }

  /** Mark the threshold, the delay of every level, and the measured delay. */
  mark(plot, echo, threshold, delays) {
    const { ctx } = plot, { left, top, width, height } = plot.bbox, ratio = devicePixelRatio || 1;
    ctx.save();
    ctx.font = `600 ${11 * ratio}px Inter, sans-serif`;
    ctx.textAlign = 'center';
    const y = plot.valToPos(threshold, 'y', true);
    ctx.strokeStyle = ctx.fillStyle = tone('warm');
    ctx.lineWidth = 1.25 * ratio;
    ctx.setLineDash([5 * ratio, 4 * ratio]);
    line(ctx, left, y, left + width, y);
    ctx.textAlign = 'right';
    ctx.fillText('threshold', left + width - 4 * ratio, y - 5 * ratio);
    ctx.textAlign = 'center';
    ctx.setLineDash([]);
    ctx.lineWidth = ratio;
    const every = Math.ceil(delays.length / 12);
    for (const [level, delay] of delays.entries()) {
      const x = plot.valToPos(delay, 'x', true), here = level === echo.level;
      if (x < left - 1 || x > left + width + 1 || (!here && level % every)) continue;
      ctx.strokeStyle = ctx.fillStyle = tone(here ? 'ink' : 'muted');
      ctx.globalAlpha = here ? 1 : 0.55;
      ctx.setLineDash([2 * ratio, 3 * ratio]);
      line(ctx, x, top, x, top + height);
      const crowded = !here && Math.abs(x - plot.valToPos(delays[echo.level], 'x', true)) < 15 * ratio;
      if (!crowded) ctx.fillText(level, x, top - 8 * ratio);
    }
    ctx.globalAlpha = 1;
    ctx.setLineDash([]);
    if (echo?.delay != null) {
      const x = plot.valToPos(echo.delay, 'x', true);
      if (x >= left && x <= left + width) {
        ctx.strokeStyle = ctx.fillStyle = tone('ink');
        ctx.lineWidth = 1.75 * ratio;
        line(ctx, x, y, x, top);
        ctx.beginPath(); ctx.arc(x, y, 4 * ratio, 0, 7); ctx.fill();
      }
    }
    ctx.restore();
  }

  point(plot) {
    const { left, idx } = plot.cursor;
    if (left < 0 || idx == null || !this.echo) return this.tip.hide();
    this.tip.show(`delay ${plot.data[0][idx].toFixed(1)}\nv_c ${plot.data[1][idx]?.toExponential(2)}`, left);
  }
}

function line(ctx, ax, ay, bx, by) {
  ctx.beginPath(); ctx.moveTo(ax, ay); ctx.lineTo(bx, by); ctx.stroke();
}

/** Return the powers of ten between two numbers. */
function decades(low, high) {
  const first = Math.ceil(Math.log10(low)), count = Math.floor(Math.log10(high)) - first + 1;
  return Array.from({ length: count }, (_, i) => 10 ** (first + i));
}

const power = (value) => `10${superscript(Math.round(Math.log10(value)))}`;

const superscript = (n) => String(n).replace(/[-\d]/g, (c) => (c === '-' ? '⁻' : '⁰¹²³⁴⁵⁶⁷⁸⁹'[c]));
