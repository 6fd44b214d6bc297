// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// What a procedure is doing and how far it is: as its action tells, or else from what can be seen.

import { signed } from './chain.js';

const NAMES = { self_test: 'self-test' };

/** Return a text, and the share that is done; null where that cannot be told. */
export function progress(about, { doing, strain, walls }) {
  if (!doing) return { text: Math.abs(strain) > 5e-4 ? `held at strain ${signed(strain, 3)}` : 'idle', share: null };
  const name = NAMES[doing.name] ?? doing.name;
  const what = doing.level == null ? name : `${name} ${doing.level}`;
  const seconds = doing.for == null ? '' : `, ${doing.for.toFixed(1)} s`;
  if (doing.share != null) {
    const tries = doing.attempts > 1 ? `, try ${doing.attempts}` : '';
    return { text: `${what}: ${doing.phase}${tries}${seconds}`, share: doing.share };
  }
  const way = doing.name === 'write' && doing.level != null ? wayTo(about.defects[doing.level], walls) : null;
  const step = way == null ? '' : way.text;
  const phase = step || (Math.abs(strain) > 5e-4 ? (strain > 0 ? 'pulling' : 'pressing') : 'listening');
  return { text: `${what}: ${phase}${seconds}`, share: way?.share ?? null };
}

/** Return how far a wall has come on its way up to a site. */
function wayTo(site, walls) {
  if (!walls.length) return { text: 'launching the wall', share: 0 };
  const wall = Math.min(...walls);
  if (Math.max(...walls) > site + 3) return { text: 'making room', share: null };
  if (wall > site - 1) return { text: 'verifying', share: 1 };
  return { text: `wall at ${wall.toFixed(0)} of ${site}`, share: Math.max(0, wall / site) };
}
