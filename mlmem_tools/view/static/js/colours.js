// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Colours that colour-blind people can tell apart. Both phases have a contrast of 3 with a card.

export const COUNTS = 8000; // the active phase as an integer; the inactive phase is 0

const STOPS = {
  light: [[-0.25, '#7a4a0a'], [0, '#bb8a45'], [0.5, '#ffffff'], [1, '#1c6ab0'], [1.25, '#0b2f55']],
  dark: [[-0.25, '#e39a45'], [0, '#7d6644'], [0.5, '#0e1319'], [1, '#4396de'], [1.25, '#cfe8ff']],
};

export const theme = () => document.documentElement.dataset.theme;

/** Return a colour of the style sheet, such as ink. */
export const tone = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

const parts = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));
const tables = {};

/** Return the colours of -COUNTS / 4 ... 5 COUNTS / 4 in 1024 steps, as pixels. */
export function table() {
  return (tables[theme()] ??= Uint32Array.from({ length: 1024 }, (_, i) => {
    const stops = STOPS[theme()];
    const value = -0.25 + (1.5 * i) / 1023;
    const above = Math.max(1, stops.findIndex(([at]) => at >= value));
    const [a, first] = stops[above - 1], [b, second] = stops[above];
    const share = (value - a) / (b - a);
    const [red, green, blue] = parts(first).map((from, k) => Math.round(from + share * (parts(second)[k] - from)));
    return (255 << 24) | (blue << 16) | (green << 8) | red;
  }));
}

/** Return the configuration of a site in a column. */
export const configuration = ({ stride, phases: [inactive, active] }, column, site) =>
  inactive + (column[Math.floor((site - 1) / stride)] / COUNTS) * (active - inactive);

/** Return a configuration whose departure from the nearer phase is magnified: small waves show. */
export function magnified(count, gain) {
  if (gain === 1) return count;
  const rest = count < COUNTS / 2 ? 0 : COUNTS;
  return rest + gain * (count - rest);
}

/** Return the index of a configuration in the table. */
export const place = (count) => Math.max(0, Math.min(1023, ((count / COUNTS + 0.25) * 682) | 0));

/** Paint the colours between two words: from beyond the inactive phase to beyond the active one. */
export function paintColours({ context, width, height }, [inactive, active]) {
  context.font = '12px Inter, sans-serif';
  context.fillStyle = tone('muted');
  context.textBaseline = 'middle';
  const words = width > 200 ? [`inactive ${inactive}`, `${active} active`] : [inactive, active];
  const [left, right] = words.map((word) => context.measureText(word).width + 6), wide = width - left - right;
  context.fillText(words[0], 0, height / 2 + 1);
  context.fillText(words[1], width - right + 6, height / 2 + 1);
  for (let x = 0; x < wide; x++) {
    context.fillStyle = css(COUNTS * ((1.5 * x) / wide - 0.25));
    context.fillRect(left + x, 3, 1, height - 6);
  }
  context.fillStyle = tone('ink');
  for (const share of [1 / 6, 5 / 6]) context.fillRect(left + share * wide - 0.5, 1, 1, height - 2);
}

/** Return a configuration's colour for a canvas. */
export function css(count) {
  const pixel = table()[place(count)];
  return `rgb(${pixel & 255} ${(pixel >> 8) & 255} ${(pixel >> 16) & 255})`;
}
