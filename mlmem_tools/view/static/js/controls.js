// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The controls of a running element: each asks the node and shows a refusal.

import { say } from './bubble.js';
import { find, make, signed } from './page.js';

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

  write(level, control) {
    return this.ask(control, { do: 'write', level });
  }

  /** Choose the cell whose faults are set. */
  pick(cell) {
    find('cell').value = cell;
    this.showFaults();
  }

  /** Show the node's procedures and parameters. */
  set(about) {
    for (const [name, { takes, title }] of Object.entries(about.procedures)) {
      const known = document.querySelector(`.actions [data-do="${name}"]`);
      if (known) known.title = title;
      else if (!takes.length) this.offer(name, title);
    }
    find('strain').min = -about.max_strain;
    find('strain').max = about.max_strain;
    find('cell').max = about.cells;
    if (!find('cell').value) find('cell').value = Math.round(about.cells / 2);
    const speed = String(about.speed), select = find('speed');
    if (![...select.options].some((option) => option.value === speed)) {
      select.add(new Option(`${speed}×`, speed));
    }
    select.value = speed;
    this.faults = about.faults;
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
    find('strained').textContent = signed(strain, 3);
  }

  connectProcedures() {
    for (const button of document.querySelectorAll('.actions [data-do]')) {
      button.onclick = () => this.ask(button, { do: button.dataset.do });
    }
  }

  /** Add the button of a procedure, before that which aborts. */
  offer(name, title) {
    const button = make('button', { title }, spelt(name));
    button.dataset.do = name;
    document.querySelector('.actions [data-do="abort"]').before(button);
    this.connectProcedures();
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

  connectFaults() {
    const set = (control, name, value) => this.ask(control, { do: 'fault', name, value });
    const cell = () => Number(find('cell').value);
    for (const [id, name] of [['stick', 'stuck_cell'], ['weaken', 'weak_cell']]) {
      find(id).onclick = () => set(find(id), name, this.faults[name] === cell() ? 0 : cell());
    }
    find('cell').oninput = () => this.showFaults();
    find('noise').onchange = () => set(find('noise'), 'sensor_noise', Number(find('noise').value));
    find('stuck').onclick = () => set(find('stuck'), 'actuator_stuck', !this.faults.actuator_stuck);
    find('heal').onclick = () => this.ask(find('heal'), { do: 'heal' });
  }

  showFaults() {
    const cell = Number(find('cell').value), pressed = (id, on) => find(id).setAttribute('aria-pressed', on);
    pressed('stick', this.faults.stuck_cell === cell);
    pressed('weaken', this.faults.weak_cell === cell);
    pressed('stuck', Boolean(this.faults.actuator_stuck));
    const noise = [...find('noise').options].find((option) => Number(option.value) === this.faults.sensor_noise);
    if (noise) find('noise').value = noise.value;
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

/** Return a line that offers a finished recording. */
const recorded = (path, id) => make('span', {},
  `recorded ${path.split('/').pop()}: `,
  make('a', { textContent: 'open', href: `/?session=${id}`, target: '_blank' }), ' · ',
  make('a', { textContent: 'download', href: `/sessions/${id}/bag.zip`, download: '' }));

/** Return the name of a procedure as a button shows it. */
const spelt = (name) => (name[0].toUpperCase() + name.slice(1)).replace('_', '-');
