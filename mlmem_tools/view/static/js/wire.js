// Copyright 2026 The mlmem_ros authors
// SPDX-License-Identifier: Apache-2.0
// Frames of the server and its socket; mlmem_tools/view/frames.py defines them.

const GONE = { ok: false, kind: 'silent', text: 'the page\'s server is gone' };
const BODIES = { i2: Int16Array, f4: Float32Array };

/** Return the header of a frame, with its numbers as `data`. */
export function unpack(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  if (head.body) head.data = new BODIES[head.body](buffer, 4 + length);
  return head;
}

/** Fetch a frame; a failure is thrown with the server's text. */
export async function fetchFrame(address) {
  const response = await fetch(address);
  if (!response.ok) throw new Error(await response.text());
  return unpack(await response.arrayBuffer());
}

/** The connection to a running element; it reconnects whenever it breaks. */
export class Wire {
  /** @param {(head: object) => void} told takes every frame, and {k: 'lost'}. */
  constructor(told) {
    this.told = told;
    this.waiting = new Map();
    this.number = 0;
    this.connect();
  }

  connect() {
    const scheme = location.protocol === 'https:' ? 'wss' : 'ws';
    this.socket = new WebSocket(`${scheme}://${location.host}/live`);
    this.socket.binaryType = 'arraybuffer';
    this.socket.onmessage = (event) => this.take(unpack(event.data));
    this.socket.onclose = () => {
      for (const done of this.waiting.values()) done(GONE);
      this.waiting.clear();
      this.told({ k: 'lost' });
      setTimeout(() => this.connect(), 700);
    };
  }

  take(head) {
    if (head.k !== 'answer') return this.told(head);
    this.waiting.get(head.id)?.(head);
    this.waiting.delete(head.id);
  }

  /** Ask for something; resolves to {ok, kind, text, details}, and never fails. */
  ask(what) {
    if (this.socket.readyState !== WebSocket.OPEN) return Promise.resolve(GONE);
    const id = ++this.number;
    this.socket.send(JSON.stringify({ id, ...what }));
    return new Promise((done) => this.waiting.set(id, done));
  }
}
