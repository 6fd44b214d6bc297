// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// What a request comes to, told where the hand is.

const bubble = document.getElementById('bubble');
let timer = 0;

/** Say something below a control; an answer that went well only where it says something. */
export function say(control, text, good = false) {
  bubble.replaceChildren(...(text instanceof Node ? [text] : [document.createTextNode(text)]));
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
