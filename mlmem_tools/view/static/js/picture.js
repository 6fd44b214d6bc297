// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The x-t picture of the configuration, and the strain below it on the same time axis.

import { fitted } from './chain.js';
import { configuration, magnified, paintColours, place, table, tone } from './colours.js';
import { name, signed, Tip } from './page.js';
import { about0, axis, lines, sizeOf } from './plot.js';
import { last } from './track.js';
import { zoomable } from './zoom.js';

const SPAN = 20; // seconds that a running element's picture shows
const STALE = 1 / 400; // of the usual time, for which the last column is drawn
const ROOM = 1.12; // the strain's axis over the largest strain
const LEFT = 46, RIGHT = 40; // pixels beside the picture

let count = 0;

export class Picture {
  /**
   * @param {Element} root of a panel
   * @param {boolean} live whether it grows: a running element
   * @param {number} usual seconds that it shows then
   */
  constructor(root, live, usual = SPAN) {
    this.usual = usual;
    this.stale = STALE * usual;
    this.gain = 1; // of small waves
    this.root = root.querySelector('.picture');
    this.below = root.querySelector('.strains');
    this.button = root.querySelector('.follow');
    this.colours = root.querySelector('.colours');
    this.key = `time ${count++}`;
    this.live = live;
    this.button.onclick = () => this.follow();
    this.image = document.createElement('canvas');
    new ResizeObserver(() => this.fit()).observe(this.root);
  }

  /** @param {number} end of the time axis, for a session beside a longer one */
  set(about, track, end = track.end) {
    this.about = about;
    this.track = track;
    this.whole = [0, Math.max(end, 0.1)];
    this.follow();
    this.build();
  }

  /** Show all cells, and the latest time or the whole session. */
  follow() {
    this.following = this.live;
    this.span = this.usual;
    this.x = this.whole;
    this.y = [0.5, this.about.cells + 0.5];
    this.draw();
  }

  /** The ranges in view, for the zoom. */
  get view() {
    return {
      get: () => ({ x: this.range(), y: this.y }),
      all: () => this.follow(),
      set: (x, y, zoom = false) => this.move(x, y, zoom),
    };
  }

  range() {
    if (!this.following) return this.x;
    const end = Math.max(this.track.end, this.track.begin + this.span);
    return [end - this.span, end];
  }

  move(x, y, zoom) {
    const span = Math.max(0.05, Math.min(x[1] - x[0], 1.2 * Math.max(this.track.end - this.track.begin, this.usual)));
    if (this.following && zoom) {
      this.span = span;
    } else {
      const low = Math.max(this.track.begin - span / 2, Math.min(x[0], this.track.end - span / 2));
      this.following = this.live && low + span >= this.track.end && x[0] >= this.range()[0];
      this.span = span;
      this.x = [low, low + span];
    }
    if (y) {
      const cells = this.about.cells, tall = Math.max(4, Math.min(cells, y[1] - y[0]));
      const foot = Math.max(0.5, Math.min(cells + 0.5 - tall, y[0]));
      this.y = [foot, foot + tall];
    }
    this.draw();
  }

  build() {
    this.plot?.destroy();
    this.lower?.destroy();
    if (!this.about || !this.root.clientWidth) return;
    const { defects } = this.about;
    const every = Math.ceil(defects.length / 12);
    const shown = this.shown = defects.filter((_, level) => level % every === 0);
    const cursor = { drag: { x: false, y: false }, points: { show: false }, sync: { key: this.key, setSeries: false, scales: ['x', null] } };
    this.plot = new uPlot({
      ...sizeOf(this.root), legend: { show: false }, padding: [6, RIGHT - 30, 0, 0],
      cursor: { ...cursor, x: true, y: true },
      scales: { x: { time: false, range: () => this.range() }, y: { range: () => this.y } },
      axes: [
        axis({ size: 8, values: () => [], ticks: { show: false } }),
        axis({ scale: 'y', size: LEFT, label: 'site', labelSize: 14, splits: () => shown }),
        axis({ scale: 'y', side: 1, size: RIGHT - 12, label: 'level', labelSize: 14, splits: () => shown, values: (_, sites) => sites.map((site) => defects.indexOf(site)) }),
      ],
      series: [{}, { scale: 'y', show: true, stroke: 'transparent', points: { show: false } }],
      hooks: { drawClear: [(plot) => this.paint(plot)], setCursor: [(plot) => this.point(plot)] },
      plugins: [zoomable(this.view)],
    }, [[0], [null]], this.root);
    this.lower = new uPlot({
      ...sizeOf(this.below), legend: { show: false }, padding: [4, RIGHT + 12, 0, 0],
      cursor: { ...cursor, y: false },
      scales: { x: { time: false, range: () => this.range() }, y: { range: () => this.strains() } },
      axes: [
        axis({ values: (_, times) => times.map((t) => `${+t.toFixed(3)} s`), size: 26 }),
        axis({ size: LEFT, label: 'strain', labelSize: 14, grid: lines(), splits: (_u, _axis, _low, high) => about0(high / ROOM), values: (_, all) => all.map((v) => (v ? signed(v, 2) : '0')) }),
      ],
      series: [{}, { stroke: tone('strain'), width: 1.5, points: { show: false }, fill: tone('strain') + '22', fillTo: 0 }],
      plugins: [zoomable({ ...this.view, get: () => ({ x: this.range(), y: null }), set: (x, _, zoom) => this.move(x, null, zoom) })],
    }, [[0], [0]], this.below);
    this.tip = new Tip(this.plot.over);
    this.needle = null;
    this.paintScale();
    name(this.plot.ctx.canvas, 'Configuration of every cell over time');
    name(this.lower.ctx.canvas, 'Strain of the substrate over time');
    this.draw();
  }

