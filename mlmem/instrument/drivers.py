# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What an instrument requires of the element behind it, and drivers by name: the simulation, the
shipped one, and any installed one, which runs under a guard: it may hang and raise anything.

`docs/drivers.md` shows how to write one.
"""

from __future__ import annotations

import importlib
import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from dataclasses import MISSING, dataclass
from queue import SimpleQueue
from typing import Any, TypeVar

from .. import threads
from ..errors import DriverError, DriverHangs, ErrorCode, SettingsError
from ..physics import (
    Chain,
    Design,
    DesignError,
    HeldCell,
    Material,
    Specimen,
    StateError,
    as_specimen,
    default_step,
)
from ..physics.energy import end_force
from ..physics.equilibrium import make_blank
from ..physics.pefrl import NODES
from ..physics.values import Array
from ..schema import describe_field, make_printable, short_repr
from ..settings import Settings, TimeSettings


@dataclass(frozen=True)
class ChainState:
    """The state of a simulated material.

    Attributes:
        values: Displacement and velocity of every cell, then the same of an elastic substrate; see
            `Chain.state`.
        V_N: Displacement of the substrate's end, in cells.
        steps: Time steps that it has done.
    """

    values: Array
    V_N: float
    steps: int = describe_field(MISSING, 'steps done', low=0, high=2**62)


class Driver(ABC):
    """Strains an element, holds one of its ends, and measures both, sample by sample.

    The constructor opens it: the class is called with design, settings and `device.address`, and
    raises `DriverError` or `SettingsError` if that fails. It is opened, advanced and closed in its
    own thread (see `Watchdog`); its other methods are called while that thread waits.

    Only a simulation has a `chain`, which field, wall, views, state hashes, replay, restored
    content, material faults and a shaken base require.

    Attributes:
        dt: Time between samples, in time units; a tick has a whole number of samples.
        nodes: Times of the set-points in a sample, as increasing fractions of it, the last one 1.
            A real element takes one set-point at the end of each sample.
        lag: Ticks by which samples lag behind their set-points.
        strains: Whether it can strain the element; an actuator that is not there moves nothing.
        own_clock: Whether `advance` waits for its own clock, which then paces all ticks.
        interrupted: Whether sampling was interrupted within, or just before, the samples that
            `advance` returned last: an echo cannot be measured across a break.
        V_N: The last set-point of the substrate's end displacement.
        chain: The simulated material, or None for a real one.
        state: The state of the simulated material; None for a real one, which keeps its own.
    """

    dt: float
    nodes: tuple[float, ...] = (1.0,)
    lag: int = 0
    strains: bool = True
    own_clock: bool = False
    interrupted: bool = False
    V_N: float = 0.0
    chain: Chain | None = None
    state: ChainState | None = None

    @abstractmethod
    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Apply the set-points of whole ticks, and return their samples.

        All lengths are in cells. `lag` ticks lie between a set-point and its sample; the first
        samples are those of an element at rest.

        Args:
            V_N: Displacement of the substrate's end, shape (n nodes,) for n samples.
            held_cell: An end cell that is held for the first set-points, then released.
            shake: Acceleration of the base; a real element ignores it.
            ticks: Number of ticks.

        Returns:
            Displacements of the first and the last cell after every sample, shape (2, n).

        Raises:
            DriverError: The element cannot be reached, or returns impossible values.
            StateError: The simulated material cannot continue; it is unchanged.
        """

    def at_rest(self, V_N: float) -> bool:
        """Return whether nothing changes while the substrate's end stays at a displacement.

        It is asked while nothing else moves the element. If it rests, `pass_by` is called for
        ticks instead of `advance`.
        """
        return False

    def pass_by(self, steps: int) -> None:  # noqa: B027
        """Let the time of some samples pass for an element that rests."""

    @abstractmethod
    def end(self, site: int) -> float:
        """Return the last known displacement of an end: site 1 or N."""

    def force(self) -> float | None:
        """Return the force on the substrate's end in k_r cells, or None if it is not measured."""
        return None

    def health(self) -> dict[str, float | str]:
        """Return values for diagnostics, by name."""
        return {}

    def close(self) -> None:  # noqa: B027
        """Release the element, with zero strain; it may be called twice."""


MAX_CELL_STEPS = 10**8
"""Most cell steps of a tick, with at least a thousand cells: about a quarter of a second."""


