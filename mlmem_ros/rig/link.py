# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames in their order over a line that may lose, damage, repeat or reorder them."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator

from ..device import DriverError
from .frames import Frame, Kind, Parser, encode

KEPT = 4096
"""Frames that can be sent again."""


class Link:
    """One side of a line: every frame it sends has the next number, and so has what it hears.

    A number that is left out is asked for again, with all that follow it; one that has been is
    dropped. So each frame is heard once and in its place, or not at all.

    Attributes:
        asked: Times that frames were asked for again.
        repeated: Frames that came again, or too early, and were dropped.
    """

    def __init__(self, send: Callable[[bytes], object], answers: bool = False) -> None:
        """Begin with number 0 on both sides.

        Args:
            send: Puts bytes on the line.
            answers: Whether this is the rig's side, which begins anew with every hello.
        """
        self._answers = answers
        self.asked = self.repeated = 0
        self._send = send
        self._parser = Parser()
        self._sent: deque[bytes] = deque(maxlen=KEPT)
        self._next_out = self._next_in = 0
        self._missed: int | None = None  # the number asked for last
        self._seen = 0  # the last that came instead of it

    @property
    def skipped(self) -> int:
        """Bytes that came and were in no frame."""
        return self._parser.skipped

    def send(self, kind: Kind, payload: bytes) -> None:
        """Send a frame."""
        self._sent.append(encode(kind, self._next_out, payload))
        self._next_out += 1
        self._send(self._sent[-1])

    def forget(self) -> None:
        """Send nothing again that was sent so far: it has been answered."""
        self._sent.clear()

    def poke(self) -> None:
        """Ask for what may have been lost, and send what may have been; it was waited for."""
        if self._sent:
            self._send(self._sent[-1])
        self.asked += 1
        self._send(encode(Kind.AGAIN, self._next_in))

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Take bytes off the line; yield the frames whose turn it is.

        Raises:
            DriverError: A frame is asked for that has been answered: the other side has begun
                anew.
        """
        yield from filter(self._in_turn, self._parser.feed(data))

    def _in_turn(self, frame: Frame) -> bool:
        if frame.kind is Kind.AGAIN:
            missing = max(0, self._next_out - frame.number)
            if missing > len(self._sent):
                raise DriverError('the rig asks for what it has had: it has begun anew')
            for sent in list(self._sent)[-missing:] if missing else ():
                self._send(sent)
            return False
        if self._answers and frame.kind is Kind.HELLO:
            self._next_in = self._next_out = 0
            self._sent.clear()
        if frame.number == self._next_in:
            self._next_in += 1
            self._missed = None
            return True
        self.repeated += 1
        if frame.number > self._next_in:
            if self._missed != self._next_in or frame.number <= self._seen:  # it is lost, or again
                self._missed = self._next_in
                self.asked += 1
                self._send(encode(Kind.AGAIN, self._next_in))
            self._seen = frame.number
        return False
