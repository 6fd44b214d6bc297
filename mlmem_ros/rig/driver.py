# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver of a rig at the other end of a line, which plays by its own clock.

Set-points go out some ticks before the rig plays them, and samples come back as much later: both
carry the numbers of the rig's samples. So latency, jitter and retransmitted frames shift nothing,
as long as they take less than the lead.
"""

from __future__ import annotations

import json
import math
from collections import deque
from typing import NoReturn

import numpy as np

from .. import threads
from ..clipped import printable
from ..device import Driver, DriverError, Settings, SettingsError
from ..physics import Design, Drive
from ..physics.potential import Array
from .frames import VERSION, Frame, Kind, play, played
from .hello import Hello
from .link import Link
from .transport import Transport, opened, option

LEAD = 0.05
"""Seconds by which set-points are ahead of the rig, unless the address says `lead`."""

PATIENCE = 1.0
"""Seconds after which a silent rig is given up, unless the address says `patience`."""

NOBODY = np.empty((2, 0))


class Rig(Driver):
    """An element behind a line."""

    own_clock = True

    def __init__(
        self, design: Design, settings: Settings, address: str, transport: Transport | None = None
    ) -> None:
        """Shake hands with a rig, and receive samples of its element at rest.

        Args:
            design: The element.
            settings: The instrument's settings.
            address: Where the rig is, and options (see `docs/drivers.md`).
            transport: The line, if it is already open.

        Raises:
            SettingsError: The address is invalid, or the rig does not fit these settings.
            DriverError: Nobody answers there, or not like a rig.
        """
        lead, self._patience = option(address, 'lead', LEAD), option(address, 'patience', PATIENCE)
        self._address = address
        self._failure = ''
        self._transport = transport or opened(address, self._patience)
        self._link = Link(self._transport.send)
        self._heard: deque[Frame] = deque()
        try:
            self.lag = math.ceil(lead / (settings.time.tick * settings.scale.time))
            self._begin(settings)
        except BaseException:
            self.close()
            raise

    def _begin(self, settings: Settings) -> None:
        ahead = self.lag * settings.time.tick * settings.scale.time
        greeting = {'protocol': VERSION, 'ahead': ahead}
        self._poke = 0.1 * self._patience
        self._link.send(Kind.HELLO, json.dumps(greeting).encode())
        while (frame := self._receive(0.0)).kind is not Kind.HELLO:
            pass
        self._link.forget()
        said = self._said = Hello.of(frame.payload)
        said.check(settings)
        if 2 * self.lag * said.samples > said.buffer:
            raise SettingsError(
                f'lead in device.address must be at most {0.5 * said.buffer * said.seconds:.3g} '
                f's, for the rig holds {said.buffer} samples; got {self.lag} ticks'
            )
        self.dt, self.nodes = said.dt, said.nodes
        self._poke = 0.5 * self.lag * said.samples * said.seconds
        self._unit = said.length / settings.scale.length
        self._force_unit = said.force / (settings.scale.stiffness * settings.scale.length)
        self._zero = np.array(said.zero)
        self._played = self._told = self._missed = 0
        self._breaks: deque[int] = deque()  # numbers of samples before which there is one
        self._line = NOBODY  # samples that have come and are not told yet
        self._force: float | None = None
        rest = np.zeros(self.lag * said.samples * len(said.nodes))
        self._play(rest, None)
        self._listen(self.lag * said.samples)
        self._last = self._line[:, -1]

    def advance(
        self, V_N: Array, drive: Drive | None = None, shake: Array | None = None, looks: int = 1
    ) -> Array:
        """Send set-points, and return the samples of `lag` ticks before; see `Driver.advance`."""
        if self._failure:
            raise DriverError(self._failure)
        most = self.lag * self._said.samples * len(self.nodes)
        parts = []
        try:
            for begin in range(0, len(V_N), most):  # of which the rig can hold two
                self._play(V_N[begin : begin + most], _part(drive, begin, most))
                parts.append(self._tell(len(V_N[begin : begin + most]) // len(self.nodes)))
        except (DriverError, OSError, EOFError) as error:
            self._fail(getattr(error, 'strerror', None) or str(error))
        first = self._told - sum(part.shape[1] for part in parts)
        self.interrupted = False
        while self._breaks and self._breaks[0] < self._told:
            self.interrupted |= self._breaks.popleft() >= first
        self.V_N = float(V_N[-1])
        return np.concatenate(parts, axis=1)

    def end(self, site: int) -> float:
        """Return the displacement that an end had in the last sample told."""
        return float(self._last[0 if site == 1 else 1])

    def force(self) -> float | None:
        """Return the force that the rig told last, if it measures one."""
        return self._force

    def health(self) -> dict[str, float | str]:
        """Return who the rig is, and how the line is."""
        return {
            'rig': printable(self._said.name, 60),
            'address': self._address,
            'lead': self.lag * self._said.samples * self._said.seconds,
            'samples': self._played,
            'missed_samples': self._missed,
            'asked_again': self._link.asked,
            'dropped_frames': self._link.repeated,
            'skipped_bytes': self._link.skipped,
        }

    def close(self) -> None:
        """Hang up: a rig that nobody talks to lets its element go by itself."""
        self._failure = self._failure or f'the line to the rig at {self._address} is closed'
        self._transport.close()

    # --- set-points ----------------------------------------------------------------------

    def _play(self, V_N: Array, drive: Drive | None) -> None:
        motion = NOBODY if drive is None else drive.motion / self._unit
        if drive is not None:
            motion = motion + np.array([[self._zero[0 if drive.site == 1 else 1]], [0.0]])
        site, samples = (0 if drive is None else drive.site), len(V_N) // len(self.nodes)
        self._link.send(
            Kind.PLAY,
            play(self._played, samples, V_N / self._unit, site, motion, self._said.numbers),
        )
        self._played += samples

    # --- samples -------------------------------------------------------------------------

    def _tell(self, samples: int) -> Array:
        """Return the next samples, as soon as they have come."""
        self._listen(samples)
        told, self._line = self._line[:, :samples], self._line[:, samples:]
        self._last = told[:, -1]
        self._told += samples
        return told

    def _listen(self, samples: int) -> None:
        """Wait until so many samples have come."""
        while (missing := samples - self._line.shape[1]) > 0:
            frame = self._receive(missing * self._said.seconds)
            if frame.kind is Kind.FAULT:
                text = printable(frame.payload.decode(errors='replace'), 200)
                raise DriverError(f'the rig has stopped: {text}')
            if frame.kind is not Kind.SAMPLES:
                raise DriverError(f'the rig sends {frame.kind.name} where samples are due')
            self._take(frame)

    def _take(self, frame: Frame) -> None:
        try:
            came = played(frame.payload, self._said.numbers)
        except ValueError as error:
            raise DriverError(f'the rig lies in length: it sends {error}') from error
        due = self._told + self._line.shape[1]
        if came.first != due or due + came.ends.shape[1] > self._played:
            raise DriverError(
                f'the rig sends samples {came.first} to {came.first + came.ends.shape[1]} where '
                f'{due} to at most {self._played} are due'
            )
        if not np.isfinite(came.ends).all():
            raise DriverError(f'the rig sends NaN or infinity among samples from {came.first}')
        if came.missed:
            self._missed += came.missed
            self._breaks.append(came.first)
        if math.isfinite(came.force):
            self._force = came.force * self._force_unit
        ends = (came.ends - self._zero[:, None]) * self._unit
        self._line = np.concatenate((self._line, ends), axis=1)

    def _receive(self, playing: float) -> Frame:
        """Return the next frame; raise `DriverError` where none comes though it should.

        Args:
            playing: Seconds that the rig may need before it has anything to say.
        """
        last = threads.monotonic() + self._patience + playing
        while not self._heard:
            try:
                data = self._transport.receive(self._poke)
            except EOFError as error:
                raise DriverError(f'{error}') from error
            self._heard.extend(self._link.feed(data))
            if not self._heard and threads.monotonic() > last:
                raise DriverError(f'the rig has been silent for {self._patience:g} s')
            if not data:
                self._link.poke()
        return self._heard.popleft()

    def _fail(self, why: str) -> NoReturn:
        self._failure = f'{self._address}: {why}'
        self._transport.close()
        raise DriverError(self._failure)


def _part(drive: Drive | None, begin: int, most: int) -> Drive | None:
    """Return what of a held end falls into a part of the set-points."""
    if drive is None or begin >= drive.motion.shape[1]:
        return None
    return Drive(drive.site, drive.motion[:, begin : begin + most])
