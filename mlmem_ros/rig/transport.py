# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lines to a rig: TCP, or a serial port of Linux. Both need only the standard library."""

from __future__ import annotations

import os
import select
import socket
import termios
import tty
from urllib.parse import SplitResult, parse_qs, urlsplit

from ..device import DriverError, SettingsError

MOST = 1 << 16
"""Most bytes read in one call."""


class Tcp:
    """A TCP connection. Calls raise `OSError` if it is broken."""

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
        if data := self._connection.recv(MOST):
            return data
        raise EOFError('the rig has closed the connection')

    def close(self) -> None:
        """Close the connection."""
        self._connection.close()


class Serial:
    """A serial port in raw mode, used as a `Tcp`."""

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
                self._come += self._read()
            if free:
                data = data[os.write(self._port, data) :]

    def receive(self, seconds: float) -> bytes:
        """Return the bytes that have arrived."""
        if not self._come and select.select([self._port], [], [], max(0.0, seconds))[0]:
            self._come = self._read()
        come, self._come = self._come, b''
        return come

    def _read(self) -> bytes:
        if data := os.read(self._port, MOST):
            return data
        raise EOFError('the port has gone')

    def close(self) -> None:
        """Close the port; closing again does nothing."""
        port, self._port = self._port, -1
        if port >= 0:
            os.close(port)


Transport = Tcp | Serial
"""A line to a rig."""

FORMS = 'tcp://HOST:PORT or serial:///dev/PORT?baud=BAUD'


def opened(address: str, patience: float) -> Transport:
    """Open the line to an address, one of `FORMS`, perhaps with other options; connect within
    `patience` seconds.

    Raises:
        SettingsError: It is not a valid address.
        DriverError: There is no rig at the address.
    """
    parts = _split(address)
    try:
        if parts.scheme == 'serial':
            baud = option(address, 'baud', 1_000_000)
            if not hasattr(termios, f'B{baud:.0f}'):
                raise SettingsError(f'baud must be a rate that the system supports; got {baud:g}')
            return Serial(parts.path, int(baud), patience)
        assert parts.hostname is not None
        assert parts.port is not None
        return Tcp(socket.create_connection((parts.hostname, parts.port), timeout=patience))
    except OSError as error:
        raise DriverError(f'no rig at {address}: {error.strerror or error}') from error


def option(address: str, name: str, default: float) -> float:
    """Return an option of an address, such as `?lead=0.1`.

    Raises:
        SettingsError: It is not a number above 0.
    """
    given = parse_qs(_split(address).query, keep_blank_values=True).get(name)
    if given is None:
        return default
    try:
        value = float(given[-1])
    except ValueError:
        value = 0.0
    if not 0.0 < value < 1e9:  # false for NaN, too
        raise SettingsError(f'{name} in device.address must be a number above 0; got {given[-1]}')
    return value


def _split(address: str) -> SplitResult:
    try:
        parts = urlsplit(address)
        good = parts.path if parts.scheme == 'serial' else parts.hostname and parts.port
    except ValueError:
        good = None
    if not good or parts.scheme not in ('tcp', 'serial'):
        raise SettingsError(f'device.address of a rig must be {FORMS}; got {address!r}')
    return parts
