// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The result of a request, shown below the control that was used.

import { find } from './page.js';

const bubble = find('bubble');
let timer = 0;

/** Show a text or an element below a control. */
export function say(control, what, good = false) {
  bubble.replaceChildren(what);
  bubble.classList.toggle('good', good);
  bubble.hidden = false;
  const box = control.getBoundingClientRect();
  const left = Math.max(8, Math.min(box.left + box.width / 2 - 30, innerWidth - bubble.offsetWidth - 8));
  bubble.style.left = `${left + scrollX}px`;
  bubble.style.top = `${box.bottom + scrollY + 8}px`;
  bubble.style.setProperty('--tail', `${box.left + box.width / 2 - left}px`);
  clearTimeout(timer);
  timer = setTimeout(() => { bubble.hidden = true; }, good ? 3000 : 6000);
}

addEventListener('keydown', (event) => { if (event.key === 'Escape') bubble.hidden = true; });
