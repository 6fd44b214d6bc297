// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The pass bands of both phases, and the carriers of the probes: a pulse travels inside a band only.

import { fitted } from './chain.js';
import { css, COUNTS, tone } from './colours.js';
import { name } from './page.js';

const LEFT = 58, TOP = 14, FOOT = 14; // pixels around the bands

export class Bands {
  constructor(root) {
    this.canvas = root.querySelector('.bands');
    new ResizeObserver(() => this.draw()).observe(this.canvas);
  }

  set(about) {
    this.about = about;
    this.draw();
  }

  draw() {
    if (!this.about?.bands || !this.canvas.clientWidth) return;
    const { context, width, height } = fitted(this.canvas);
    const { bands, carriers } = this.about;
    const most = 1.08 * Math.max(...Object.values(bands).flat(), ...Object.values(carriers));
    const at = (omega) => LEFT + (omega / most) * (width - LEFT - 8);
    const tall = (height - TOP - FOOT) / 2;
    context.font = '11px Inter, sans-serif';
    context.textBaseline = 'middle';
    for (const [row, [phase, [low, high]]] of Object.entries(bands).entries()) {
      const y = TOP + row * tall;
      context.fillStyle = css(phase === 'active' ? COUNTS : 0);
      context.fillRect(at(low), y + 2, at(high) - at(low), tall - 4);
      context.fillStyle = tone('muted');
      context.textAlign = 'left';
      context.fillText(phase, 0, y + tall / 2);
    }
    context.textAlign = 'center';
    for (const [end, omega] of Object.entries(carriers)) {
      context.fillStyle = tone('ink');
      context.fillRect(at(omega) - 0.75, TOP - 2, 1.5, 2 * tall + 4);
      context.fillText(`${end} ${omega.toFixed(2)}`, at(omega), 6);
    }
    context.fillStyle = tone('muted');
    for (let omega = 0; omega < most; omega += 0.5) context.fillText(omega, at(omega), height - 6);
    const told = Object.entries(bands).map(([phase, [low, high]]) => `${phase} from ${low.toFixed(2)} to ${high.toFixed(2)}`);
    const heard = Object.entries(carriers).map(([end, omega]) => `${end} ${omega.toFixed(2)}`);
    name(this.canvas, `Pass bands in angular frequency: ${told.join(', ')}; carriers: ${heard.join(', ')}`);
  }
}
