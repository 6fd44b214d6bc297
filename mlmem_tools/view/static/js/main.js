// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The page: a running element, or the sessions that the address or the server names.

import { connect } from './export.js';
import { Live } from './live.js';
import { find, notice } from './page.js';
import { Sessions } from './session.js';
import { connectWaves } from './waves.js';

const about = await (await fetch('/about')).json();
const asked = new URLSearchParams(location.search).get('session');
const numbers = asked ? asked.split(',').slice(0, 2) : about.live ? [] : ['0', '1'].slice(0, about.sessions);
await document.fonts.ready;

document.body.classList.add(numbers.length ? 'session' : 'live');
const shown = numbers.length ? new Sessions() : new Live();
if (numbers.length) shown.fetch(numbers).catch((error) => notice(error.message));
connect(shown);
connectWaves(shown, find(numbers.length ? 'rate' : 'speed'));

find('theme').onclick = () => {
  const root = document.documentElement;
  root.dataset.theme = root.dataset.theme === 'dark' ? 'light' : 'dark';
  try { localStorage.setItem('theme', root.dataset.theme); } catch { /* storage is turned off */ }
  shown.repaint();
};
addEventListener('click', (event) => {
  const health = find('health');
  if (!health.contains(event.target)) health.open = false;
});
window.mlmem = { shown: () => shown }; // for tests and the console
