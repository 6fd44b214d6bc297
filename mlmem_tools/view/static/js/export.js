// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// A still (PNG) or a film (WebM) of what is shown, drawn onto one canvas.

import { say } from './bubble.js';
import { tone } from './colours.js';
import { find, make } from './page.js';

const LONGEST = 120; // seconds of a film
const PAD = 28, HEAD = 58;

/** Draw all panels as they are, with a caption, onto a canvas. */
function compose(shown, scale, canvas = make('canvas')) {
  const panels = find('panels'), { left, top, width, height } = panels.getBoundingClientRect();
  const across = 2 * Math.round(((width + 2 * PAD) * scale) / 2), down = 2 * Math.round(((height + PAD + HEAD) * scale) / 2);
  if (canvas.width !== across || canvas.height !== down) { canvas.width = across; canvas.height = down; }
  const context = canvas.getContext('2d');
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.fillStyle = tone('ground');
  context.fillRect(0, 0, canvas.width, canvas.height);
  text(context, shown.caption, PAD, 36, `600 18px Inter, sans-serif`, tone('ink'));
  if (shown.now != null) text(context, `${shown.now.toFixed(2)} s`, PAD + width, 36, '500 15px Inter, sans-serif', tone('muted'), 'right');
  context.translate(PAD - left, HEAD - top);
  drawPanels(context, panels);
  return canvas;
}

function drawPanels(context, panels) {
  context.strokeStyle = tone('line');
  for (const card of panels.querySelectorAll('.card')) {
    block(context, card, 14, tone('card'));
    context.stroke();
  }
  for (const canvas of panels.querySelectorAll('canvas')) {
    const box = canvas.getBoundingClientRect();
    if (canvas.width && canvas.height) context.drawImage(canvas, box.left, box.top, box.width, box.height);
  }
  const words = '.title, .level, .code, .confidence span, .what, .heading h2, .delay, .strain-now, .u-title, .levels button, .levels .many';
  for (const element of panels.querySelectorAll(words)) {
    const style = getComputedStyle(element), box = element.getBoundingClientRect();
    if (!box.width || !element.textContent) continue;
    const button = element.tagName === 'BUTTON';
    if (button) block(context, element, 14, style.backgroundColor);
    context.textBaseline = 'middle';
    const x = button ? box.left + box.width / 2 : box.left;
    text(context, element.textContent, x, box.top + box.height / 2 + 1, `${style.fontWeight} ${style.fontSize} Inter, sans-serif`, style.color, button ? 'center' : 'left');
    context.textBaseline = 'alphabetic';
  }
  for (const bar of panels.querySelectorAll('.meter, .progress:not(.off)')) {
    block(context, bar, 3, tone('soft'));
    block(context, bar.firstElementChild, 3, tone('active'));
  }
}

/** Draw the background of an element. */
function block(context, element, radius, colour) {
  const { left, top, width, height } = element.getBoundingClientRect();
  context.fillStyle = colour;
  context.beginPath();
  context.roundRect(left, top, width, height, radius);
  context.fill();
}

function text(context, what, x, y, font, colour, align = 'left') {
  context.font = font;
  context.fillStyle = colour;
  context.textAlign = align;
  context.fillText(what, x, y);
}

/** Save a file made by the page. */
function save(blob, name) {
  const link = make('a', { href: URL.createObjectURL(blob), download: name });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/**
 * Return a film with its duration, which a browser does not know when it begins to write.
 *
 * WebM is nested elements of name, size and content (RFC 8794): Duration (44 89) joins those of
 * Info (15 49 A9 66), in units of its time code scale, a millisecond.
 */
function timed(film, seconds) {
  const at = film.findIndex((_, i) => [0x15, 0x49, 0xa9, 0x66].every((byte, k) => film[i + k] === byte)) + 4;
  if (at < 4) return new Blob([film], { type: 'video/webm' });
  const wide = Math.clz32(film[at]) - 23; // bytes of its size: the first one tells
  let size = film[at] & (0xff >> wide);
  for (let k = 1; k < wide; k++) size = 256 * size + film[at + k];
  const head = new Uint8Array(8 + 11), view = new DataView(head.buffer);
  view.setUint32(0, 0x01000000); // a size of eight bytes
  view.setUint32(4, size + 11);
  view.setUint16(8, 0x4489);
  view.setUint8(10, 0x88); // a number of eight bytes
  view.setFloat64(11, 1000 * seconds);
  return new Blob([film.subarray(0, at), head, film.subarray(at + wide)], { type: 'video/webm' });
}

const stamp = () => new Date().toISOString().slice(0, 19).replace(/[-:]/g, '').replace('T', '-');

/** Connect the buttons; `shown` has a caption and, for a session, now, playing and play(). */
export function connect(shown) {
  const still = find('still'), film = find('film');
  still.onclick = () => compose(shown, 2).toBlob((blob) => save(blob, `mlmem-${stamp()}.png`), 'image/png');
  let recorder = null;
  film.onclick = () => {
    if (recorder) return recorder.stop();
    const canvas = compose(shown, 1), chunks = [];
    const type = ['video/webm;codecs=vp9', 'video/webm'].find((kind) => window.MediaRecorder?.isTypeSupported(kind));
    if (!type) return say(film, 'This browser cannot record films (WebM).');
    recorder = new MediaRecorder(canvas.captureStream(30), { mimeType: type, videoBitsPerSecond: 6e6 });
    const timer = setInterval(() => compose(shown, 1, canvas), 33);
    const end = setTimeout(() => recorder.stop(), 1000 * LONGEST);
    const played = shown.play && !shown.playing;
    recorder.ondataavailable = (event) => chunks.push(event.data);
    recorder.onstop = () => {
      clearInterval(timer);
      clearTimeout(end);
      recorder = null;
      film.classList.remove('on');
      film.lastElementChild.textContent = 'Film';
      const seconds = (performance.now() - begun) / 1000;
      new Blob(chunks).arrayBuffer().then((film) => save(timed(new Uint8Array(film), seconds), `mlmem-${stamp()}.webm`));
    };
    let begun = performance.now();
    recorder.onstart = () => {
      begun = performance.now();
      if (played) shown.play(true);
    };
    recorder.start(500);
    film.classList.add('on');
    film.lastElementChild.textContent = 'Stop';
    if (played) {
      const watch = setInterval(() => {
        if (!recorder) return clearInterval(watch);
        if (shown.playing || !chunks.some(({ size }) => size)) return; // a busy machine takes time to begin
        clearInterval(watch);
        setTimeout(() => recorder?.stop(), 500); // the last picture stays for a moment
      }, 100);
    }
  };
}
