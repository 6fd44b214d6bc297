// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The page: an element that runs in the tab, drawn as `mlmem view` draws one.

import { say } from './bubble.js';
import { COUNTS } from './colours.js';
import { Element, wordWay } from './element.js';
import { describe, entry, facts, find, put, signed } from './page.js';
import { Panel } from './panel.js';
import { Sessions } from './session.js';
import { Track } from './track.js';
import { connectWaves } from './waves.js';
import { unpack } from './wire.js';

const SPAN = 1.2; // seconds of the element's time in the picture
const DRAWN = 130; // milliseconds between two drawings of what grows: picture over time, and echo
const BUDGET = 14; // milliseconds of a frame for the loop
const RELEASE = { ramp: 1200, settle: 1500 }; // of a strain set by hand, in time units
const LAUNCH = 0.05; // speed of an end that is moved
const SETTLE = 1500; // time units until a wall stands still after a kick

class Tab {
  constructor(presets) {
    this.presets = presets;
    this.span = SPAN;
    this.panel = new Panel(this);
    this.speed = Number(find('speed').value);
    this.paused = false;
    this.drawn = 0;
    find('preset').append(...Object.entries(presets).map(([name, { text }]) => new Option(`${name}, ${text}`, name)));
    find('preset').onchange = () => this.open(find('preset').value);
    find('speed').onchange = () => { this.speed = Number(find('speed').value); };
    find('pause').onclick = () => {
      this.paused = !this.paused;
      put(find('pause'), this.paused ? 'Run' : 'Pause');
    };
    for (const button of document.querySelectorAll('[data-do]')) button.onclick = () => this.act(button, button.dataset.do);
    for (const button of document.querySelectorAll('.probe')) button.onclick = () => this.read(button, button.dataset.end);
    find('strain').oninput = () => put(find('strained'), signed(Number(find('strain').value), 3));
    find('strain').onchange = () => this.follow(Number(find('strain').value));
    find('release').onclick = () => this.follow(0);
    find('quick').oninput = () => put(find('quickly'), this.kickSpeed.toFixed(3));
    let before = performance.now();
    const turn = (now) => {
      this.turn(Math.min(now - before, 50) / 1000);
      before = now;
      requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }

  /** Speed of a kick: the slider has its logarithm. */
  get kickSpeed() { return 10 ** Number(find('quick').value); }

  get seconds() { return this.element.time * this.element.unit; }

  /** Show an element of a preset, in which something is written. */
  open(name) {
    this.element = new Element(this.presets[name]);
    this.about = this.element.about;
    this.track = new Track();
    this.action = null;
    this.owed = 0;
    this.content = this.element.begun;
    this.panel.set(this.about, this.track, 'Content');
    this.panel.echo.show(null);
    find('facts').textContent = facts(this.about);
    find('strain').min = -this.about.max_strain;
    find('strain').max = this.about.max_strain;
    find('quick').oninput();
    this.column();
    this.log(`${name}: ${this.named(this.content)} was written before`);
    this.read(find('preset'), 'left');
  }

  column() {
    const { element, about } = this, [inactive, active] = element.phases;
    const scale = COUNTS / (active - inactive);
    const column = Int16Array.from({ length: about.cells }, (_, j) => Math.max(-32768, Math.min(32767, (element.material.delta(j) - inactive) * scale)));
    this.track.push(this.seconds, element.strain, column);
    this.shown = column;
  }

  turn(passed) {
    if (!this.element) return;
    if (!this.paused) {
      this.owed = Math.min(this.owed + (passed * this.speed) / this.element.unit, 4000);
      const until = performance.now() + BUDGET;
      while (this.owed >= this.element.chunk && performance.now() < until) {
        this.element.run();
        this.owed -= this.element.chunk;
        this.column();
        this.proceed();
      }
    }
    this.draw();
  }

  draw() {
    const { element, action } = this, since = action && element.time - action.from;
    this.panel.show({
      column: this.shown, strain: element.strain, walls: element.walls, level: this.content, why: this.why,
      doing: action && { name: action.name, content: action.content, for: since * element.unit, share: Math.min(1, since / action.duration) },
    });
    if (performance.now() - this.drawn > DRAWN) {
      this.drawn = performance.now();
      this.panel.picture.draw();
      const echo = element.listening && element.echo();
      if (echo && echo.x.length > 1) this.panel.echo.show(thinned(echo));
    }
    if (document.activeElement !== find('strain')) find('strain').value = element.strain;
    put(find('strained'), signed(element.strain, 3));
  }

  // --- what is done --------------------------------------------------------------------------

  /** What the chain holds, as everyone sees it: a level, a word, or -1 for blank. */
  get present() {
    const { levels, register } = this.element;
    return register ? levels.reduce((word, level) => word | (1 << level), 0) : levels.at(-1) ?? -1;
  }

  named(content) { return describe(content, Boolean(this.element.register)); }

  free(control) {
    if (this.action) say(control, `It is busy: ${this.action.name}.`);
    return !this.action;
  }

  pick() {} // a cell; it has no faults here

  write(content, control) {
    const { words } = this.about;
    if (!(Number.isInteger(content) && content >= 0 && content < words)) say(control, `The content must be from 0 to ${words - 1}.`);
    else if (this.free(control)) this.go('write', content);
  }

  act(button, name) {
    if (!this.free(button)) return;
    const { element } = this, [inactive, active] = element.phases;
    const other = element.phase('left') ? inactive : active;
    if (name === 'read') return this.read(button, 'left');
    if (name === 'erase') return this.go('erase', element.register ? 0 : -1);
    const drive = {
      launch: { end: 'left', kind: 'move', target: other, speed: LAUNCH },
      kick: { end: 'left', kind: 'kick', target: other, speed: this.kickSpeed, late: 0, hold: 20 },
    }[name];
    element.play([{ at: 0, ...drive }]);
    this.log(name === 'kick' ? `kick at ${this.kickSpeed.toFixed(3)}` : name, 'asked');
    this.moved(`a read follows the ${name}`);
    const duration = (element.phases[1] - element.phases[0]) / drive.speed + (drive.hold ?? 0) + SETTLE;
    this.begin({ name, content: null, duration, then: () => this.listen('left') });
  }

  /** Strain by hand, as fast as the actuator may. */
  follow(strain) {
    const { element } = this, way = Math.abs(strain - element.strain);
    element.play([ramp(0, element.strain, strain, Math.max(60, (1.5 * way) / element.rate))]);
    this.moved('read the element after its strain');
  }

  moved(why) {
    this.content = -2;
    this.why = why;
  }

  /** Write or erase: what the product's instrument did on the same way. */
  go(name, level) {
    const { element, present } = this;
    this.log(name === 'write' ? `write ${level}` : name, 'asked');
    const events = [], strained = Math.abs(element.strain) > 1e-6;
    if (strained) events.push(ramp(0, element.strain, 0, RELEASE.ramp));
    const first = strained ? RELEASE.ramp + RELEASE.settle : 0;
    const way = element.register ? wordWay(element, present, level) : element.ways[`${present} ${level}`];
    if (way) events.push(...way.events.map((event) => ({ ...event, at: event.at + first })));
    element.play(events);
    this.begin({ name, content: name === 'write' ? level : null, duration: first + (way?.duration ?? 0), then: () => this.listen('left') });
  }

  read(control, end) {
    if (this.free(control)) this.listen(end);
  }

  listen(end) {
    this.element.probe(end);
    this.begin({ name: 'read', content: null, duration: this.element.probes[end].listen, then: null });
  }

  begin(action) { this.action = { ...action, from: this.element.time }; }

  /** Go on when a write has ended, or an echo has been heard. */
  proceed() {
    const { action, element } = this;
    if (!action) return;
    if (!element.listening) {
      if (element.time < action.from + action.duration) return;
      this.action = null;
      action.then();
      return;
    }
    if ((element.steps / 10) % 20) return; // an echo is judged every 200 steps
    const echo = element.echo();
    if (!echo.done) return;
    element.silence();
    this.action = null;
    this.panel.echo.show(thinned(echo));
    const blank = element.phase('left') === 0; // its carrier does not travel in that phase
    this.content = element.register ? this.present : blank ? -1 : echo.level ?? -2;
    this.why = 'no echo';
    const heard = echo.delay === null || blank ? '' : `, first echo after ${echo.delay.toFixed(1)}`;
    this.log(`${this.named(this.content)}${heard}`);
  }

  log(what, className = '') {
    find('log').prepend(entry(`${this.seconds.toFixed(2)} s`, className, [what]));
    while (find('log').children.length > 60) find('log').lastChild.remove();
  }

  magnify(gain) { this.panel.magnify(gain); }

  repaint() { this.panel.repaint(); }
}

const ramp = (at, from, to, duration) => ({ at, times: [0, duration], strains: [from, to], rates: [0, 0] });

/** Return an echo with no more samples than the plot has pixels: of several the largest. */
function thinned(echo, most = 600) {
  const group = Math.ceil(echo.x.length / most), x = [], y = [];
  for (let i = 0; i + group <= echo.x.length; i += group) {
    x.push(echo.x[i + group - 1]);
    y.push(Math.max(...echo.y.slice(i, i + group)));
  }
  return { ...echo, x, y };
}

const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));

