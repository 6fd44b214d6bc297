// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The chain cell by cell with its walls, the levels below it, and the strain of every spring.

import { configuration, COUNTS, css, magnified, tone } from './colours.js';
import { make, name, put, signed, Tip } from './page.js';
import { toggled, walls } from './words.js';

const BUTTON = 31; // width of the button of a level in pixels

export class Chain {
  /**
   * @param {Element} root of a panel
   * @param {Controls} controls of a running element; absent for a session
   */
  constructor(root, controls) {
    this.canvas = root.querySelector('.chain');
    this.springs = root.querySelector('.springs');
    this.row = root.querySelector('.levels');
    this.now = root.querySelector('.strain-now');
    this.controls = controls;
    this.buttons = [];
    this.gain = 1; // of small waves
    this.tip = new Tip(this.canvas.parentElement);
    this.canvas.addEventListener('pointermove', (event) => this.point(event));
    this.canvas.addEventListener('pointerleave', () => this.tip.hide());
    this.canvas.addEventListener('click', (event) => this.controls?.pick(this.site(event)));
    new ResizeObserver(() => { this.arrange(); this.draw(); }).observe(this.canvas);
  }

  set(about) {
    this.about = about;
    this.arrange();
  }

  show(state) {
    this.state = state;
    const held = this.levels(state.level), wanted = state.doing?.name === 'write' ? this.levels(state.doing.content) : [];
    for (const [level, button] of this.buttons.entries()) {
      button.classList.toggle('held-here', held.includes(level));
      button.classList.toggle('wanted', wanted.includes(level));
    }
    if (!same(this.drawn, state)) this.draw();
  }

  /** Return the levels at which walls rest in a content. */
  levels(content) {
    if (content == null || !(content >= 0)) return []; // null: another client's write, whose level is not known
    return this.about.code ? walls(content, this.about.code) : [content];
  }

  /** Write a level; where there are many walls, set or clear the one there. */
  write(level, control) {
    const present = this.state?.level >= 0 ? this.state.level : 0;
    this.controls?.write(this.about.code ? toggled(present, level, this.about.code) : level, control);
  }

  /** Put a button below every defect if there is room. */
  arrange() {
    if (!this.about) return;
    const { defects, cells, code } = this.about;
    const room = (this.canvas.clientWidth / cells) * (defects.length > 1 ? defects[1] - defects[0] : cells);
    const key = `${cells} ${defects} ${Boolean(code)} ${room >= BUTTON}`;
    if (key === this.key) return;
    this.key = key;
    this.buttons = [];
    this.row.replaceChildren();
    this.row.parentElement.querySelector('.many')?.remove();
    this.row.classList.toggle('crowded', room < BUTTON);
    if (room < BUTTON) return this.arrangeMany();
    this.buttons = defects.map((site, level) => {
      const title = this.about.code ? `Level ${level}, site ${site}: ${this.controls ? 'set or clear this wall' : ''}`
        : `${this.controls ? 'Write level' : 'Level'} ${level} (${this.about.codes[level]}), site ${site}`;
      const button = make('button', { textContent: level, title, disabled: !this.controls });
      button.dataset.level = level;
      button.style.left = `${(100 * (site - 0.5)) / cells}%`;
      button.onclick = () => this.write(level, button);
      return button;
    });
    this.row.append(...this.buttons);
    if (code) this.row.after(this.makeContentField());
  }

  /** Put a tick below every defect of many levels: a click takes the nearest, or a content is typed. */
  arrangeMany() {
    const { defects, cells, code } = this.about;
    const at = (site) => (site - 0.5) / cells;
    const word = make('span');
    const strip = make('div', { className: 'strip' }, word, ...defects.map((site) => {
      const tick = make('i');
      tick.style.left = `${100 * at(site)}%`;
      return tick;
    }));
    const nearest = (event) => {
      const box = strip.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
      return defects.reduce((best, site, level) => (Math.abs(at(site) - share) < Math.abs(at(defects[best]) - share) ? level : best), 0);
    };
    strip.onpointermove = (event) => {
      const level = nearest(event);
      word.textContent = `${!this.controls ? '' : code ? 'set or clear ' : 'write '}${level}`;
      word.style.left = `${100 * at(defects[level])}%`;
    };
    strip.onpointerleave = () => { word.textContent = ''; };
    strip.onclick = (event) => this.write(nearest(event), strip);
    this.row.append(strip);
    this.row.after(this.makeContentField());
  }

  /** Return a field that writes a level or a word, decimal or as 0xa7. */
  makeContentField() {
    const { code, levels } = this.about, what = code ? 'Word' : 'Level';
    const input = make('input', code ? { type: 'text', value: '0x0', size: 20, ariaLabel: what }
      : { type: 'number', min: 0, max: levels - 1, value: 0, ariaLabel: what });
    const button = make('button', { textContent: 'Write' });
    button.onclick = () => this.controls.write(Number(input.value), button);
    return make('div', { className: 'many live-only' }, what, input, button);
  }

