# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames in order over a line that may lose, damage, repeat or reorder them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from ..device import DriverError
from .frames import Frame, Kind, Parser, encode

KEPT = 4096
"""Number of sent frames that are kept for retransmission."""


class Link:
    """One side of a line: frames are numbered in both directions.

    If a number is missing, that frame and all after it are requested again; a repeated one is
    dropped. So each frame is received once and in order, or not at all.

    Attributes:
        asked: How often frames were requested again.
        repeated: Frames dropped because they were repeated or early.
    """

    def __init__(self, send: Callable[[bytes], object], answers: bool = False) -> None:
        """Begin with number 0 on both sides; the rig's side `answers`, and restarts with every
        hello.
        """
        self._answers = answers
        self.asked = self.repeated = 0
        self._wrong = ''
        self._send = send
        self._parser = Parser()
        self._sent: deque[bytes] = deque(maxlen=KEPT)
        self._next_out = self._next_in = 0
        self._missed: int | None = None  # the number requested last
        self._seen = 0  # the last one received instead of it

    @property
    def skipped(self) -> int:
        """Received bytes outside any frame."""
        return self._parser.skipped

    @property
    def wrong(self) -> str:
        """What was wrong with the last bytes outside any frame, or with the last frame dropped."""
        return self._parser.wrong or self._wrong

    def send(self, kind: int, payload: bytes) -> None:
        """Send a frame."""
        self._sent.append(encode(kind, self._next_out, payload))
        self._next_out += 1
        self._send(self._sent[-1])

    def forget(self) -> None:
        """Drop the frames kept for retransmission: they have been answered."""
        self._sent.clear()

    def poke(self) -> None:
        """After a silence: repeat the last frame and request the next."""
        if self._sent:
            self._send(self._sent[-1])
        self.asked += 1
        self._send(encode(Kind.AGAIN, self._next_in))

    def show(self, due: int) -> None:
        """Send a sign of life: a request for frames from number `due` on, of which none is sent
        yet.
        """
        self._send(encode(Kind.AGAIN, due))

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Take bytes off the line and yield the frames that are next in order.

        Raises:
            DriverError: A frame is requested that was answered: the other side has restarted.
        """
        yield from filter(self._in_turn, self._parser.feed(data))

    def _in_turn(self, frame: Frame) -> bool:
        if frame.kind == Kind.AGAIN:
            missing = max(0, self._next_out - frame.number)
            if missing > len(self._sent):
                raise DriverError('the rig requests frames that it has answered: it has restarted')
            for sent in list(self._sent)[-missing:] if missing else ():
                self._send(sent)
            return False
        if self._answers and frame.kind == Kind.HELLO:
            self._next_in = self._next_out = 0
            self._sent.clear()
        if frame.number == self._next_in:
            self._next_in += 1
            self._missed = None
            return True
        self.repeated += 1
        self._wrong = f'a frame has number {frame.number}; expected {self._next_in}'
        if frame.number > self._next_in:
            if self._missed != self._next_in or frame.number <= self._seen:  # lost, or lost again
                self._missed = self._next_in
                self.asked += 1
                self._send(encode(Kind.AGAIN, self._next_in))
            self._seen = frame.number
        return False
