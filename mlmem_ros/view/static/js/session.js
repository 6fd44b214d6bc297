// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// One or two recorded sessions on the page: a time line to scrub and to play.

import { COUNTS } from './colours.js';
import { Panel } from './panel.js';
import { last, Track } from './track.js';
import { fetchFrame } from './wire.js';

const MOMENT = 0.02; // seconds in which all that belongs to an event has been told

const find = (id) => document.getElementById(id);

export class Sessions {
  constructor() {
    this.now = 0;
    this.playing = false;
    this.sessions = [];
    find('play').onclick = () => this.play(!this.playing);
    find('time').oninput = () => { this.play(false); this.seek(Number(find('time').value)); };
    addEventListener('keydown', (event) => {
      if (event.target.closest?.('input, select, button')) return;
      if (event.key === ' ') { event.preventDefault(); this.play(!this.playing); }
    });
  }

  /** Fetch and show sessions by their numbers. */
  async open(numbers) {
    document.body.classList.toggle('two', numbers.length === 2);
    this.sessions = await Promise.all(numbers.map(async (number) => ready(await fetchFrame(`/sessions/${number}`))));
    this.duration = Math.max(...this.sessions.map((session) => session.duration), 0.001);
    for (const session of this.sessions) {
      session.panel = new Panel(null, false);
      session.panel.set(session.element, session.track, session.name, this.duration);
    }
    find('time').max = this.duration;
    find('node').textContent = this.sessions.map((session) => session.name).join('  and  ');
    const { levels, cells, substrate } = this.sessions[0].element;
    find('facts').textContent = `session of ${levels} levels, ${cells} cells, ${substrate} substrate`;
    document.title = `${this.caption} · mlmem view`;
    const lost = this.sessions.flatMap((session) => session.lost);
    if (lost.length) {
      find('notice').textContent = `Not all of it can be read: ${lost[0]}${lost.length > 1 ? `, and ${lost.length - 1} more` : ''}`;
      find('notice').hidden = false;
    }
    this.list();
    if (numbers.length === 2) await this.compare(numbers);
    this.seek(0);
  }

  get panels() { return this.sessions.map((session) => session.panel); }
  get caption() { return find('node').textContent; }

  repaint() {
    for (const panel of this.panels) panel.repaint();
    this.seek(this.now);
  }

  play(on) {
    if (on && this.now >= this.duration) this.now = 0;
    if (on && !this.playing) {
      let before = performance.now();
      const turn = (time) => {
        if (!this.playing) return;
        const passed = ((time - before) / 1000) * Number(find('rate').value);
        before = time;
        this.seek(Math.min(this.now + Math.max(0, passed), this.duration));
        if (this.now >= this.duration) this.play(false); else requestAnimationFrame(turn);
      };
      requestAnimationFrame(turn);
    }
    this.playing = on;
    find('play').textContent = on ? 'Pause' : 'Play';
  }

  /** Show what was at a time. */
  seek(time) {
    this.now = time;
    find('time').value = time;
    find('clock').textContent = `${time.toFixed(2)} of ${this.duration.toFixed(2)} s`;
    for (const session of this.sessions) show(session, time);
    const items = [...find('events').children];
    const index = last(items.map((item) => Number(item.dataset.t)), time);
    if (index === this.index) return;
    items[this.index]?.classList.remove('now');
    items[index]?.classList.add('now');
    this.index = index;
    const list = find('events'), item = items[index];
    if (item) list.scrollTop = item.offsetTop - list.offsetTop - list.clientHeight / 2;
  }

  /** Put commands and outcomes on the time line, and below it. */
  list() {
    const all = this.sessions.flatMap((session, side) => session.events.map((event) => ({ ...event, side })));
    all.sort((a, b) => a.t - b.t);
    find('marks').replaceChildren(...all.map((event) => {
      const mark = document.createElement('i');
      mark.className = event.kind + (event.ok === false ? ' no' : '');
      mark.style.left = `${(100 * event.t) / this.duration}%`;
      mark.title = `${event.t.toFixed(2)} s  ${event.text}`;
      return mark;
    }));
    find('events').replaceChildren(...all.map((event) => {
      const item = document.createElement('li');
      item.dataset.t = event.t;
      item.className = event.ok === false ? 'no' : event.kind === 'command' ? 'asked' : '';
      const side = this.sessions.length > 1 ? `${'AB'[event.side]}  ` : '';
      const level = event.values?.level == null || event.ok === false ? '' : `: ${describe(Number(event.values.level))}`;
      item.append(
        Object.assign(document.createElement('time'), { textContent: `${event.t.toFixed(2)} s` }),
        side + (event.kind === 'command' ? `▸ ${event.text}` : event.text + level),
      );
      item.onclick = () => { this.play(false); this.seek(Math.min(event.t + MOMENT, this.duration)); };
      return item;
    }));
  }