  site(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left) / box.width;
    return Math.max(1, Math.min(this.about.cells, Math.floor(share * this.about.cells) + 1));
  }

  point(event) {
    if (!this.state?.column) return;
    const { springs } = this.about, site = this.site(event);
    const delta = configuration(this.about, this.state.column, site);
    const spring = this.state.strain * springs[Math.min(site, springs.length) - 1];
    this.tip.show(`cell ${site}   Δ ${delta.toFixed(4)}\nstrain of its spring ${signed(spring, 4)}`, event.offsetX);
  }

  draw() {
    if (!this.about || !this.state) return;
    const { column, strain, walls } = this.state;
    this.drawn = { column, strain, walls };
    this.drawCells();
    this.drawSprings();
    const where = walls.length ? `a wall at ${walls.map((wall) => wall.toFixed(1)).join(' and ')}` : 'no wall';
    name(this.canvas, column ? `Chain of ${this.about.cells} cells: ${where}` : 'Chain: this element publishes no configuration');
    name(this.springs, `Strain of every spring of the substrate: ${this.now.textContent}`);
  }

  drawCells() {
    const { context, width, height } = fitted(this.canvas);
    const { column, walls } = this.state;
    const above = (text) => {
      context.fillStyle = tone('muted');
      context.font = '12px Inter, sans-serif';
      context.textAlign = 'center';
      context.fillText(text, width / 2, 11);
    };
    if (!column) return above('this element publishes no configuration');
    const top = 20, pitch = width / column.length, gap = pitch > 3.2 ? 1 : 0;
    for (let i = 0; i < column.length; i++) {
      const count = magnified(column[i], this.gain);
      const share = Math.max(-0.6, Math.min(1.15, count / COUNTS));
      const tall = (height - top) * (0.4 + 0.5 * share);
      context.fillStyle = css(count);
      context.beginPath();
      context.roundRect(i * pitch, height - tall, pitch - gap, tall, [Math.min(2, pitch / 3), Math.min(2, pitch / 3), 0, 0]);
      context.fill();
    }
    context.font = '600 12px Inter, sans-serif';
    context.textAlign = 'center';
    let free = 0; // from where the next text does not cover the last one
    for (const wall of walls) {
      const x = ((wall - 0.5) / this.about.cells) * width;
      context.fillStyle = tone('ink');
      context.fillRect(x - 0.75, top - 4, 1.5, height - top + 4);
      const text = `${walls.length > 2 ? '' : 'wall '}${wall.toFixed(1)}`, half = context.measureText(text).width / 2;
      const middle = Math.max(half, Math.min(width - half, x));
      if (middle - half < free) continue;
      context.fillText(text, middle, 11);
      free = middle + half + 6;
    }
    if (!walls.length) above('no wall');
  }

  drawSprings() {
    const { context, width, height } = fitted(this.springs);
    const { springs, max_strain: most } = this.about;
    const strain = this.state.strain ?? 0, middle = height / 2;
    const greatest = most * Math.max(...springs);
    context.strokeStyle = tone('line');
    context.beginPath(); context.moveTo(0, middle); context.lineTo(width, middle); context.stroke();
    context.beginPath(); context.moveTo(0, middle);
    const pitch = width / (springs.length + 1);
    const step = Math.max(1, Math.floor(springs.length / width));
    for (let i = 0; i < springs.length; i += step) {
      context.lineTo((i + 1) * pitch, middle - (strain * springs[i] * (middle - 2)) / (0.62 * greatest));
    }
    context.lineTo(width, middle); context.closePath();
    context.globalAlpha = 0.22; context.fillStyle = tone('strain'); context.fill(); context.globalAlpha = 1;
    context.strokeStyle = tone('strain'); context.lineWidth = 1.25; context.stroke();
    const kind = Math.abs(strain) < 5e-5 ? 'no strain' : strain > 0 ? 'tension' : 'compression';
    const text = kind === 'no strain' ? kind : `${kind}, strain ${signed(strain, 4)}`;
    put(this.now, text);
  }
}

/** Whether two states look alike. */
function same(before, { column, strain, walls }) {
  return before && before.strain === strain && String(before.walls) === String(walls)
    && (before.column === column || (column && before.column?.length === column.length && column.every((value, i) => value === before.column[i])));
}

/** Return the context of a canvas, cleared, and its size in CSS pixels. */
export function fitted(canvas) {
  const ratio = devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const context = canvas.getContext('2d');
  context.setTransform(ratio, 0, 0, ratio, 0, 0);
  context.clearRect(0, 0, width, height);
  context.lineWidth = 1;
  return { context, width, height };
}
