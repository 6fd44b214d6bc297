// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The chain cell by cell with its wall, the levels below it, and the strain of every spring.

import { COUNTS, css, tone } from './colours.js';

const BUTTON = 31; // pixels that the button of a level needs

export class Chain {
  /**
   * @param {Element} root of a panel
   * @param {object} act write(level, control), pick(cell); absent for a session
   */
  constructor(root, act) {
    this.canvas = root.querySelector('.chain');
    this.springs = root.querySelector('.springs');
    this.row = root.querySelector('.levels');
    this.now = root.querySelector('.strain-now');
    this.act = act;
    this.buttons = [];
    this.tip = Object.assign(document.createElement('div'), { className: 'tip', hidden: true });
    this.canvas.parentElement.style.position = 'relative';
    this.canvas.after(this.tip);
    this.canvas.addEventListener('pointermove', (event) => this.point(event));
    this.canvas.addEventListener('pointerleave', () => { this.tip.hidden = true; });
    this.canvas.addEventListener('click', (event) => this.act?.pick(this.site(event)));
    new ResizeObserver(() => { this.arrange(); this.draw(); }).observe(this.canvas);
  }

  set(about) {
    this.about = about;
    this.arrange();
  }

  show(state) {
    this.state = state;
    for (const [level, button] of this.buttons.entries()) {
      button.classList.toggle('held-here', level === state.level);
      button.classList.toggle('wanted', state.doing?.name === 'write' && level === state.doing.level);
    }
    this.draw();
  }

  /** Put a button below every defect, as far as there is room. */
  arrange() {
    if (!this.about) return;
    const { defects, cells } = this.about;
    const room = (this.canvas.clientWidth / cells) * (defects.length > 1 ? defects[1] - defects[0] : cells);
    const key = `${cells} ${defects} ${room >= BUTTON}`;
    if (key === this.key) return;
    this.key = key;
    this.buttons = [];
    this.row.replaceChildren();
    this.row.classList.toggle('crowded', room < BUTTON);
    if (room < BUTTON) return this.arrangeMany();
    this.buttons = defects.map((site, level) => {
      const button = document.createElement('button');
      button.textContent = level;
      button.dataset.level = level;
      button.title = this.act ? `Write level ${level} (${this.about.codes[level]}), site ${site}` : `Level ${level}, site ${site}`;
      button.disabled = !this.act;
      button.style.left = `${(100 * (site - 0.5)) / cells}%`;
      button.onclick = () => this.act?.write(level, button);
      return button;
    });
    this.row.append(...this.buttons);
  }

  /** Put ticks below the defects of many levels: a click takes the nearest, a number says which. */
  arrangeMany() {
    const { defects, cells } = this.about;
    const at = (site) => (site - 0.5) / cells;
    const strip = Object.assign(document.createElement('div'), { className: 'strip' });
    const word = document.createElement('span');
    strip.append(word, ...defects.map((site) => {
      const tick = document.createElement('i');
      tick.style.left = `${100 * at(site)}%`;
      return tick;
    }));
    const nearest = (event) => {
      const box = strip.getBoundingClientRect(), share = (event.clientX - box.left) / box.width;
      return defects.reduce((best, site, level) => (Math.abs(at(site) - share) < Math.abs(at(defects[best]) - share) ? level : best), 0);
    };
    strip.onpointermove = (event) => {
      const level = nearest(event);
      word.textContent = `${this.act ? 'write ' : ''}${level}`;
      word.style.left = `${100 * at(defects[level])}%`;
    };
    strip.onpointerleave = () => { word.textContent = ''; };
    strip.onclick = (event) => this.act?.write(nearest(event), strip);
    const input = Object.assign(document.createElement('input'), { type: 'number', min: 0, max: defects.length - 1, value: 0, ariaLabel: 'Level' });
    const button = Object.assign(document.createElement('button'), { textContent: 'Write' });
    button.onclick = () => this.act?.write(Number(input.value), button);
    const many = Object.assign(document.createElement('div'), { className: 'many live-only' });
    many.append('Level', input, button);
    this.row.append(strip, many);
  }

  site(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left) / box.width;
    return Math.max(1, Math.min(this.about.cells, Math.floor(share * this.about.cells) + 1));
  }

  point(event) {
    if (!this.state?.column) return;
    const { stride, phases, springs } = this.about;
    const site = this.site(event);
    const delta = phases[0] + (this.state.column[Math.floor((site - 1) / stride)] / COUNTS) * (phases[1] - phases[0]);
    const spring = this.state.strain * springs[Math.min(site, springs.length) - 1];
    this.tip.textContent = `cell ${site}   Δ ${delta.toFixed(4)}\nits spring ${signed(spring, 4)}`;
    this.tip.hidden = false;
    const x = event.offsetX;
    this.tip.style.left = `${Math.min(x + 12, this.canvas.clientWidth - this.tip.offsetWidth)}px`;
    this.tip.style.top = '2px';
  }

  draw() {
    if (!this.about || !this.state) return;
    this.drawCells();
    this.drawSprings();
  }

  drawCells() {
    const { context, width, height } = fitted(this.canvas);
    const { column, walls } = this.state;
    if (!column) return;
    const top = 20, pitch = width / column.length, gap = pitch > 3.2 ? 1 : 0;
    for (let i = 0; i < column.length; i++) {
      const share = Math.max(0, Math.min(1.15, column[i] / COUNTS));
      const tall = (height - top) * (0.4 + 0.5 * share);
      context.fillStyle = css(column[i]);
      context.beginPath();
      context.roundRect(i * pitch, height - tall, pitch - gap, tall, [Math.min(2, pitch / 3), Math.min(2, pitch / 3), 0, 0]);
      context.fill();
    }
    context.font = '600 12px Inter, sans-serif';
    context.textAlign = 'center';
    for (const wall of walls) {
      const x = ((wall - 0.5) / this.about.cells) * width;
      context.fillStyle = tone('ink');
      context.fillRect(x - 0.75, top - 4, 1.5, height - top + 4);
      const text = `wall ${wall.toFixed(1)}`, half = context.measureText(text).width / 2;
      context.fillText(text, Math.max(half, Math.min(width - half, x)), 11);
    }
    if (!walls.length) {
      context.fillStyle = tone('muted');
      context.font = '12px Inter, sans-serif';
      context.fillText('no wall', width / 2, 11);
    }
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
    if (this.now.textContent !== text) this.now.textContent = text;
  }
}

/** Return a number with its sign, a true minus. */
export const signed = (value, digits) => (value < 0 ? '−' : '+') + Math.abs(value).toFixed(digits);

/** Return a canvas ready to be drawn on in CSS pixels. */
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
