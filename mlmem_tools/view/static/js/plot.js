// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// What all plots share: the style of their axes, and their size.

import { tone } from './colours.js';

const FONT = '11px Inter, sans-serif';

/** Return an axis of uPlot in the style of the page. */
export const axis = (more) => ({
  stroke: tone('muted'), font: FONT, labelFont: FONT, labelSize: 16, labelGap: 0, gap: 4,
  grid: { show: false }, ticks: { stroke: tone('line'), size: 4 }, ...more,
});

/** The horizontal lines of an axis. */
export const lines = () => ({ show: true, stroke: tone('line'), width: 1 });

/** Return zero and the largest round number that fits, of either sign, for an axis about zero. */
export function about0(most) {
  const power = 10 ** Math.floor(Math.log10(most));
  const round = power * [5, 2, 1].find((factor) => factor * power <= most * (1 + 1e-9));
  return [-round, 0, round];
}

/** Return the size of a plot that fills an element. */
export const sizeOf = (root) => ({ width: root.clientWidth, height: root.clientHeight });
