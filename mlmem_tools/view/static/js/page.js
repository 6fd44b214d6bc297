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

/** Return an item of a list of events. */
export const entry = (time, className, ...what) =>
  make('li', { className }, make('time', { textContent: time }), make('span', {}, ...what));

/** Return a row of a table. */
export const row = (tag, cells) => make('tr', {}, ...cells.map((cell) => make(tag, {}, cell)));

/** Show a notice above everything else; an empty one hides it. */
export function notice(text) {
  find('notice').textContent = text;
  find('notice').hidden = !text;
}

/** Return an element in words. */
export const facts = ({ levels, cells, substrate }) => `${levels} levels, ${cells} cells, ${substrate} substrate`;

/** Return a level in words. */
export const describe = (level) => (level >= 0 ? `level ${level}` : level === -1 ? 'blank' : 'unknown');

/** Return a number with its sign, with a true minus. */
export const signed = (value, digits) => (value < 0 ? '−' : '+') + Math.abs(value).toFixed(digits);

/** Return a number from the values of an outcome; null if it is not there. */
export const number = (values, name) => (Number.isFinite(parseFloat(values[name])) ? Number(values[name]) : null);

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