  fit() {
    if (!this.plot) return this.about && this.build();
    if (!this.root.clientWidth) return;
    this.plot.setSize(sizeOf(this.root));
    this.lower.setSize(sizeOf(this.below));
    this.paintScale();
    this.draw();
  }

  /** Paint the colour bar. */
  paintScale() {
    const phases = this.about.phases.map((delta) => delta.toFixed(2).replace('-', '−'));
    paintColours(fitted(this.colours), phases);
    name(this.colours, `Colours: ${phases[0]} is the inactive phase, ${phases[1]} the active one`);
  }

  /** Draw; the needle is the time that is shown, in a session. */
  draw(needle = this.needle) {
    if (!this.plot) return;
    this.needle = needle;
    this.button.hidden = this.following || !this.live;
    const { t, y } = this.track.strain;
    this.plot.redraw(false, true); // the needle may have moved alone
    this.rescale(this.plot);
    this.lower.setData([t, y], false);
    this.rescale(this.lower);
  }

  rescale(plot) {
    const ranges = { x: this.range(), y: plot === this.plot ? this.y : this.strains() };
    for (const [scale, [min, max]] of Object.entries(ranges)) plot.setScale(scale, { min, max });
  }

  /** Return the range of strain in view, symmetric about zero. */
  strains() {
    const { t, y } = this.track.strain, [from, to] = this.range();
    let most = 0.01;
    for (let i = Math.max(0, last(t, from)); i < t.length && t[i] <= to; i++) most = Math.max(most, Math.abs(y[i]));
    return [-ROOM * most, ROOM * most];
  }

  /** Paint the columns in view into the plot, one for each pixel across. */
  paint(plot) {
    const { left, top, width, height } = plot.bbox;
    const { t, columns } = this.track;
    const context = plot.ctx;
    context.fillStyle = tone('soft');
    context.fillRect(left, top, width, height);
    if (!t.length) return;
    const rows = this.about.rows, across = Math.max(1, Math.round(width));
    if (this.image.width !== across || this.image.height !== rows) {
      this.image.width = across;
      this.image.height = rows;
    }
    const brush = this.image.getContext('2d');
    const pixels = brush.createImageData(across, rows);
    const out = new Uint32Array(pixels.data.buffer), colours = table();
    const [from, to] = this.range();
    let index = last(t, from);
    for (let x = 0; x < across; x++) {
      const at = from + ((x + 0.5) / across) * (to - from);
      while (index + 1 < t.length && t[index + 1] <= at) index++;
      if (index < 0 || at > t.at(-1) + this.stale) continue;
      const column = columns[index];
      for (let row = 0; row < rows; row++) out[(rows - 1 - row) * across + x] = colours[place(magnified(column[row], this.gain))];
    }
    brush.putImageData(pixels, 0, 0);
    const cells = this.about.cells, scale = rows / cells;
    const [low, high] = this.y;
    context.imageSmoothingEnabled = false;
    context.drawImage(this.image, 0, (cells + 0.5 - high) * scale, across, (high - low) * scale, left, top, width, height);
    context.fillStyle = tone('ink');
    for (const site of this.shown) {
      if (site < low || site > high) continue;
      context.globalAlpha = 0.16;
      context.fillRect(left, plot.valToPos(site, 'y', true), width, 1);
    }
    context.globalAlpha = 1;
    if (this.needle != null && this.needle >= from && this.needle <= to) {
      const x = plot.valToPos(this.needle, 'x', true);
      context.fillRect(x - 0.75 * devicePixelRatio, top, 1.5 * devicePixelRatio, height);
    }
  }

  point(plot) {
    const { left, top } = plot.cursor;
    const t = plot.posToVal(left, 'x'), site = Math.round(plot.posToVal(top, 'y'));
    const index = last(this.track.t, t);
    const over = left >= 0 && top >= 0 && site >= 1 && site <= this.about.cells;
    if (!over || index < 0 || t > this.track.t.at(-1) + this.stale) return this.tip.hide();
    const strain = this.track.strain.y[last(this.track.strain.t, t)] ?? 0;
    const delta = configuration(this.about, this.track.columns[index], site);
    this.tip.show(`${t.toFixed(2)} s   cell ${site}\nΔ ${delta.toFixed(4)}   strain ${signed(strain, 4)}`, left, top - 44);
  }
}
