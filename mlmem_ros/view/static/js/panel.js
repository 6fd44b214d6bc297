// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// One element as it is seen: its content, chain, picture and echo.

import { Chain } from './chain.js';
import { Echo } from './echo.js';
import { Picture } from './picture.js';
import { progress } from './progress.js';

let count = 0;

export class Panel {
  /** @param {object} act for the chain, live; null for a session */
  constructor(act, live) {
    this.root = document.getElementById('panel').content.firstElementChild.cloneNode(true);
    document.getElementById('panels').append(this.root);
    this.root.querySelector('.picture').dataset.key = count++;
    this.chain = new Chain(this.root, act);
    this.picture = new Picture(this.root, live);
    this.echo = new Echo(this.root);
    this.find = (name) => this.root.querySelector(name);
  }

  set(about, track, title, end) {
    this.about = about;
    this.find('.title').textContent = title;
    this.chain.set(about);
    this.picture.set(about, track, end);
    this.echo.set(about);
  }

  /** Show a state: column, walls, strain, level, confidence, doing. */
  show(state) {
    if (!this.about) return;
    this.chain.show(state);
    const { level, confidence } = state;
    const held = this.find('.level');
    held.textContent = level == null ? 'not read' : level >= 0 ? level : level === -1 ? 'blank' : 'unknown';
    held.classList.toggle('word', !(level >= 0));
    this.find('.code').textContent = level >= 0 ? this.about.codes[level] ?? '' : '';
    held.classList.toggle('past', ['write', 'erase', 'calibrate', 'self_test'].includes(state.doing?.name));
    const known = confidence != null && level != null && level >= -1;
    this.find('.confidence i').style.width = known ? `${100 * confidence}%` : '0';
    this.find('.confidence span').textContent = known ? `confidence ${confidence.toFixed(2)}` : 'confidence –';
    this.work(state);
  }

  /** Show what the running procedure does, and how far it is. */
  work(state) {
    const { text, share } = progress(this.about, state);
    const bar = this.find('.progress');
    this.find('.activity').classList.toggle('idle', !state.doing);
    this.find('.what').textContent = text;
    bar.classList.toggle('off', !state.doing);
    bar.classList.toggle('unknown', share == null);
    this.find('.progress i').style.width = share == null ? '' : `${100 * share}%`;
  }

  /** Draw everything anew, in the colours of the present theme. */
  repaint() {
    if (!this.about) return;
    this.picture.build();
    this.echo.build();
    this.chain.draw();
  }
}
