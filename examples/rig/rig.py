# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A rig in plain Python: the protocol of docs/reference/rig.md, around an element of its own.

`python3 rig.py PORT SECONDS` serves 127.0.0.1:PORT, with SECONDS per time unit of the element. It
needs numpy, and nothing of mlmem_ros. For a real element replace `Element`.
"""

import contextlib
import json
import select
import socket
import struct
import sys
import time
import zlib
from collections import deque

import numpy as np

HELLO, PLAY, SAMPLES, AGAIN, FAULT = range(1, 6)
HEADER_LAYOUT = struct.Struct('<2sBQIH')  # 'mR', kind, number, length of the payload, check
SAMPLE_TIME, TIME_STEP = 0.25, 0.125  # in time units
TICK_SAMPLES, BUFFER_SAMPLES = 80, 1 << 16
NODE_SHARES = [0.5, 1.0]  # two steps a sample
ZERO_READINGS = np.array([3.0, -2.0])  # at displacement 0


class Element:
    """Case II of the paper over a rigid substrate, blank at first; by velocity Verlet."""

    def __init__(self):
        j = np.arange(1, 226)
        self.height = 0.0380 * (1 - 4e-4 / 3 * j) * np.where(j % 25, 1.0, 0.95)
        softness = 1 / (1000 + 2000 * np.abs((j[:-1] - 17 - 25) % 50 - 25) / 25)
        self.shape = np.append(0, np.cumsum(softness)) / softness.sum()
        self.v, self.velocity, self.force = np.full(225, -0.99790), np.zeros(225), np.zeros(225)

    def play_step(self, V_N, held):
        """Pass a step at V_N with (site, place, velocity) held; return where both ends are."""
        self.velocity += TIME_STEP / 2 * (self.force - self.velocity / 250)
        self.v += TIME_STEP * self.velocity
        if held:
            self.v[held[0] - 1] = held[1] - ZERO_READINGS[int(held[0] > 1)]
        y = self.v - V_N * self.shape + 7.4489
        square = 0.0172 * y * y
        self.force = -self.height * np.sin(y * (0.2582 + square)) * (0.2582 + 3 * square)
        self.force[:-1] += (stretch := self.v[1:] - self.v[:-1])
        self.force[1:] -= stretch
        self.velocity = (self.velocity + TIME_STEP / 2 * self.force) / (1 + TIME_STEP / 500)
        if held:
            self.velocity[held[0] - 1] = held[2]
        return self.v[0] + ZERO_READINGS[0], self.v[-1] + ZERO_READINGS[1]


class Rig:
    """The protocol. TCP loses nothing, so it keeps no frame to send again, and asks for none."""

    def __init__(self, element, put, seconds):
        self.element, self.put, self.inbox = element, put, b''
        self.hello = {
            'protocol': 1, 'name': 'plain', 'dt': SAMPLE_TIME, 'seconds': SAMPLE_TIME * seconds,
            'samples': TICK_SAMPLES, 'length': 0.01, 'zero': ZERO_READINGS.tolist(),
            'nodes': NODE_SHARES, 'numbers': '<f8', 'buffer': BUFFER_SAMPLES,
            'can': ['strain', 'left', 'right'],
        }  # fmt: skip
        self.tick_seconds, self.last = TICK_SAMPLES * SAMPLE_TIME * seconds, (0.0, None)
        self.begin_conversation(0.0)

    def begin_conversation(self, ahead):
        """Begin a conversation: both sides count their frames and samples from 0."""
        self.ahead, self.expected, self.sent, self.first, self.played = ahead, 1, 0, 0, 0
        self.queue, self.playing, self.waited, self.missed = deque(), False, 0.0, 0

    def release_strain(self):
        """Release the ends, bring the strain slowly to zero, and wait until nothing moves."""
        V_N, self.last = self.last[0], (0.0, None)
        for share in np.append(np.linspace(1, 0, 4800), np.zeros(16000)) if V_N else ():
            self.element.play_step(V_N * share, None)  # 600 time units, and 2000 more

    def send_frame(self, kind, payload):
        """Send a frame."""
        head = HEADER_LAYOUT.pack(b'mR', kind, self.sent, len(payload), 0)[:-2]
        frame = head + struct.pack('<H', zlib.crc32(head) & 0xFFFF) + payload
        self.put(frame + struct.pack('<I', zlib.crc32(frame)))
        self.sent += 1

    def take_bytes(self, data):
        """Take bytes off the line, and act on every whole frame."""
        self.inbox += data
        while len(self.inbox) >= HEADER_LAYOUT.size:
            magic, kind, number, length, check = HEADER_LAYOUT.unpack_from(self.inbox)
            end = HEADER_LAYOUT.size + length + 4
            if magic != b'mR' or check != zlib.crc32(self.inbox[:15]) & 0xFFFF:
                self.inbox = self.inbox[1:]  # no frame begins here
            elif len(self.inbox) < end:
                break
            else:
                frame, self.inbox = self.inbox[:end], self.inbox[end:]
                if struct.pack('<I', zlib.crc32(frame[:-4])) == frame[-4:]:
                    self.act_on_frame(kind, number, frame[HEADER_LAYOUT.size : -4])

    def act_on_frame(self, kind, number, payload):
        """Act on a frame; a driver that hears nothing repeats its last one."""
        if kind == HELLO:
            self.release_strain()
            self.begin_conversation(json.loads(payload)['ahead'])
            self.send_frame(HELLO, json.dumps(self.hello).encode())
        elif kind != AGAIN and number == self.expected:
            self.expected += 1
            first, samples, site, held = struct.unpack_from('<QIII', payload)
            is_due = kind == PLAY and first == self.first
            if not is_due or len(self.queue) / 2 + samples > BUFFER_SAMPLES:
                return self.send_frame(FAULT, b'these are not the set-points that are due')
            V_N, *motion = np.split(np.frombuffer(payload[20:]), np.cumsum([2 * samples, held]))
            driven = [(site, *each) for each in zip(*motion, strict=True)]
            self.queue.extend(zip(V_N, driven + [None] * (2 * samples - held), strict=True))
            self.first += samples

    def pass_tick(self):
        """Pass a tick: play set-points and send samples, or hold the last ones."""
        self.waited = self.waited + self.tick_seconds if self.queue else 0.0
        stored = max(self.waited, len(self.queue) / (2 * TICK_SAMPLES) * self.tick_seconds)
        self.playing = len(self.queue) > 0 and (self.playing or stored >= self.ahead)
        course = [
            self.queue.popleft() if self.playing else self.last for _ in range(2 * TICK_SAMPLES)
        ]
        ends = np.array([self.element.play_step(*each) for each in course])[1::2].T.tobytes()
        self.last = course[-1]
        if self.playing:
            self.send_frame(
                SAMPLES,
                struct.pack('<QIId', self.played, TICK_SAMPLES, self.missed, np.nan) + ends,
            )
        self.played += TICK_SAMPLES * self.playing
        self.missed = 0 if self.playing else self.missed + TICK_SAMPLES


def serve_driver(line, rig):
    """Serve a driver until it disconnects."""
    due = time.monotonic()
    while True:
        if select.select([line], [], [], max(0.0, due - time.monotonic()))[0]:
            if not (data := line.recv(1 << 16)):
                return
            rig.take_bytes(data)
        if (now := time.monotonic()) >= due:
            rig.pass_tick()
            due = max(due + rig.tick_seconds, now)  # a simulated element waits for a slow host


if __name__ == '__main__':
    server, element = socket.create_server(('127.0.0.1', int(sys.argv[1]))), Element()
    while True:
        with server.accept()[0] as connection, contextlib.suppress(OSError):
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            rig = Rig(element, connection.sendall, float(sys.argv[2]))
            serve_driver(connection, rig)
        rig.release_strain()
