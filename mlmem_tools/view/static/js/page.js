// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Small parts of the page that several files need.

export const find = (id) => document.getElementById(id);

/** Return a new element with its properties and children. */
export function make(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

/** Set a text that is another one: a live region would be read again, and the page laid out. */
export function put(element, text) {
  if (element.textContent !== String(text)) element.textContent = text;
}

/** Name a picture for those who do not see it. */
export function name(canvas, label) {
  canvas.role = 'img';
  if (canvas.ariaLabel !== label) canvas.ariaLabel = label;
}

/** Return an item of a list of events, with a button if there is something to do. */
export function entry(time, className, what, onclick) {
  const parts = [make('time', { textContent: time }), make('span', {}, ...what)];
  return make('li', { className }, ...(onclick ? [make('button', { onclick }, ...parts)] : parts));
}

/** Return a row of a table. */
export const row = (tag, cells) => make('tr', {}, ...cells.map((cell) => make(tag, {}, cell)));

/** Show a notice above everything else; an empty one hides it. */
export function notice(text) {
  find('notice').textContent = text;
  find('notice').hidden = !text;
}

/** Return an element in words. */
export const facts = ({ levels, words, cells, substrate }) => [
  `${levels} levels`, ...(words === levels ? [] : [`${words} words`]), `${cells} cells`, `${substrate} substrate`,
].join(', ');

/** Return a content in words: the word of a register, or the level of one wall. */
export const describe = (content, isWord) => (content >= 0 ? (isWord ? `word ${spell(content)}` : `level ${content}`) : content === -1 ? 'blank' : 'unknown');

/** Return a word in decimal and in hexadecimal. */
export const spell = (word) => `${word} (0x${word.toString(16)})`;

/** Return a number with its sign, with a true minus. */
export const signed = (value, digits) => (value < 0 ? '−' : '+') + Math.abs(value).toFixed(digits);

/** Return a number from the values of an outcome; null if it is not there. */
export const number = (values, name) => (Number.isFinite(parseFloat(values[name])) ? Number(values[name]) : null);

/** Return the content in the values of an outcome, a word or a level; null without one. */
export const content = (values) => number(values, 'word') ?? number(values, 'level');

/** Return what an outcome found in words: where the wall is, or the content; empty for nothing. */
export function found(values, withDelay = false) {
  const [walls, position, deviation, delay] = ['walls', 'position', 'position_std', 'delay'].map((key) => number(values, key));
  const known = content(values);
  if (values.procedure === 'locate') {
    const count = walls === 0 ? 'no wall' : walls === 1 ? '1 wall' : `${walls} walls`;
    if (values.cells) return `${count}, at ${walls > 1 ? 'cells' : 'cell'} ${values.cells.replaceAll(' ', ', ')}`;
    const cell = number(values, 'stuck_cell');
    if (cell != null) return `${count}, cell ${cell} is stuck`;
    return position == null ? count : `${count}, at cell ${position.toFixed(2)} ± ${(deviation ?? 0).toFixed(2)}`;
  }
  return known == null ? '' : describe(known, values.word != null) + (!withDelay || delay == null ? '' : `, delay ${delay.toFixed(2)}`);
}

/** A small text beside the pointer. */
export class Tip {
  constructor(parent) {
    this.parent = parent;
    this.root = make('div', { className: 'tip', hidden: true });
    parent.append(this.root);
  }

  show(text, x, y = 4) {
    this.root.textContent = text;
    this.root.hidden = false;
    this.root.style.left = `${Math.min(x + 12, this.parent.clientWidth - this.root.offsetWidth)}px`;
    this.root.style.top = `${Math.max(0, y)}px`;
  }

  hide() { this.root.hidden = true; }
}
