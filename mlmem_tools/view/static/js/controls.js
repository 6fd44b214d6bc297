// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The controls of a running element: each asks the node and shows a refusal.

import { say } from './bubble.js';
import { find, make, put, row, signed } from './page.js';

const FINAL = ['reset']; // procedures that nothing undoes
const UNITS = { time: 'time units' };

export class Controls {
  /** @param {Wire} wire to ask through; @param {(what, className) => void} log takes an event */
  constructor(wire, log) {
    this.wire = wire;
    this.log = log;
    this.held = false;
    this.faults = {};
    this.connectProcedures();
    find('pause').onclick = async () => {
      const answer = await this.ask(find('pause'), { do: 'pause', hold: !this.held });
      if (answer.ok) this.hold(answer.details.paused);
    };
    find('step').onclick = async () => {
      const answer = await this.ask(find('step'), { do: 'step' });
      if (answer.ok) say(find('step'), `tick ${answer.details.tick}`, true);
    };
    find('speed').onchange = () => this.ask(find('speed'), { do: 'speed', speed: Number(find('speed').value) });
    find('record').onclick = () => this.record(!this.isRecording);
    this.connectStrain();
    find('kick-speed').oninput = () => put(find('kick-spelt'), this.kickSpeed.toFixed(3));
    this.connectFaults();
  }

  /** Ask for something; refusals and failures are shown at the control. */
  async ask(control, what) {
    const answer = await this.wire.ask(what);
    if (!answer.ok) {
      say(control, answer.text);
      if (answer.kind === 'refused') this.log(`${what.do}: ${answer.text}`, 'no');
    }
    return answer;
  }

  /** Write a level, or a word. */
  write(content, control) {
    return this.ask(control, { do: 'write', [this.isRegister ? 'word' : 'level']: content });
  }

  /** Choose the cell whose faults are set. */
  pick(cell) {
    find('cell').value = cell;
    this.showFaults();
  }

  /** Show the node's procedures and parameters. */
  set(about) {
    this.isRegister = Boolean(about.code);
    for (const [name, { takes, title }] of Object.entries(about.procedures)) {
      const known = document.querySelector(`.actions [data-do="${name}"]`);
      if (known) known.title = title;
      else if (!takes.length) this.offer(name, title);
    }
    find('strain').min = -about.max_strain;
    find('strain').max = about.max_strain;
    this.offerKick(about.kick);
    find('cell').max = about.cells;
    if (!find('cell').value) find('cell').value = Math.round(about.cells / 2);
    const speed = String(about.speed), select = find('speed');
    if (![...select.options].some((option) => option.value === speed)) {
      select.add(new Option(`${speed}×`, speed));
    }
    select.value = speed;
    const before = this.faults;
    this.faults = about.faults;
    if (Object.keys(before).length) this.logFaults(before);
    else this.offerFaults();
    this.showFaults();
  }

  /** Show from the health whether time is paused and a session recorded. */
  health(parts) {
    this.hold(parts.loop?.values.paused === 'True');
    this.recording(parts.recorder?.values.path != null);
  }

  hold(held) {
    this.held = held;
    find('pause').textContent = held ? 'Run' : 'Pause';
    find('step').disabled = !held;
  }

  /** Follow the present strain, unless the slider is dragged. */
  strained(strain) {
    if (this.dragging || this.sending) return;
    find('strain').value = strain;
    put(find('strained'), signed(strain, 3));
  }

  connectProcedures() {
    for (const button of document.querySelectorAll('.actions [data-do]')) {
      button.onclick = () => this.run(button, button.dataset.do);
    }
  }

  /** Add the button of a procedure, before that which aborts. */
  offer(name, title) {
    const button = make('button', { title }, spelt(name));
    button.dataset.do = name;
    document.querySelector('.actions [data-do="abort"]').before(button);
    this.connectProcedures();
  }

  /** Run a procedure: one that nothing undoes if the user agrees; a self-test tells its checks. */
  async run(button, name) {
    if (FINAL.includes(name) && !(await agreed(`${button.textContent}: ${button.title}. What it holds is lost.`, button.textContent))) return;
    const given = name === 'kick' ? { speed: this.kickSpeed } : {};
    const { details } = await this.ask(button, { do: name, ...given });
    if (details?.checks) this.log(checked(details.checks));
  }

  connectStrain() {
    const slider = find('strain');
    slider.addEventListener('pointerdown', () => { this.dragging = true; });
    addEventListener('pointerup', () => { this.dragging = false; });
    slider.addEventListener('input', () => {
      find('strained').textContent = signed(Number(slider.value), 3);
      this.drag(Number(slider.value));
    });
    find('release').onclick = () => this.drag(0);
  }

  /** Send the newest strain as soon as the previous one is answered. */
  async drag(strain) {
    this.wanted = strain;
    if (this.sending) return;
    this.sending = true;
    while (this.wanted != null) {
      const next = this.wanted;
      this.wanted = null;
      const answer = await this.ask(find('strain'), { do: 'strain', strain: next });
      if (!answer.ok) this.wanted = null;
      await new Promise((done) => setTimeout(done, 60));
    }
    this.sending = false;
  }

