# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An emulated rig: a simulated chain that plays the frames it receives, on its own clock; what it
measures with: units and zeros, and how far off it is; and its TCP port, over a line with latency,
jitter and losses.
"""

from __future__ import annotations

import contextlib
import math
import random
import select
import socket
from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from mlmem import Driver, DriverError, Settings, SettingsError, threads
from mlmem.instrument.drivers import Simulation
from mlmem.parsing import DecodeError, decode_value, parse_json
from mlmem.physics import Chain, Design, HeldCell, StateError
from mlmem.physics.values import Array
from mlmem.schema import Description
from mlmem_ros.rig.frames import PROTOCOL_VERSION, FrameKind, Hello, Layout, Parser, encode_frame
from mlmem_ros.rig.link import FrameLink


@dataclass
class RigSensors:
    """The transducers of both ends; each moves its end by what it measures.

    So a wrong gain makes the pulse smaller or larger, too.

    Attributes:
        unit: Unit of displacements, in cells.
        zero: Readings of the left and the right end at displacement 0, in that unit.
        gain: Displacements read over the true ones, of the left and the right end.
        noise: Standard deviation of a sample, in cells.
        seed: Of the random numbers.
    """

    unit: float = 1.0
    zero: tuple[float, float] = (0.0, 0.0)
    gain: tuple[float, float] = (1.0, 1.0)
    noise: float = 0.0
    seed: int = 0

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            SettingsError: One is out of range.
        """
        if not 0.0 <= self.noise < math.inf:
            raise SettingsError.out_of_range('noise', self.noise, 'at least 0')
        if min(self.gain) <= 0.0:
            raise SettingsError.out_of_range('gain', self.gain, 'above 0')
        self._rng = np.random.default_rng(self.seed)

    def measure_ends(self, ends: Array) -> Array:
        """Return what is read of displacements in cells, shape (2, n) both."""
        read = ends * np.array(self.gain)[:, None]
        if self.noise:
            read = read + self.noise * self._rng.standard_normal(read.shape)
        return np.asarray(read / self.unit + np.array(self.zero)[:, None])

    def held(self, site: int, motion: Array) -> Array:
        """Return the motion of a held end in cells, from set-points; shape (2, m) both."""
        end = 0 if site == 1 else 1
        zero = np.array([[self.zero[end]], [0.0]])
        return np.asarray((motion - zero) * self.unit / self.gain[end])


MAX_BUFFER_SAMPLES = 1 << 18
"""Samples of set-points that it can hold."""


