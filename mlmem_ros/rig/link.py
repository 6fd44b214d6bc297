# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lines to a rig, and frames in order over one that may lose, damage, repeat or reorder them.

A line is TCP, or a serial port of Linux; both need only the standard library.
"""

from __future__ import annotations

import os
import select
import socket
import termios
import tty
from collections import deque
from collections.abc import Callable, Iterator
from urllib.parse import SplitResult, parse_qs, urlsplit

from mlmem import DriverError, SettingsError

from .frames import Frame, FrameKind, Parser, encode_frame


class FrameLink:
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
        self._sent: deque[bytes] = deque(maxlen=4096)  # kept for retransmission
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
        self._sent.append(encode_frame(kind, self._next_out, payload))
        self._next_out += 1
        self._send(self._sent[-1])

    def forget(self) -> None:
        """Drop the frames kept for retransmission: they have been answered."""
        self._sent.clear()

    def request_next(self, filler: bytes) -> None:
        """After a silence: repeat the last frame and request the next; before the hello came, send
        a `filler` first.
        """
        if not self._next_in:
            self._send(filler)
        if self._sent:
            self._send(self._sent[-1])
        self.asked += 1
        self._send(encode_frame(FrameKind.AGAIN, self._next_in))

    def show(self, due: int) -> None:
        """Send a sign of life: a request for frames from number `due` on, of which none is sent
        yet.
        """
        self._send(encode_frame(FrameKind.AGAIN, due))

    def feed(self, data: bytes) -> Iterator[Frame]:
        """Take bytes off the line and yield the frames that are next in order.

        Raises:
            DriverError: A frame is requested that was answered: the other side has restarted.
        """
        yield from filter(self._accept_frame, self._parser.feed(data))

    def _accept_frame(self, frame: Frame) -> bool:
        if frame.kind == FrameKind.AGAIN:
            missing = max(0, self._next_out - frame.number)
            if missing > len(self._sent):
                raise DriverError('the rig requests frames that it has answered: it has restarted')
            for sent in list(self._sent)[-missing:] if missing else ():
                self._send(sent)
            return False
        if self._answers and frame.kind == FrameKind.HELLO:
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
                self._send(encode_frame(FrameKind.AGAIN, self._next_in))
            self._seen = frame.number
        return False


class Tcp:
    """A TCP connection. Calls raise `OSError` if it is broken.

    Attributes:
        filler: Completes what an earlier driver left of a frame: nothing, it has gone with its
            connection.
    """

    filler = b''

    def __init__(self, connection: socket.socket) -> None:
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._connection = connection

    def send(self, data: bytes) -> None:
        """Send bytes."""
        self._connection.sendall(data)

    def receive(self, seconds: float) -> bytes:
        """Return the bytes that have arrived; none if the time is up.

        Raises:
            EOFError: The other side has closed it.
        """
        if not select.select([self._connection], [], [], max(0.0, seconds))[0]:
            return b''
        if data := self._connection.recv(1 << 16):
            return data
        raise EOFError('the rig has closed the connection')

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


class Serial:
    """A serial port in raw mode, used as a `Tcp`.

    Attributes:
        filler: Zeros, sent in place of the rest of a frame that an earlier driver left unfinished:
            the rig would take all that follows for it.
    """

    filler = bytes(1 << 13)

    def __init__(self, path: str, baud: int, patience: float) -> None:
        """Open a port by its device file, at so many bits per second; it may accept no data for
        `patience` seconds.

        Raises:
            OSError: There is no such port, or no permission.
        """
        self._patience = patience
        self._come = b''
        self._port = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        try:
            tty.setraw(self._port)
            settings = termios.tcgetattr(self._port)
            settings[2] |= termios.CLOCAL | termios.CREAD
            settings[4] = settings[5] = getattr(termios, f'B{baud}')
            termios.tcsetattr(self._port, termios.TCSANOW, settings)
            termios.tcflush(self._port, termios.TCIOFLUSH)  # left by an earlier user
        except BaseException:
            os.close(self._port)
            raise

    def send(self, data: bytes) -> None:
        """Send bytes, and receive meanwhile: the other side may block until we do."""
        while data:
            come, free, _ = select.select([self._port], [self._port], [], self._patience)
            if not (come or free):
                raise TimeoutError(f'the port accepted no data for {self._patience:g} s')
            if come:
                self._come += self._read_port()
            if free:
                data = data[os.write(self._port, data) :]

    def receive(self, seconds: float) -> bytes:
        """Return the bytes that have arrived."""
        if not self._come and select.select([self._port], [], [], max(0.0, seconds))[0]:
            self._come = self._read_port()
        come, self._come = self._come, b''
        return come

    def _read_port(self) -> bytes:
        if data := os.read(self._port, 1 << 16):
            return data
        raise EOFError('the port has gone')

    def close(self) -> None:
        """Close the port; closing again does nothing."""
        port, self._port = self._port, -1
        if port >= 0:
            os.close(port)


Transport = Tcp | Serial
"""A line to a rig."""


def open_line(address: str, patience: float) -> Transport:
    """Open the line to an address, `tcp://HOST:PORT` or `serial:///dev/PORT?baud=BAUD`, perhaps
    with other options; connect within `patience` seconds.

    Raises:
        SettingsError: It is not a valid address.
        DriverError: There is no rig at the address.
    """
    parts = _split_address(address)
    try:
        if parts.scheme == 'serial':
            baud = read_option(address, 'baud', 1_000_000)
            if not hasattr(termios, f'B{baud:.0f}'):
                expected = 'one whose baud is a rate that the system supports'
                raise SettingsError.out_of_range('device.address', address, expected)
            return Serial(parts.path, int(baud), patience)
        assert parts.hostname is not None
        assert parts.port is not None
        return Tcp(socket.create_connection((parts.hostname, parts.port), timeout=patience))
    except OSError as error:
        raise DriverError(f'no rig at {address}: {error.strerror or error}') from error


def read_option(address: str, name: str, default: float) -> float:
    """Return an option of an address, such as `?lead=0.1`.

    Raises:
        SettingsError: It is not a number above 0.
    """
    given = parse_qs(_split_address(address).query, keep_blank_values=True).get(name)
    if given is None:
        return default
    try:
        value = float(given[-1])
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e9:  # false for NaN, too
        expected = f'one whose {name} is a number above 0'
        raise SettingsError.out_of_range('device.address', address, expected)
    return value


def _split_address(address: str) -> SplitResult:
    try:
        parts = urlsplit(address)
        good = parts.path if parts.scheme == 'serial' else parts.hostname and parts.port
    except ValueError:
        good = None
    if not good or parts.scheme not in ('tcp', 'serial'):
        expected = 'tcp://HOST:PORT or serial:///dev/PORT?baud=BAUD for a rig'
        raise SettingsError.out_of_range('device.address', address, expected)
    return parts
