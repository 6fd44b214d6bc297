// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// One element: its content, chain, picture and echo.

import { Bands } from './bands.js';
import { Chain } from './chain.js';
import { Echo } from './echo.js';
import { find, put, signed, spell } from './page.js';
import { Picture } from './picture.js';
import { Twin } from './twin.js';

export class Panel {
  /** @param {Controls} controls of a running element; absent for a session */
  constructor(controls) {
    this.root = find('panel').content.firstElementChild.cloneNode(true);
    find('panels').append(this.root);
    this.chain = new Chain(this.root, controls);
    this.picture = new Picture(this.root, Boolean(controls), controls?.span);
    this.echo = new Echo(this.root);
    this.bands = new Bands(this.root);
    this.twin = new Twin(this.root);
    this.find = (name) => this.root.querySelector(name);
  }

  set(about, track, title, end) {
    this.about = about;
    this.find('.title').textContent = title;
    this.chain.set(about);
    this.picture.set(about, track, end);
    this.echo.set(about);
    this.bands.set(about);
  }

  /** Show a state: column, walls, strain, level, confidence, doing, and why a level is unknown. */
  show(state) {
    if (!this.about) return;
    this.chain.show(state);
    const { level, confidence, doing, why } = state;
    const content = this.find('.level');
    put(content, level == null ? 'not read' : level >= 0 ? this.spell(level) : level === -1 ? 'blank' : 'unknown');
    content.classList.toggle('word', !(level >= 0));
    content.classList.toggle('of-register', level >= 0 && Boolean(this.about.code));
    content.classList.toggle('past', Boolean(this.about.procedures[doing?.name]?.changes)); // it is the last one
    put(this.find('.code'), level >= 0 ? this.about.codes[level] ?? '' : '');
    const known = confidence != null && level >= -1;
    this.find('.confidence i').style.width = known ? `${100 * confidence}%` : '0';
    put(this.find('.confidence span'), known ? `confidence ${confidence.toFixed(2)}` : level === -2 && why || 'confidence –');
    this.find('.activity').classList.toggle('idle', !doing);
    put(this.find('.what'), activity(state, (content) => this.spell(content)));
    const bar = this.find('.progress');
    bar.classList.toggle('off', !doing);
    bar.classList.toggle('unknown', Boolean(doing) && doing.share == null); // it moves
    bar.firstElementChild.style.width = doing?.share == null ? '' : `${100 * doing.share}%`;
  }

  /** Return a content: the word of a register in hexadecimal, too. */
  spell(content) { return this.about.code ? spell(content) : content; }

  /** Magnify small waves about the phases, in the chain and over time. */
  magnify(gain) {
    this.chain.gain = this.picture.gain = gain;
    this.chain.draw();
    this.picture.draw();
  }

  /** Draw everything again, in the colours of the present theme. */
  repaint() {
    if (!this.about) return;
    this.picture.build();
    this.echo.build();
    this.bands.draw();
    this.twin.build();
    this.chain.draw();
  }
}

/** Return what the element does in words. */
function activity({ doing, strain }, spelt) {
  if (!doing) return Math.abs(strain) > 5e-4 ? `held at strain ${signed(strain, 3)}` : 'idle';
  const name = doing.name.replace('_', '-');
  return [
    doing.content == null ? name : `${name} ${spelt(doing.content)}`,
    doing.phase,
    doing.attempts > 1 && `try ${doing.attempts}`,
    `${doing.for.toFixed(1)} s`,
  ].filter(Boolean).join(', ');
}
