// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The page: a running element, or the sessions that the address or the server names.

import { tone } from './colours.js';
import { connect } from './export.js';
import { Live } from './live.js';
import { Sessions } from './session.js';

const about = await (await fetch('/about')).json();
const asked = new URLSearchParams(location.search).get('session');
const numbers = asked ? asked.split(',').slice(0, 2) : about.live ? [] : about.sessions.map((_, i) => String(i));
await document.fonts.ready;

let shown;
if (numbers.length) {
  document.body.classList.add('session');
  shown = new Sessions();
  shown.open(numbers).catch((error) => {
    const notice = document.getElementById('notice');
    notice.hidden = false;
    notice.textContent = error.message;
  });
} else {
  document.body.classList.add('live');
  shown = new Live();
}
connect(() => shown);

document.getElementById('theme').onclick = () => {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === 'dark' ? 'light' : 'dark';
  try { localStorage.setItem('theme', root.dataset.theme); } catch { /* storage is turned off */ }
  shown.repaint();
};
addEventListener('click', (event) => {
  const health = document.getElementById('health');
  if (!health.contains(event.target)) health.open = false;
});
window.mlmem = { shown: () => shown, tone }; // for tests and the console
