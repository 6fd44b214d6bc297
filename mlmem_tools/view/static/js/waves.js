// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// The button that shows small waves: a pulse is a hundredth of the step between the phases.

import { find } from './page.js';

const GAIN = 50;

/** @param {object} shown has `magnify`; @param {Element} speed its selector; @param {string} slow its value then */
export function connectWaves(shown, speed, slow = '0.1') {
  const button = find('waves');
  let usual = speed.value;
  button.onclick = () => {
    const on = button.getAttribute('aria-pressed') !== 'true';
    button.setAttribute('aria-pressed', on);
    shown.magnify(on ? GAIN : 1);
    if (on) usual = speed.value;
    speed.value = on ? slow : usual;
    speed.dispatchEvent(new Event('change'));
  };
}