def steps_per_tick(material: Material, time: TimeSettings) -> int:
    """Return the least number of steps of a tick that is accurate and stable.

    Raises:
        SettingsError: The tick needs more than `MAX_CELL_STEPS`.
    """
    made = as_specimen(material)
    dt = default_step(made)
    steps, most = math.ceil(time.tick / dt), MAX_CELL_STEPS // max(made.design.N, 1000)
    if steps > most:
        raise SettingsError(
            ErrorCode.CONFLICT, 'time.tick', time.tick,
            f'at most {most * dt:.4g}, which is {most} steps of this design',
        )  # fmt: skip
    return steps


class Simulation(Driver):
    """A chain in place of a real element; each step is a sample."""

    chain: Chain
    nodes = NODES

    def __init__(self, chain: Chain) -> None:
        self.chain = chain
        self.dt = chain.dt

    @classmethod
    def build_blank(cls, material: Material, time: TimeSettings, finer: int = 1) -> Simulation:
        """Return the driver of a blank element at rest, exactly as designed if a design is given.

        Args:
            time: Length of a tick.
            finer: By how much its steps are shorter than they need to be.

        Raises:
            SettingsError: A tick needs too many steps.
            DesignError: The step is beyond the stability limit.
            StateError: Its ground states are scattered so much that nothing rests in them.
        """
        dt = time.tick / (finer * steps_per_tick(material, time))
        chain = Chain(material, dt)
        if not isinstance(material, Design):
            chain.place(make_blank(material))
        return cls(chain)

    @property
    def state(self) -> ChainState:
        """The state of the chain."""
        return ChainState(self.chain.state(), self.chain.V_N, self.chain.steps_done)

    @state.setter
    def state(self, state: ChainState) -> None:
        self.chain.restore(state.values, V_N=state.V_N, steps_done=state.steps)

    @property
    def V_N(self) -> float:  # type: ignore[override]
        """Displacement of the substrate's end."""
        return self.chain.V_N

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Advance the chain; see `Chain.advance`."""
        return self.chain.advance(V_N, held_cell, shake, ticks)

    def at_rest(self, V_N: float) -> bool:
        """Return whether the chain is at rest at a displacement of the substrate's end."""
        return V_N == self.chain.V_N and self.chain.at_rest

    def pass_by(self, steps: int) -> None:
        """Let the clock of the chain go on."""
        self.chain.pass_by(steps)

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        return self.chain.end(site)

    def force(self) -> float:
        """Return the force of the actuator."""
        return float(end_force(self.chain, self.chain.v, self.chain.V))


SIMULATION_NAME = 'sim'

SHIPPED_DRIVERS = {'rig': 'mlmem_ros.rig:Rig'}


def open_driver(
    name: str, address: str, design: Design, settings: Settings, made: Specimen | None = None
) -> Driver:
    """Open and return the driver of an element.

    Args:
        name: 'sim', a name of `SHIPPED_DRIVERS`, or 'package.module:Class'.
        address: Where the element is, as its driver understands it.
        settings: The instrument's settings.
        made: What a simulated element is; by default exactly as designed. Other drivers ignore it.

    Raises:
        SettingsError: There is no such driver, or it does not fit these settings.
        DriverError: The element cannot be reached.
        DesignError: The step of a simulation is beyond the stability limit.
    """
    if name == SIMULATION_NAME:
        if address:
            raise SettingsError(
                ErrorCode.CONFLICT, 'device.address', address, 'empty for a simulated element'
            )
        return Simulation.build_blank(made or design, settings.time)
    make = load_driver_class(name)
    return Watchdog(name, lambda: make(design, settings, address), settings.scale.time)


def load_driver_class(name: str) -> Callable[[Design, Settings, str], Driver]:
    """Return the class of a driver.

    Raises:
        SettingsError: There is none of that name; the message says what was found.
    """
    module, colon, kind = SHIPPED_DRIVERS.get(name, name).partition(':')
    if not (colon and module and kind):
        known = ', '.join((SIMULATION_NAME, *SHIPPED_DRIVERS))
        expected = f'{known} or package.module:Class'
        raise SettingsError.out_of_range('device.driver', name, expected)
    try:
        found = getattr(importlib.import_module(module), kind)
    except AttributeError:
        expected = f'one of the classes in {module}'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'device.driver', name, expected) from None
    except (Exception, SystemExit) as error:  # the module may raise anything
        why = f'{module} cannot be imported: {make_printable(repr(error), 300)}'
        raise SettingsError(ErrorCode.UNREADABLE, 'device.driver', name, reason=why) from error
    if not (isinstance(found, type) and issubclass(found, Driver)):
        expected = f'a subclass of mlmem.Driver, and not {short_repr(repr(found), 100)}'
        raise SettingsError(ErrorCode.UNSUPPORTED, 'device.driver', name, expected)
    return found