  /** Speed of a kick: the slider has its logarithm. */
  get kickSpeed() { return 10 ** Number(find('kick-speed').value); }

  /** Offer the kick of an element that has any, from the speed that its slider has or else begins with. */
  offerKick(kick) {
    const slider = find('kick-speed'), range = JSON.stringify(kick);
    find('kicks').hidden = !kick;
    if (!kick || slider.dataset.range === range) return;
    slider.dataset.range = range;
    [slider.min, slider.max, slider.value] = [kick.low, kick.high, kick.speed].map(Math.log10);
    slider.oninput();
  }

  connectFaults() {
    find('cell').oninput = () => this.showFaults();
    find('clear').onclick = () => this.ask(find('clear'), { do: 'clear_faults' });
  }

  /** Make the control of every fault: a button that is pressed, for a cell or the device, a number, or one of some words. */
  offerFaults() {
    for (const [name, { healthy, type, text, low, high, cell, choices, ...fault }] of Object.entries(this.faults)) {
      const unit = UNITS[fault.unit] ?? fault.unit;
      const title = unit ? `${text}, in ${unit}` : text, words = name.replaceAll('_', ' ');
      find('meanings').append(make('dt', {}, words), make('dd', {}, title));
      const set = async (control, value) => {
        const { ok } = await this.ask(control, { do: 'fault', name, value });
        if (!ok) control.value = this.faults[name].value;
      };
      if (type === 'bool' || cell) {
        const button = make('button', { title }, spelt(words.replace(/ cell$/, '')));
        button.onclick = () => set(button, this.pressed(name) ? healthy : cell ? Number(find('cell').value) : true);
        button.dataset.fault = name;
        find('pressed').append(button);
      } else {
        const input = choices.length ? make('select', {}, ...choices.map((each) => make('option', {}, each)))
          : make('input', { type: 'number', min: low, max: high, step: type === 'int' ? 1 : 'any' });
        input.onchange = () => set(input, input.value === '' ? healthy : choices.length ? input.value : Number(input.value));
        input.dataset.fault = name;
        find('numbers').append(make('label', { title }, make('span', {}, words, make('small', {}, unit)), input));
      }
    }
  }

  /** Report the faults that were set or cleared. */
  logFaults(before) {
    for (const [name, { value, healthy, unit }] of Object.entries(this.faults)) {
      if (value === before[name].value) continue;
      const words = name.replaceAll('_', ' ');
      if (value === healthy) this.log(`fault cleared: ${words}`);
      else this.log(`fault set: ${words}${value === true ? '' : ` ${value} ${UNITS[unit] ?? unit}`.trimEnd()}`, 'no');
    }
  }

  /** Return whether a fault is present: of a cell, in the chosen one. */
  pressed(name) {
    const { value, healthy, cell } = this.faults[name]; // a cell's value is a site, 0 for none
    return cell ? value === Number(find('cell').value) : value !== healthy;
  }

  showFaults() {
    for (const control of document.querySelectorAll('[data-fault]')) {
      const name = control.dataset.fault, on = this.pressed(name);
      if (control.tagName === 'BUTTON') {
        control.ariaPressed = on;
        continue;
      }
      control.parentElement.classList.toggle('present', on);
      if (control !== document.activeElement) control.value = this.faults[name].value;
    }
  }

  async record(on) {
    const answer = await this.ask(find('record'), { do: 'record', on });
    if (!answer.ok) return;
    this.recording(on);
    const { path, id } = answer.details;
    this.log(on ? `recording into ${path}` : recorded(path, id));
    if (!on) say(find('record'), recorded(path, id), true);
  }

  recording(on) {
    this.isRecording = on;
    find('record').classList.toggle('on', on);
    find('record').lastElementChild.textContent = on ? 'Stop' : 'Record';
  }
}


/** Ask whether to do what a button does; resolves to whether the user agrees. */
function agreed(question, verb) {
  const dialog = find('ask'), [cancel, yes] = dialog.querySelectorAll('button');
  find('question').textContent = question;
  yes.textContent = verb;
  for (const button of [cancel, yes]) button.onclick = () => dialog.close(button.value);
  dialog.returnValue = '';
  dialog.showModal();
  return new Promise((done) => { dialog.onclose = () => done(dialog.returnValue === 'yes'); });
}

/** Return the checks of a self-test, a line each. */
function checked(checks) {
  return make('table', { className: 'checks' }, ...checks.map(([name, passed, text]) => {
    const mark = make('i', { className: 'mark', ariaLabel: passed ? 'passed' : 'failed' });
    return Object.assign(row('td', [mark, name, text]), { className: passed ? 'good' : 'bad' });
  }));
}

/** Return a line that offers a finished recording. */
const recorded = (path, id) => make('span', {},
  `recorded ${path.split('/').pop()}: `,
  make('a', { textContent: 'open', href: `/?session=${id}`, target: '_blank' }), ' · ',
  make('a', { textContent: 'download', href: `/sessions/${id}/bag.zip`, download: '' }));

/** Return the name of a procedure as a button shows it. */
const spelt = (name) => (name[0].toUpperCase() + name.slice(1)).replace('_', '-');
