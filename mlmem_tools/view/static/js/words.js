// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Words of an element with many walls: numbers of any size, and the levels at which their walls rest.
// A code is that of mlmem_ros.device.register.Code: `tops` has how many words have each level as their highest, as texts.

/** Return the levels of which the next wall below one may have any, the lowest first. */
function below(level, { spacing }) {
  return [...Array(Math.max(0, level - spacing + 1)).keys()];
}

/** Return the levels of a word, a number or a text, the lowest first. */
export function walls(word, code) {
  const found = [];
  let rest = BigInt(word), places = [...code.tops.keys()];
  while (rest > 0n) {
    rest -= 1n;
    const level = places.find((each) => {
      if (rest < BigInt(code.tops[each])) return true;
      rest -= BigInt(code.tops[each]);
      return false;
    });
    if (level === undefined) break;
    found.unshift(level);
    places = below(level, code);
  }
  return found;
}

/** Return the word of levels, as text. */
function wordOf(levels, code) {
  let word = 0n, places = [...code.tops.keys()];
  for (const level of [...levels].sort((a, b) => b - a)) {
    word += places.filter((other) => other < level).reduce((sum, other) => sum + BigInt(code.tops[other]), 1n);
    places = below(level, code);
  }
  return `0x${word.toString(16)}`;
}

/** Return a word with a wall set or cleared, as text; walls that may not be with it are cleared, too. */
export function toggled(word, level, code) {
  const held = walls(word, code);
  const chain = held.includes(level) ? [] : [level];
  const others = held.filter((other) => other !== level);
  for (const other of others.filter((each) => each > level)) {
    if (!chain.length || below(other, code).includes(chain.at(-1))) chain.push(other);
  }
  for (const other of others.filter((each) => each < level).reverse()) {
    if (!chain.length || below(chain[0], code).includes(other)) chain.unshift(other);
  }
  return wordOf(chain, code);
}
