// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// One or two recorded sessions on the page, with a time line to scrub and to play.

import { probed } from './echo.js';
import { content, entry, facts, find, found, make, notice, number } from './page.js';
import { Panel } from './panel.js';
import { last, Track } from './track.js';
import { fetchFrame } from './wire.js';

const MOMENT = 0.02; // seconds within which all messages of an event come

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
  async fetch(numbers) {
    this.open(await Promise.all(numbers.map((number) => fetchFrame(`/sessions/${number}`))));
  }

  /** Show sessions, of which the server, or the page itself, has made frames. */
  open(sessions) {
    document.body.classList.toggle('two', sessions.length === 2);
    this.sessions = sessions;
    this.duration = Math.max(...this.sessions.map((session) => session.duration), 0.001);
    for (const session of this.sessions) {
      session.track = new Track(session);
      session.runs = runs(session.events, session.element.procedures);
      session.panel = new Panel();
      session.panel.set(session.element, session.track, session.name, this.duration);
    }
    find('time').max = this.duration;
    find('node').textContent = this.sessions.map((session) => session.name).join('  and  ');
    find('facts').textContent = `session: ${facts(this.sessions[0].element)}`;
    document.title = `${this.caption} · mlmem view`;
    const lost = this.sessions.flatMap((session) => session.lost);
    if (lost.length) notice(`Some of it cannot be read: ${lost[0]}${lost.length > 1 ? `, and ${lost.length - 1} more` : ''}`);
    this.list();
    this.seek(0);
  }

  get caption() { return find('node').textContent; }

  magnify(gain) {
    for (const { panel } of this.sessions) panel.magnify(gain);
  }

  repaint() {
    for (const { panel } of this.sessions) panel.repaint();
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

  /** Show the state at a time. */
  seek(time) {
    this.now = time;
    find('time').value = time;
    find('clock').textContent = `${time.toFixed(2)} of ${this.duration.toFixed(2)} s`;
    for (const session of this.sessions) show(session, time);
    const list = find('events'), items = list.children;
    const index = last(this.times, time);
    if (index === this.index) return;
    this.mark(items[this.index], false);
    this.index = index;
    const item = items[index];
    if (!item) return;
    this.mark(item, true);
    list.scrollTop = item.offsetTop - list.offsetTop - list.clientHeight / 2;
  }

  mark(item, now) {
    item?.classList.toggle('now', now);
    if (item) item.firstElementChild.ariaCurrent = now ? 'time' : null;
  }

  /** Put commands and outcomes on the time line, and below it. */
  list() {
    const all = this.sessions.flatMap((session, side) => session.events.map((event) => ({ ...event, side })));
    all.sort((a, b) => a.t - b.t);
    this.times = all.map(({ t }) => t);
    find('marks').replaceChildren(...all.map((event) => {
      const className = event.kind + (event.ok === false ? ' no' : '');
      const mark = make('i', { className, title: `${event.t.toFixed(2)} s  ${event.text}` });
      mark.style.left = `${(100 * event.t) / this.duration}%`;
      return mark;
    }));
    find('events').replaceChildren(...all.map((event) => {
      const side = this.sessions.length > 1 ? `${'AB'[event.side]}  ` : '';
      const asked = event.kind === 'command' ? '▸ ' : '';
      const what = event.ok && found(event.values);
      return entry(
        `${event.t.toFixed(2)} s`, event.ok === false ? 'no' : asked && 'asked', [side, asked, event.text, what ? `: ${what}` : ''],
        () => { this.play(false); this.seek(Math.min(event.t + MOMENT, this.duration)); },
      );
    }));
  }
}

/** Return which procedure ran when: from its command to its outcome. */
function runs(events, procedures) {
  const found = [];
  let open = null;
  for (const event of events) {
    if (event.kind === 'command') {
      const [name] = event.text.split(' ');
      if (name in procedures) open = { from: event.t, name, content: event.content ?? null };
    } else if (open && event.kind === 'outcome') {
      found.push({ ...open, to: event.t });
      open = null;
    }
  }
  return found;
}

function show(session, time) {
  const { track, panel, strain, walls, levels, echoes, events } = session;
  const at = (times, values) => values[Math.max(0, last(times, time))];
  const level = levels[last(levels.map(([t]) => t), time)]?.[1];
  const values = events.findLast((event) => event.t <= time && event.kind === 'outcome')?.values ?? {};
  const run = session.runs.find(({ from, to }) => from <= time && time < to);
  panel.show({
    column: at(track.t, track.columns),
    strain: at(...strain) ?? 0,
    walls: at(...walls) ?? [],
    level,
    why: level === -2 ? events.findLast((event) => event.t <= time && event.kind !== 'command')?.text : '',
    confidence: content(values) === level ? number(values, 'confidence') : null,
    doing: run && { name: run.name, content: run.content, for: time - run.from, share: (time - run.from) / (run.to - run.from) },
  });
  panel.picture.draw(time);
  const heard = last(echoes.map(({ t }) => t), time);
  if (heard === session.heard) return;
  session.heard = heard;
  panel.echo.show(heard < 0 ? null : decoded(echoes[heard], session));
}

/** Return an echo with what the outcome right after it says. */
function decoded(echo, { track, events, delays }) {
  const outcome = events.find((event) => event.kind === 'outcome' && event.t >= echo.t - 1e-3);
  const values = outcome && outcome.t - echo.t < 0.05 ? outcome.values : {};
  const end = probed(values, track.columns[Math.max(0, last(track.t, echo.t))]);
  return { ...echo, end, delay: number(values, 'delay'), level: content(values), delays: delays[end] ?? [] };
}
