// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// A running element on the page.

import { COUNTS } from './colours.js';
import { Controls } from './controls.js';
import { Panel } from './panel.js';
import { Track } from './track.js';
import { Wire } from './wire.js';

const GROWTH = 75; // milliseconds after which the picture over time has grown by a pixel or so
const WORDS = ['healthy', 'warning', 'failing', 'stale'];
const TONES = ['good', 'warn', 'bad', 'bad'];

export class Live {
  constructor() {
    this.state = { walls: [], strain: 0 };
    this.track = new Track();
    this.painted = 0;
    this.delays = {};
    this.wire = new Wire((head) => this.take(head));
    this.controls = new Controls(this.wire, (text, kind) => this.log(text, kind));
    this.panel = new Panel(this.controls, true);
    for (const button of document.querySelectorAll('.probe')) {
      button.onclick = () => this.controls.ask(button, { do: 'read', end: button.dataset.end });
    }
    const turn = () => {
      if (this.changed && !document.hidden) this.draw();
      requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }

  get panels() { return [this.panel]; }
  get caption() { return document.getElementById('node').textContent; }

  draw() {
    this.changed = false;
    this.panel.show(this.state);
    if (performance.now() - this.painted > GROWTH) {
      this.painted = performance.now();
      this.panel.picture.draw();
    }
    this.controls.strained(this.state.strain);
  }

  repaint() {
    this.panel.repaint();
    this.changed = true;
  }

  take(head) {
    this[`on_${head.k}`]?.(head);
    this.changed = true;
  }

  on_wire({ open }) {
    if (open) return;
    this.notice('The server is gone. Waiting for it.');
    this.tone('bad', 'gone');
  }

  on_link({ alive, text }) {
    this.alive = alive;
    this.notice(alive ? '' : `No memory node: ${text}. The page goes on as soon as it is there.`);
    if (!alive) this.tone('bad', 'silent');
  }

  on_element(about) {
    const other = this.about && this.about.cells !== about.cells;
    const first = !this.about || other || JSON.stringify(this.about.defects) !== JSON.stringify(about.defects);
    this.about = about;
    document.getElementById('node').textContent = about.node;
    document.getElementById('facts').textContent = `${about.levels} levels, ${about.cells} cells, ${about.substrate} substrate`;
    if (other) { this.track = new Track(); this.state.column = null; }
    if (first) this.panel.set(about, this.track, 'Content');
    this.controls.set(about);
  }

  on_history({ t, strain, walls, data }) {
    if (!this.about || this.track.t.length) return;
    const past = Track.of(t, data, walls, { t: [...t], y: strain });
    Object.assign(this.track, past);
    Object.assign(this.state, { column: past.columns.at(-1), walls: walls.at(-1), strain: strain.at(-1) });
  }

  on_picture({ t, strain, walls, data, doing }) {
    Object.assign(this.state, { strain, walls, doing });
    if (data && data.length === this.about?.rows) {
      this.state.column = data;
      if (t < this.track.end) Object.assign(this.track, new Track()); // another life of the server
      this.track.push(t, data, walls, strain);
    }
  }

  on_level({ level }) {
    if (this.state.level !== level) this.state.confidence = null;
    this.state.level = level;
    if (this.outcome?.level === level) this.state.confidence = this.outcome.confidence;
  }

  on_outcome({ ok, text, values, t }) {
    const number = (name) => (values[name] != null && values[name] !== 'None' ? Number(values[name]) : null);
    this.outcome = { level: number('level'), confidence: number('confidence') };
    if (this.state.level === this.outcome.level) this.state.confidence = this.outcome.confidence;
    if (this.echo && values.end) {
      this.echo.end = values.end === 'left' ? 'left' : 'right';
      this.echo.level = this.outcome.level;
      this.echo.delay = number('delay');
      this.showEcho();
    }
    const found = ok && values.level != null ? `: ${describe(this.outcome.level)}` : '';
    const delay = ok && number('delay') != null ? `, delay ${number('delay').toFixed(2)}` : '';
    const failed = ok ? '' : `${values.procedure} failed: `;
    if (this.told !== `${t} ${text}`) this.log(`${failed}${text}${found}${delay}`, ok ? '' : 'no', t);
    this.told = `${t} ${text}`;
  }

  on_echo({ samples, data }) {
    const inactive = this.state.column && this.state.column[0] < COUNTS / 2;
    this.echo = { x: data.slice(0, samples), y: data.slice(samples), end: inactive ? 'right' : 'left' };
    this.showEcho();
  }

  showEcho() {
    this.echo.delays = this.delays[this.echo.end] ?? [];
    this.panel.echo.show(this.echo);
  }

  on_health({ parts }) {
    const worst = Math.max(...Object.values(parts).map((part) => part.severity));
    const resting = ['paused', 'inactive'].find((word) => parts.loop?.text === word);
    const faulty = parts.faults?.severity > 0;
    this.tone(TONES[worst], worst === 1 && faulty ? 'faulty' : worst ? WORDS[worst] : resting ?? WORDS[0]);
    const rows = Object.entries(parts).map(([name, part]) => {
      const row = document.createElement('tr');
      row.className = TONES[part.severity];
      row.style.setProperty('--tone', `var(--${TONES[part.severity]})`);
      const mark = Object.assign(document.createElement('i'), { className: 'mark' });
      row.append(cell(name), cell(mark), cell(part.text));
      return row;
    });
    document.getElementById('parts').replaceChildren(...rows);
    this.controls.health(parts);
    const { delays_left: left, delays_right: right, confidence, level } = { ...parts.transducer?.values, ...parts.memory?.values };
    const before = JSON.stringify(this.delays);
    for (const [end, text] of Object.entries({ left, right })) if (text) this.delays[end] = text.split(' ').map(Number);
    if (this.echo && JSON.stringify(this.delays) !== before) this.showEcho();
    if (confidence != null && Number(level) === this.state.level) this.state.confidence ??= Number(confidence);
  }

  tone(tone, word) {
    document.getElementById('health').className = `health live-only ${tone}`;
    document.getElementById('word').textContent = word;
  }

  notice(text) {
    const notice = document.getElementById('notice');
    notice.hidden = !text;
    notice.textContent = text;
  }

  log(text, kind = '', t = this.track.end) {
    const item = document.createElement('li');
    item.className = kind;
    const time = Object.assign(document.createElement('time'), { textContent: `${t.toFixed(1)} s` });
    const what = document.createElement('span');
    what.append(text);
    item.append(time, what);
    const list = document.getElementById('log');
    list.prepend(item);
    while (list.children.length > 100) list.lastChild.remove();
  }
}

const describe = (level) => (level >= 0 ? `level ${level}` : level === -1 ? 'blank' : 'unknown');

function cell(content) {
  const td = document.createElement('td');
  td.append(content);
  return td;
}
