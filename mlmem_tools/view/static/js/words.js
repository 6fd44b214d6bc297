// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Words of an element with many walls: numbers of any size, and the levels at which their walls rest.

/** Return the levels of a word, a number or a text; `weights` are the words of one wall, by level. */
export function walls(word, weights) {
  let rest = BigInt(word);
  return weights.map(BigInt).reduceRight((found, weight, level) => {
    if (rest < weight) return found;
    rest -= weight;
    return [level, ...found];
  }, []);
}

/** Return a word with a wall set or cleared, as text; those that are too near to it are cleared. */
export function toggled(word, level, { weights, spacing }) {
  const held = walls(word, weights);
  const kept = held.filter((other) => Math.abs(other - level) >= (held.includes(level) ? 1 : spacing));
  if (!held.includes(level)) kept.push(level);
  return `0x${kept.reduce((sum, each) => sum + BigInt(weights[each]), 0n).toString(16)}`;
}