T = TypeVar('T')


class Watchdog(Driver):
    """Runs a driver in a thread of its own, which is abandoned if it hangs.

    What a driver raises, even SystemExit, is a `DriverError` here.
    """

    def __init__(
        self, name: str, make: Callable[[], Driver], seconds: float, timeout: float = 10.0
    ) -> None:
        """Open a driver by calling `make`; its name is for messages.

        A time unit takes `seconds`. A call may take `timeout` seconds longer than it plays.

        Raises:
            DriverError: It hangs, or raises something unexpected.
            SettingsError, DesignError, StateError: As `make` raises.
        """
        self._name, self._seconds, self._timeout = name, seconds, timeout
        self._work: SimpleQueue[tuple[Future[Any], Callable[[], Any]] | None] = SimpleQueue()
        self._hangs = self._closed = False
        threads.Thread(target=self._run_calls, name='mlmem-driver', daemon=True).start()
        try:
            self.driver = self._call_driver('opening', make)
        except BaseException:
            self._work.put(None)
            raise
        self.dt, self.nodes, self.lag = self.driver.dt, self.driver.nodes, self.driver.lag
        self.strains, self.own_clock = self.driver.strains, self.driver.own_clock

    @property
    def V_N(self) -> float:  # type: ignore[override]
        """The driver's last set-point."""
        return self.driver.V_N

    @property
    def interrupted(self) -> bool:  # type: ignore[override]
        """Whether the driver was interrupted."""
        return self.driver.interrupted

    def advance(
        self,
        V_N: Array,
        held_cell: HeldCell | None = None,
        shake: Array | None = None,
        ticks: int = 1,
    ) -> Array:
        """Return the samples of the driver; raises `DriverError` if it takes too long."""
        playing = len(V_N) / len(self.nodes) * self.dt * self._seconds
        return self._call_driver(
            'playing', lambda: self.driver.advance(V_N, held_cell, shake, ticks), playing
        )

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        with self._translate_errors('measuring'):
            return self.driver.end(site)

    def force(self) -> float | None:
        """Return the force, if it is measured."""
        with self._translate_errors('measuring'):
            return self.driver.force()

    def health(self) -> dict[str, float | str]:
        """Return the driver's values for diagnostics."""
        with self._translate_errors('reporting'):
            return self.driver.health()

    def close(self) -> None:
        """Close the driver, unless it hangs."""
        if not (self._closed or self._hangs):
            self._closed = True
            self._call_driver('closing', self.driver.close)
            self._work.put(None)

    def _call_driver(self, what: str, work: Callable[[], T], more: float = 0.0) -> T:
        if self._hangs:
            raise DriverHangs(f'the driver {self._name} hangs')
        answer: Future[T] = Future()
        self._work.put((answer, work))
        parts = 10  # a host that is held up loses one of them, not the whole time-out
        for _ in range(parts):
            if wait([answer], (self._timeout + more) / parts).done:
                break
        else:
            self._hangs = True
            raise DriverHangs(
                f'the driver {self._name} hangs: {what} takes longer than {self._timeout:g} s'
            )
        with self._translate_errors(what):
            return answer.result()

    @contextmanager
    def _translate_errors(self, what: str) -> Iterator[None]:
        try:
            yield
        except (DriverError, SettingsError, DesignError, StateError):
            raise
        except BaseException as error:  # whatever it is, it must not end our thread
            raise DriverError(
                f'the driver {self._name} has failed while {what}: '
                f'{make_printable(repr(error), 300)}'
            ) from error

    def _run_calls(self) -> None:
        while (call := self._work.get()) is not None:
            answer, work = call
            try:
                answer.set_result(work())
            except BaseException as error:
                answer.set_exception(error)
