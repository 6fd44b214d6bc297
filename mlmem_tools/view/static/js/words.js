// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Words of an element with many walls: numbers, and the levels at which their walls rest.
// A code is that of mlmem.readers.words.Code: `tops` has how many words have each level as their highest.

/** Return the levels of which the next wall below one may have any, the lowest first. */
function below(level, { spacing }) {
  return [...Array(Math.max(0, level - spacing + 1)).keys()];
}

/** Return the levels of a word, the lowest first. */
export function walls(word, code) {
  const found = [];
  let rest = word, places = [...code.tops.keys()];
  while (rest > 0) {
    rest -= 1;
    const level = places.find((each) => {
      if (rest < code.tops[each]) return true;
      rest -= code.tops[each];
      return false;
    });
    if (level === undefined) break;
    found.unshift(level);
    places = below(level, code);
  }
  return found;
}

/** Return the word of levels. */
function wordOf(levels, code) {
  let word = 0, places = [...code.tops.keys()];
  for (const level of [...levels].sort((a, b) => b - a)) {
    word += places.filter((other) => other < level).reduce((sum, other) => sum + code.tops[other], 1);
    places = below(level, code);
  }
  return word;
}

/** Return a word with a wall set or cleared; walls that may not be with it are cleared, too. */
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
