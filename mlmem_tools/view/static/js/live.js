// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// A running element on the page.

import { Controls } from './controls.js';
import { probed } from './echo.js';
import { content, entry, facts, find, found, make, notice, number, put, row } from './page.js';
import { Panel } from './panel.js';
import { Track } from './track.js';
import { Wire } from './wire.js';

const GROWTH = 75; // milliseconds in which the picture over time grows by about a pixel
const WORDS = ['healthy', 'warning', 'failing', 'stale'];
const TONES = ['good', 'warn', 'bad', 'bad'];

export class Live {
  constructor() {
    this.state = { walls: [], strain: 0 };
    this.track = new Track();
    this.painted = 0;
    this.delays = {};
    this.wire = new Wire((head) => this.take(head));
    this.controls = new Controls(this.wire, (what, className) => this.log(what, className));
    this.panel = new Panel(this.controls);
    for (const button of document.querySelectorAll('.probe')) {
      button.onclick = () => this.controls.ask(button, { do: 'read', end: button.dataset.end });
    }
  }

  get caption() { return find('node').textContent; }

  /** Draw before the browser paints next; never in a hidden page. */
  change() {
    if (!this.changed) requestAnimationFrame(() => this.draw());
    this.changed = true;
  }

  draw() {
    this.changed = false;
    this.panel.show(this.state);
    if (performance.now() - this.painted > GROWTH) {
      this.painted = performance.now();
      this.panel.picture.draw();
    }
    this.controls.strained(this.state.strain);
  }

  magnify(gain) { this.panel.magnify(gain); }

  repaint() {
    this.panel.repaint();
    this.change();
  }

  take(head) {
    this[`on_${head.k}`](head);
    this.change();
  }

  on_lost() {
    notice('The connection to the page\'s server is lost. Reconnecting.');
    this.tone('bad', 'gone');
  }

  on_link({ problem }) {
    notice(problem && `No memory node: ${problem}. The page continues as soon as it answers.`);
    if (problem) this.tone('bad', 'silent');
  }

  on_element(about) {
    const element = JSON.stringify({ ...about, faults: null, speed: null }); // which change in its life
    if (this.element !== element) { // the first one, or another
      this.element = element;
      this.track = new Track();
      this.state.column = null;
      this.panel.set(about, this.track, 'Content');
    }
    this.about = about;
    find('node').textContent = about.node;
    find('facts').textContent = facts(about);
    this.controls.set(about);
  }

  on_history(head) {
    if (!this.about || this.track.end) return;
    Object.assign(this.track, new Track(head));
    Object.assign(this.state, { column: this.track.columns.at(-1), walls: head.walls, strain: head.strain[1].at(-1) ?? 0 });
  }

  on_picture({ t, held, strain, walls, data, doing }) {
    const column = data?.length === this.about?.rows ? data : null;
    if (held) this.track.push(held, this.state.strain, this.state.column); // until then nothing changed
    Object.assign(this.state, { strain, walls, doing, column });
    if (t < this.track.end) Object.assign(this.track, new Track()); // the server has been restarted
    this.track.push(t, strain, column);
  }

  on_level({ level }) {
    if (this.state.level !== level) this.state.confidence = null;
    this.state.level = level;
    if (this.outcome?.level === level) this.state.confidence = this.outcome.confidence;
  }

  on_content({ text, values, t }) {
    this.state.why = text;
    if (values.since && this.toldContent !== text) this.log(text, 'no', t); // every new connection repeats it
    this.toldContent = text;
  }

  on_outcome({ severity, text, values, t }) {
    const ok = severity === 0, delay = number(values, 'delay');
    this.outcome = { level: content(values), confidence: number(values, 'confidence') };
    if (this.state.level === this.outcome.level) this.state.confidence = this.outcome.confidence;
    if (this.echo && values.end) {
      Object.assign(this.echo, { end: probed(values), level: this.outcome.level, delay });
      this.showEcho();
    }
    if (this.told !== `${t} ${text}`) { // every new connection repeats it
      const what = ok && found(values, true);
      this.log(`${ok ? '' : `${values.procedure} failed: `}${text}${what ? `: ${what}` : ''}`, ok ? '' : 'no', t);
    }
    this.told = `${t} ${text}`;
  }

  on_echo({ samples, data }) {
    this.echo = { x: data.slice(0, samples), y: data.slice(samples), end: probed({}, this.state.column) };
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
    find('parts').replaceChildren(...Object.entries(parts).map(([name, part]) => {
      const line = row('td', [name, make('i', { className: 'mark' }), part.text]);
      line.className = TONES[part.severity];
      line.style.setProperty('--tone', `var(--${TONES[part.severity]})`);
      return line;
    }));
    this.controls.health(parts);
    this.panel.twin.show(parts.twin);
    const known = { ...parts.transducer?.values, ...parts.memory?.values };
    const { delays_left: left, delays_right: right, confidence } = known;
    const before = JSON.stringify(this.delays);
    for (const [end, text] of Object.entries({ left, right })) if (text) this.delays[end] = text.split(' ').map(Number);
    if (this.echo && JSON.stringify(this.delays) !== before) this.showEcho();
    if (confidence != null && content(known) === this.state.level) this.state.confidence ??= Number(confidence);
  }

  tone(tone, word) {
    find('health').className = `health live-only ${tone}`;
    put(find('word'), word);
  }

  log(what, className = '', t = this.track.end) {
    find('log').prepend(entry(`${t.toFixed(1)} s`, className, [what]));
    while (find('log').children.length > 100) find('log').lastChild.remove();
  }
}