class EmulatedRig:
    """An element with a rig around it; the caller supplies the line and the clock."""

    def __init__(
        self,
        design: Design,
        settings: Settings,
        element: Driver | None = None,
        sensors: RigSensors | None = None,
        *,
        numbers: str = '<f8',
        drift: float = 0.0,
        at_once: bool = False,
        actuator: bool = True,
    ) -> None:
        """Make a rig around an element.

        Args:
            design: What the element is meant to be.
            settings: Tick and scale are used.
            element: What it is; by default a blank one, exactly as designed.
            sensors: What it measures with; by default ideal ones, in cells.
            numbers: Type of its numbers: '<f4' or '<f8'.
            drift: Fraction by which its clock is fast.
            at_once: Play set-points as soon as they arrive, without a clock; the element stands
                still in between.
            actuator: Whether it can strain its element.
        """
        scale = settings.scale
        self.element = element or Simulation.build_blank(design, settings.time)
        self.sensors = sensors or RigSensors()
        self.element.advance(np.zeros(0))  # compiles it
        dt, unit = self.element.dt, self.sensors.unit
        self._samples = round(settings.time.tick / dt)
        self.tick_seconds = settings.tick_seconds / (1.0 + drift)
        self._at_once = at_once
        self._strained = unit if actuator else 0.0  # cells of a unit of its set-points
        self._hello = Hello(
            PROTOCOL_VERSION,
            'emulated',
            dt,
            self._samples,
            dt * scale.time,
            unit * scale.length,
            MAX_BUFFER_SAMPLES,
            scale.stiffness * scale.length,
            self.sensors.zero,
            self.element.nodes,
            numbers,
            ('strain', 'left', 'right') if actuator else ('left', 'right'),
        )
        self.begin(lambda data: None)

    @property
    def chain(self) -> Chain:
        """The element, if it is one of the package's own chains."""
        assert self.element.chain is not None
        return self.element.chain

    def begin(self, send: Callable[[bytes], object]) -> None:
        """Serve a new client, to which `send` puts bytes on the line; the set-points of the
        previous one are dropped.
        """
        self.release_strain()
        self._link = FrameLink(send, answers=True)
        self._reset_playback(0.0)

    def _reset_playback(self, ahead: float) -> None:
        self._ahead = ahead
        # displacements of the substrate's end, and a held end
        self._ticks: deque[tuple[Array, HeldCell | None]] = deque()
        self._due = self._waited = 0.0
        self._next = self._played = self._missed = 0
        self._playing = self._stopped = False
        self._held: HeldCell | None = None  # the end that is still held after the last tick

    def release_strain(self) -> None:
        """Ramp the strain to zero and let the element come to rest, unless it is beyond that."""
        element, nodes = self.element, len(self.element.nodes)
        # in so many time units
        falling = np.linspace(1.0, 0.0, nodes * round(600.0 / element.dt))
        if element.V_N:
            with contextlib.suppress(StateError):
                element.advance(element.V_N * falling)
                element.advance(np.zeros(nodes * round(2000.0 / element.dt)))

    @property
    def playing(self) -> bool:
        """Whether there is anything to play."""
        return bool(self._ticks)

    def take(self, data: bytes) -> None:
        """Take bytes off the line; answer a frame that cannot be served with a FAULT."""
        for frame in self._link.feed(data):
            with self._report_faults():
                if frame.kind == FrameKind.HELLO:
                    self._reset_playback(_read_lead(frame.payload))
                    self._link.send(FrameKind.HELLO, self._hello.payload())
                elif frame.kind == FrameKind.PLAY:
                    self._store_set_points(frame.payload)

    @contextlib.contextmanager
    def _report_faults(self) -> Iterator[None]:
        """Stop and send a FAULT if the block raises what is wrong with a frame."""
        try:
            yield
        except ValueError as error:  # StateError and DecodeError, too
            self._reset_playback(0.0)
            self._stopped = True
            self._link.send(FrameKind.FAULT, str(error).encode())

    def _store_set_points(self, payload: bytes) -> None:
        """Keep the set-points of a PLAY until they are due.

        Raises:
            ValueError: They cannot be played.
        """
        nodes, itemsize = len(self._hello.nodes), np.dtype(self._hello.numbers).itemsize
        if len(payload) < Layout.PLAY.size:
            raise ValueError(
                f'a PLAY must have at least {Layout.PLAY.size} bytes; got {len(payload)}'
            )
        first, samples, site, driven = Layout.PLAY.unpack_from(payload)
        count = nodes * samples
        if len(payload) - Layout.PLAY.size != (count + 2 * driven) * itemsize:
            raise ValueError(
                f'a PLAY of {samples} samples and {driven} set-points of a held end must have '
                f'{Layout.PLAY.size + (count + 2 * driven) * itemsize} bytes; got {len(payload)}'
            )
        if first != self._next:
            raise ValueError(f'the next set-points must be those of {self._next}; got {first}')
        ticks, rest = divmod(samples, self._samples)
        if rest:
            raise ValueError(f'samples must be whole ticks of {self._samples}; got {samples}')
        if len(self._ticks) * self._samples + samples > MAX_BUFFER_SAMPLES:
            raise ValueError(f'set-points of more than {MAX_BUFFER_SAMPLES} samples are waiting')
        if driven > count:
            raise ValueError(f'an end must be held for at most {count} set-points; got {driven}')
        numbers = np.frombuffer(payload, self._hello.numbers, offset=Layout.PLAY.size)
        numbers = numbers.astype(np.float64)
        V_N, motion = numbers[:count], numbers[count:].reshape(2, driven)
        if site:
            motion = self.sensors.held(site, motion)
        self._next += samples
        for number in range(ticks):
            part = slice(number * nodes * self._samples, (number + 1) * nodes * self._samples)
            held = HeldCell(site, motion[:, part]) if site and motion[:, part].size else None
            self._ticks.append((V_N[part] * self._strained, held))

    def pass_time(self, seconds: float) -> None:
        """Advance by the time of an exact clock: play what is due and send the samples."""
        with self._report_faults():
            if not self._stopped:
                self._advance_clock(seconds)

    def _advance_clock(self, seconds: float) -> None:
        if self._at_once:
            self._play_ticks(len(self._ticks))
            return
        self._due += seconds / self.tick_seconds
        due = int(self._due)
        self._due -= due
        if self._ticks and not self._playing:
            self._waited += seconds
            ahead = len(self._ticks) * self.tick_seconds
            self._playing = max(ahead, self._waited) >= self._ahead
        played = min(due, len(self._ticks)) if self._playing else 0
        self._play_ticks(played)
        if not self._ticks:
            self._waited = 0.0
        if due > played:
            self._playing = False
            self._hold_set_points(due - played)

    def _play_ticks(self, ticks: int) -> None:
        if not ticks:
            return
        played = []
        for _ in range(ticks):
            V_N, held = self._ticks.popleft()
            played.append(self.element.advance(V_N, held))
            self._held = held if held and held.motion.shape[1] == len(V_N) else None
        ends = np.concatenate(played, axis=1)
        readings, force = self.sensors.measure_ends(ends), self.element.force()
        head = Layout.SAMPLES.pack(
            self._played, ends.shape[1], min(self._missed, 2**32 - 1),
            float('nan') if force is None else force,
        )  # fmt: skip
        self._link.send(FrameKind.SAMPLES, head + readings.astype(self._hello.numbers).tobytes())
        self._played += ends.shape[1]
        self._missed = 0

    def _hold_set_points(self, ticks: int) -> None:
        """Hold the set-points while there is nothing to play; the element moves on."""
        if self._missed * self.element.dt < 50_000.0:  # by then the element has come to rest
            V_N = np.full(ticks * self._samples * len(self._hello.nodes), self.element.V_N)
            held = self._held
            if held is not None:
                place = np.full_like(V_N, held.motion[0, -1])
                held = HeldCell(held.site, np.stack((place, np.zeros_like(V_N))))
            self.element.advance(V_N, held)
        self._missed += ticks * self._samples


