// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The result of a request, shown beside the control that was used.

import { find } from './page.js';

const bubble = find('bubble');
let timer = 0;

/** Return the bounds within which a bubble stays: the control's card, or the page. */
function cardOf(control) {
  const page = { left: 8, right: innerWidth - 8, bottom: Infinity };
  const card = control.closest('.card')?.getBoundingClientRect();
  return card ? { left: Math.max(card.left, page.left), right: Math.min(card.right, page.right), bottom: card.bottom } : page;
}

/** Show a text or an element below a control, or above it where its card ends. */
export function say(control, what, good = false) {
  bubble.replaceChildren(what);
  bubble.classList.toggle('good', good);
  bubble.hidden = false;
  const box = control.getBoundingClientRect(), card = cardOf(control);
  bubble.style.maxWidth = `${Math.min(320, card.right - card.left)}px`;
  const left = Math.max(card.left, Math.min(box.left + box.width / 2 - 30, card.right - bubble.offsetWidth));
  const above = box.bottom + 8 + bubble.offsetHeight > card.bottom;
  bubble.classList.toggle('above', above);
  bubble.style.left = `${left + scrollX}px`;
  bubble.style.top = `${scrollY + (above ? box.top - 8 - bubble.offsetHeight : box.bottom + 8)}px`;
  bubble.style.setProperty('--tail', `${box.left + box.width / 2 - left}px`);
  clearTimeout(timer);
  timer = setTimeout(() => { bubble.hidden = true; }, good ? 3000 : 6000);
}

addEventListener('keydown', (event) => { if (event.key === 'Escape') bubble.hidden = true; });