  async compare(numbers) {
    const response = await fetch(`/differences/${numbers.join('/')}`);
    const { parameters, events, alike } = await response.json();
    const card = find('differences');
    card.hidden = false;
    const rows = [
      ...parameters.map(([name, a, b]) => [name, a ?? '–', b ?? '–']),
      ...events.map(({ left, right }) => [(left ?? right).kind, told(left), told(right)]),
    ];
    const count = `${alike} commands and outcomes agree${rows.length ? '; these differ:' : ', and nothing differs.'}`;
    const table = document.createElement('table');
    table.append(row('th', ['', 'A', 'B']), ...rows.map((cells) => row('td', cells)));
    card.lastElementChild.replaceChildren(count, ...(rows.length ? [table] : []));
  }
}

const describe = (level) => (level >= 0 ? `level ${level}` : level === -1 ? 'blank' : 'unknown');
const told = (event) => (event ? `${event.text} (${event.t.toFixed(2)} s)` : '–');

function row(kind, cells) {
  const tr = document.createElement('tr');
  for (const text of cells) tr.append(Object.assign(document.createElement(kind), { textContent: text }));
  return tr;
}

/** Return a session with what is looked up in it. */
function ready(session) {
  const strain = { t: session.strain[0], y: session.strain[1] };
  session.track = Track.of(session.t, session.data, [], strain);
  session.runs = runs(session.events);
  return session;
}

/** Return when which procedure ran: from its command to its outcome. */
function runs(events) {
  const found = [];
  let open = null;
  for (const event of events) {
    if (event.kind === 'command') {
      const [name, level] = event.text.split(' ');
      if (['write', 'read', 'erase', 'calibrate', 'self_test', 'abort'].includes(name)) {
        open = { from: event.t, name, level: level && name === 'write' ? Number(level) : null };
      }
    } else if (open) {
      found.push({ ...open, to: event.t });
      open = null;
    }
  }
  return found;
}

function show(session, time) {
  const { track, panel, strain, walls, levels, echoes, events, delays } = session;
  const at = Math.max(0, last(track.t, time));
  const level = levels[last(levels.map(([t]) => t), time)]?.[1];
  const before = events.filter((event) => event.t <= time && event.kind === 'outcome').at(-1);
  const run = session.runs.find(({ from, to }) => from <= time && time < to);
  panel.show({
    column: track.columns[at],
    strain: strain[1][Math.max(0, last(strain[0], time))] ?? 0,
    walls: walls[1][Math.max(0, last(walls[0], time))] ?? [],
    level,
    confidence: before?.values.confidence != null && Number(before.values.level) === level ? Number(before.values.confidence) : null,
    doing: run && { name: run.name, level: run.level, for: time - run.from },
  });
  panel.picture.draw(time);
  const heard = last(echoes.map(({ t }) => t), time);
  if (heard === session.heard) return;
  session.heard = heard;
  const echo = echoes[heard];
  if (!echo) return panel.echo.show(null);
  const outcome = events.find((event) => event.kind === 'outcome' && event.t >= echo.t - 1e-3);
  const values = outcome && outcome.t - echo.t < 0.05 ? outcome.values : {};
  const end = values.end ? (values.end === 'left' ? 'left' : 'right') : track.columns[Math.max(0, last(track.t, echo.t))]?.[0] < COUNTS / 2 ? 'right' : 'left';
  const delay = values.delay && values.delay !== 'None' ? Number(values.delay) : null;
  panel.echo.show({ ...echo, end, delay, level: Number(values.level), delays: delays[end] ?? [] });
}