def _read_lead(payload: bytes) -> float:
    """Return the seconds by which the driver that sent a HELLO is ahead.

    Raises:
        DecodeError: It is no such HELLO.
    """
    greeting = parse_json(payload)
    if not isinstance(greeting, dict) or 'ahead' not in greeting:
        raise DecodeError(reason="the driver's hello must be an object with ahead")
    return float(
        decode_value(float, greeting['ahead'], 'ahead', Description('', low=0.0, high=1e9))
    )


@dataclass(frozen=True)
class LineProperties:
    """Properties of a line.

    Attributes:
        latency: Delay of every frame in seconds.
        jitter: Greatest additional random delay in seconds.
        loss: Probability that a frame is lost.
    """

    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0
    seed: int = 0


class _Wire:
    """One direction of a line: frames arrive late and in order, or never."""

    def __init__(self, line: LineProperties, rng: random.Random) -> None:
        self._line, self._rng = line, rng
        self._under_way: deque[tuple[float, bytes]] = deque()

    def push(self, data: bytes) -> None:
        """Put a frame on the line."""
        line, rng = self._line, self._rng
        if rng.random() < line.loss:
            return
        due = threads.monotonic() + line.latency + rng.uniform(0.0, line.jitter)
        last = self._under_way[-1][0] if self._under_way else 0.0
        self._under_way.append((max(last, due), data))

    def receive_frames(self, now: float) -> bytes:
        """Return what has arrived by a time."""
        come = []
        while self._under_way and self._under_way[0][0] <= now:
            come.append(self._under_way.popleft()[1])
        return b''.join(come)

    @property
    def due(self) -> float:
        """When the next frame arrives."""
        return self._under_way[0][0] if self._under_way else float('inf')


class RigServer:
    """Serves one rig to one client at a time."""

    def __init__(
        self, rig: EmulatedRig, line: LineProperties, host: str = '127.0.0.1', port: int = 0
    ):
        """Listen at an address for clients of a rig, whose element keeps its state from one to the
        next; port 0: any free one.

        Raises:
            OSError: The port is not free.
        """
        self._rig, self._line = rig, line
        self._rng = random.Random(line.seed)
        self._listener = socket.create_server((host, port))
        self.port: int = self._listener.getsockname()[1]
        self.clients = 0
        self._ended = False

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
                    self._serve_client(connection)

    def close(self) -> None:
        """Stop serving; any thread may call it."""
        self._ended = True

    def _serve_client(self, connection: socket.socket) -> None:
        inward, outward = _Wire(self._line, self._rng), _Wire(self._line, self._rng)
        rig, parser = self._rig, Parser()
        rig.begin(outward.push)
        last = threads.monotonic()
        while not self._ended:
            wait = min(
                0.002 if rig.playing else 0.02,
                min(inward.due, outward.due) - last,
            )
            if select.select([connection], [], [], max(0.0, wait))[0]:
                if not (data := connection.recv(1 << 16)):
                    return
                for frame in parser.feed(data):
                    inward.push(encode_frame(*frame))
            now = threads.monotonic()
            rig.take(inward.receive_frames(now))
            # beyond 10 ms the rig's clock waits for a slow machine
            rig.pass_time(min(now - last, max(0.0, wait) + 0.01))
            last = now
            if data := outward.receive_frames(now):
                connection.sendall(data)
