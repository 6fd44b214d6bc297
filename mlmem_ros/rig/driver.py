# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver of a rig at the other end of a line, which runs on its own clock.

Set-points are sent some ticks before the rig plays them, and samples arrive that much later. Both
carry the rig's sample numbers. So latency, jitter and retransmission shift nothing, as long as
they take less than the lead.
"""

from __future__ import annotations

import json
import math
import weakref
from collections import deque
from threading import Condition

import numpy as np

from mlmem import (
    Array,
    Design,
    Driver,
    DriverError,
    ErrorCode,
    HeldCell,
    Settings,
    SettingsError,
    threads,
)
from mlmem.schema import make_printable

from .frames import PROTOCOL_VERSION, Frame, FrameKind, Hello, decode_samples, encode_set_points
from .link import FrameLink, Transport, open_line, read_option


class Rig(Driver):
    """An element behind a line.

    Between calls a thread keeps the line alive, for `patience` seconds: the device may compile or
    plan meanwhile, or wait for a core, and a rig that hears nothing lets its element go.

    Attributes:
        default_lead: Seconds by which set-points are sent ahead, without `lead` in the address.
        default_patience: Seconds of silence after which the driver gives up, without `patience`.
        heartbeat_period: Seconds without a call after which it says that it is still there.
    """

    default_lead = 0.05
    default_patience = 1.0
    heartbeat_period = 0.25
    own_clock = True

    def __init__(
        self, design: Design, settings: Settings, address: str, transport: Transport | None = None
    ) -> None:
        """Connect to a rig and receive the first samples of its element at rest.

        Args:
            address: Address of the rig, with options (see `docs/reference/rig.md`).
            transport: The line, if it is already open; the caller keeps it alive.

        Raises:
            SettingsError: The address is invalid, or the rig does not fit these settings.
            DriverError: There is no rig at the address.
        """
        lead = read_option(address, 'lead', self.default_lead)
        self._patience = read_option(address, 'patience', self.default_patience)
        self._address = address
        self._failure = ''
        self._transport = transport or open_line(address, self._patience)
        self._link = FrameLink(self._transport.send)
        self._received: deque[Frame] = deque()
        self._turn = threads.Condition()  # held by whoever uses the line
        self._beats = 0  # since the last call
        try:
            self.lag = math.ceil(lead / settings.tick_seconds)
            self._begin_session(design, settings)
        except BaseException:
            self.close()
            raise
        if transport is None:
            threads.Thread(
                target=_keep_alive,
                args=(weakref.ref(self), self._turn),
                name='mlmem-rig',
                daemon=True,
            ).start()

    def _begin_session(self, design: Design, settings: Settings) -> None:
        ahead = self.lag * settings.time.tick * settings.scale.time
        greeting = {'protocol': PROTOCOL_VERSION, 'ahead': ahead}
        self._poke = 0.1 * self._patience
        self._link.send(FrameKind.HELLO, json.dumps(greeting).encode())
        while (frame := self._receive_frame(0.0)).kind != FrameKind.HELLO:
            _check_kind(frame)
        self._link.forget()
        said = self._said = Hello.of(frame.payload)
        said.check(settings)
        if 2 * self.lag * said.samples > said.buffer:
            longest = 0.5 * said.buffer * said.seconds
            expected = f'a lead of at most {longest:.3g} s, as the rig holds {said.buffer} samples'
            raise SettingsError(
                ErrorCode.CONFLICT, 'device.address', f'{self.lag} ticks', expected
            )
        self.dt, self.nodes, self.strains = said.dt, said.nodes, said.has_actuator
        self._poke = 0.5 * self.lag * said.samples * said.seconds
        self._unit = said.length / settings.scale.length
        self._force_unit = said.force / (settings.scale.stiffness * settings.scale.length)
        self._zero = np.array(said.zero)
        self._sent = self._returned = self._missed = 0
        self._breaks: deque[int] = deque()  # numbers of samples before which the rig ran dry
        self._line = np.empty((2, 0))  # samples received and not returned yet
        self._force: float | None = None
        rest = np.zeros(self.lag * said.samples * len(said.nodes))
        self._send_set_points(rest, None)
        self._wait_for_samples(self.lag * said.samples)
        self._last = self._line[:, -1]
        at_rest = self._line.mean(axis=1)
        for name, found in zip(('left', 'right'), at_rest, strict=True):
            # a wrong zero or unit is farther off
            if min(abs(found - design.D_s1), abs(found - design.D_s2)) > 0.5:
                expected = (
                    f'such that the {name} end rests at {design.D_s1:.3f} or {design.D_s2:.3f} '
                    f'cells; it rests at {found:.3f}'
                )
                raise SettingsError(ErrorCode.CONFLICT, 'zero', said.zero, expected)

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Send set-points and return the samples of `lag` ticks ago; see `Driver.advance`."""
        with self._turn:
            self._beats = 0
            return self._exchange_samples(V_N, held_cell)

    def _exchange_samples(self, V_N: Array, held_cell: HeldCell | None) -> Array:
        if self._failure:
            raise DriverError(self._failure)
        # A lost frame is noticed when the next one comes: while three quarters are left to play.
        most = max(1, self.lag // 4) * self._said.samples * len(self.nodes)
        parts = []
        try:
            for begin in range(0, len(V_N), most):
                self._send_set_points(
                    V_N[begin : begin + most], _slice_held_cell(held_cell, begin, most)
                )
                parts.append(self._take_samples(len(V_N[begin : begin + most]) // len(self.nodes)))
        except (DriverError, OSError, EOFError) as error:
            self._failure = f'{self._address}: {getattr(error, "strerror", None) or error}'
            self._transport.close()
            raise DriverError(self._failure) from None  # whose text it has
        first = self._returned - sum(part.shape[1] for part in parts)
        self.interrupted = False
        while self._breaks and self._breaks[0] < self._returned:
            self.interrupted |= self._breaks.popleft() >= first
        self.V_N = float(V_N[-1])
        return np.concatenate(parts, axis=1)

    def end(self, site: int) -> float:
        """Return the displacement of an end in the last sample."""
        return float(self._last[0 if site == 1 else 1])

    def force(self) -> float | None:
        """Return the last measured force, or None if the rig measures none."""
        return self._force

    def health(self) -> dict[str, float | str]:
        """Return the name of the rig and the state of the line."""
        return {
            'rig': make_printable(self._said.name, 60),
            'address': self._address,
            'lead': self.lag * self._said.samples * self._said.seconds,
            'samples': self._sent,
            'missed_samples': self._missed,
            'asked_again': self._link.asked,
            'dropped_frames': self._link.repeated,
            'skipped_bytes': self._link.skipped,
        }

    def close(self) -> None:
        """Close the line; the rig then releases its element by itself."""
        with self._turn:
            self._failure = self._failure or f'the line to the rig at {self._address} is closed'
            self._transport.close()
            self._turn.notify_all()

    def _send_heartbeat(self) -> bool:
        """Send a sign of life if no call came since the last beat; return whether to go on."""
        if self._failure:
            return False
        if 0 < self._beats < self._patience / self.heartbeat_period:
            try:
                self._link.show(1 + self._sent // self._said.samples)
            except (OSError, EOFError):  # the next call finds out, and tells
                return False
        self._beats += 1
        return True

    # --- set-points ----------------------------------------------------------------------

    def _send_set_points(self, V_N: Array, held_cell: HeldCell | None) -> None:
        motion = np.empty((2, 0)) if held_cell is None else held_cell.motion / self._unit
        if held_cell is not None:
            motion = motion + np.array([[self._zero[0 if held_cell.site == 1 else 1]], [0.0]])
        site, samples = (0 if held_cell is None else held_cell.site), len(V_N) // len(self.nodes)
        self._link.send(
            FrameKind.PLAY,
            encode_set_points(
                self._sent, samples, V_N / self._unit, site, motion, self._said.numbers
            ),
        )
        self._sent += samples

    # --- samples -------------------------------------------------------------------------

    def _take_samples(self, samples: int) -> Array:
        self._wait_for_samples(samples)
        found, self._line = self._line[:, :samples], self._line[:, samples:]
        self._last = found[:, -1]
        self._returned += samples
        return found

    def _wait_for_samples(self, samples: int) -> None:
        while (missing := samples - self._line.shape[1]) > 0:
            frame = self._receive_frame(missing * self._said.seconds)
            kind = _check_kind(frame)
            if kind is not FrameKind.SAMPLES:
                raise DriverError(f'the rig sent {kind.name} instead of samples')
            self._store_samples(frame)

    def _store_samples(self, frame: Frame) -> None:
        try:
            came = decode_samples(frame.payload, self._said.numbers)
        except ValueError as error:
            raise DriverError(f'the rig sent samples of the wrong length: {error}') from error
        due = self._returned + self._line.shape[1]
        if came.first != due or due + came.ends.shape[1] > self._sent:
            raise DriverError(
                f'the rig sent samples {came.first} to {came.first + came.ends.shape[1]}; '
                f'expected {due} to at most {self._sent}'
            )
        if not np.isfinite(came.ends).all():
            raise DriverError(f'the rig sent NaN or infinity among the samples from {came.first}')
        if came.missed:
            self._missed += came.missed
            self._breaks.append(came.first)
        if math.isfinite(came.force):
            self._force = came.force * self._force_unit
        ends = (came.ends - self._zero[:, None]) * self._unit
        self._line = np.concatenate((self._line, ends), axis=1)

    def _receive_frame(self, playing: float) -> Frame:
        """Return the next frame; raise `DriverError` if the rig stays silent.

        It may need `playing` seconds in addition, to play what it has. Silence is the time spent
        listening in vain: a host that is held up in between has not listened.
        """
        silent = 0.0
        while not self._received:
            begun = threads.monotonic()
            try:
                data = self._transport.receive(self._poke)
            except EOFError as error:
                raise DriverError(f'{error}') from error
            self._received.extend(self._link.feed(data))
            silent += min(threads.monotonic() - begun, self._poke)
            if not self._received and silent > self._patience + playing:
                wrong = f'; {self._link.wrong}' if self._link.wrong else ''
                raise DriverError(f'the rig has been silent for {self._patience:g} s{wrong}')
            if not data:
                self._link.request_next(self._transport.filler)
        return self._received.popleft()


def _keep_alive(rig: weakref.ref[Rig], turn: Condition) -> None:
    """Let a rig's driver send a sign of life between calls, until it is closed or forgotten."""
    with turn:
        while True:
            turn.wait(Rig.heartbeat_period)
            driver = rig()
            if driver is None or not driver._send_heartbeat():
                return
            del driver


def _check_kind(frame: Frame) -> FrameKind:
    """Return the kind of a frame; raise `DriverError` if it is unknown, or tells of a fault."""
    try:
        kind = FrameKind(frame.kind)
    except ValueError:
        known = ', '.join(f'{kind} {kind.name}' for kind in FrameKind)
        raise DriverError(
            f'the rig sent a frame of kind {frame.kind}; known are {known}'
        ) from None
    if kind is FrameKind.FAULT:
        text = make_printable(frame.payload.decode(errors='replace'), 200)
        raise DriverError(f'the rig has stopped: {text}')
    return kind


def _slice_held_cell(held_cell: HeldCell | None, begin: int, most: int) -> HeldCell | None:
    """Return the drive of a held end during a part of the set-points."""
    if held_cell is None or begin >= held_cell.motion.shape[1]:
        return None
    return HeldCell(held_cell.site, held_cell.motion[:, begin : begin + most])
