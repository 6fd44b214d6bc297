# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An emulated rig behind a TCP port, over a line with latency, jitter and losses."""

from __future__ import annotations

import contextlib
import random
import select
import socket
from collections import deque
from dataclasses import dataclass

from mlmem_ros import threads
from mlmem_ros.device import DriverError
from mlmem_ros.rig.frames import Parser, encode
from mlmem_ros.rig.link import MOST

from .emulated import EmulatedRig

WAKE = 0.002
"""Seconds between two looks at the clock while set-points are played."""

IDLE = 0.02
"""Seconds between two looks otherwise."""

LATE = 0.01
"""Seconds by which a look may be late; beyond that the rig's clock waits for a slow machine."""


@dataclass(frozen=True)
class Line:
    """Properties of a line.

    Attributes:
        latency: Delay of every frame in seconds.
        jitter: Greatest additional random delay in seconds.
        loss: Probability that a frame is lost.
        restart: Seconds after which the rig disconnects and restarts; 0: never.
    """

    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    restart: float = 0.0
    seed: int = 0


class _Wire:
    """One direction of a line: frames arrive late and in order, or never."""

    def __init__(self, line: Line, chance: random.Random) -> None:
        self._line, self._chance = line, chance
        self._under_way: deque[tuple[float, bytes]] = deque()

    def push(self, data: bytes) -> None:
        """Put a frame on the line."""
        line, chance = self._line, self._chance
        if chance.random() < line.loss:
            return
        due = threads.monotonic() + line.latency + chance.uniform(0.0, line.jitter)
        last = self._under_way[-1][0] if self._under_way else 0.0
        self._under_way.append((max(last, due), data))

    def come(self, now: float) -> bytes:
        """Return what has arrived by a time."""
        come = []
        while self._under_way and self._under_way[0][0] <= now:
            come.append(self._under_way.popleft()[1])
        return b''.join(come)

    @property
    def due(self) -> float:
        """When the next frame arrives."""
        return self._under_way[0][0] if self._under_way else float('inf')


class Server:
    """Serves one rig to one client at a time."""

    def __init__(self, rig: EmulatedRig, line: Line, host: str = '127.0.0.1', port: int = 0):
        """Listen at an address for clients of a rig, whose element keeps its state from one to the
        next; port 0: any free one.

        Raises:
            OSError: The port is not free.
        """
        self._rig, self._line = rig, line
        self._chance = random.Random(line.seed)
        self._listener = socket.create_server((host, port))
        self.port: int = self._listener.getsockname()[1]
        self.clients = 0
        self._ended = self._restarts = False

    def run(self) -> None:
        """Serve until `close`."""
        with self._listener:
            while not self._ended:
                if not select.select([self._listener], [], [], 0.1)[0]:
                    continue
                connection, _ = self._listener.accept()
                self.clients += 1
                with connection, contextlib.suppress(OSError, DriverError):
                    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                    self._serve(connection)

    def close(self) -> None:
        """Stop serving; any thread may call it."""
        self._ended = True

    def restart(self) -> None:
        """Disconnect, as a restarting rig does; any thread may call it."""
        self._restarts = True

    def _serve(self, connection: socket.socket) -> None:
        inward, outward = _Wire(self._line, self._chance), _Wire(self._line, self._chance)
        rig, parser = self._rig, Parser()
        rig.begin(outward.push)
        last = begun = threads.monotonic()
        self._restarts = False
        while not (self._ended or self._restarts):
            wait = min(WAKE if rig.playing else IDLE, min(inward.due, outward.due) - last)
            if select.select([connection], [], [], max(0.0, wait))[0]:
                if not (data := connection.recv(MOST)):
                    return
                for frame in parser.feed(data):
                    inward.push(encode(*frame))
            now = threads.monotonic()
            rig.take(inward.come(now))
            rig.pass_time(min(now - last, max(0.0, wait) + LATE))
            last = now
            if data := outward.come(now):
                connection.sendall(data)
            if 0.0 < self._line.restart < now - begun:
                self.restart()