/** Show a session that was recorded: the page has it in a frame. */
async function recorded() {
  const packed = new Response(bytes(window.mlmem_session)).body.pipeThrough(new DecompressionStream('gzip'));
  document.body.classList.replace('live', 'session');
  const shown = new Sessions();
  shown.open([unpack(await new Response(packed).arrayBuffer())]);
  connectWaves(shown, find('rate'));
  return shown;
}

async function live() {
  const shown = new Tab(window.mlmem_presets);
  connectWaves(shown, find('speed'), '0.02');
  const asked = new URLSearchParams(location.search).get('preset');
  const name = asked in window.mlmem_presets ? asked : 'case_2';
  find('preset').value = name;
  shown.open(name);
  return shown;
}

document.fonts.ready.then(() => (window.mlmem_session ? recorded() : live())).then((shown) => {
  window.mlmem = { shown: () => shown }; // for tests and the console
  find('theme').onclick = () => {
    const root = document.documentElement;
    root.dataset.theme = root.dataset.theme === 'dark' ? 'light' : 'dark';
    try { localStorage.setItem('theme', root.dataset.theme); } catch { /* storage is turned off */ }
    shown.repaint();
  };
}).catch((error) => {
  find('notice').textContent = `This browser cannot run the element: ${error.message}`;
  find('notice').hidden = false;
});
