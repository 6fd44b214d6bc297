# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drivers by name: the simulation, the shipped driver, and any installed one, which runs under a
guard: it may hang and raise anything.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from .. import threads
from ..described import clipped, printable
from ..physics import Design, DesignError, HeldCell, Specimen, StateError
from ..physics.potential import Array
from .driver import Driver, Simulation
from .errors import DriverError, DriverHangs, SettingsError
from .settings import Settings

SIMULATION = 'sim'

SHIPPED = {'rig': 'mlmem_ros.rig:Rig'}


def opened(
    name: str, address: str, design: Design, settings: Settings, made: Specimen | None = None
) -> Driver:
    """Open and return the driver of an element.

    Args:
        name: 'sim', a name of `SHIPPED`, or 'package.module:Class'.
        address: Where the element is, as its driver understands it.
        settings: The instrument's settings.
        made: What a simulated element is; by default exactly as designed.

    Raises:
        SettingsError: There is no such driver, or it does not fit these settings.
        DriverError: The element cannot be reached.
        DesignError: The step of a simulation is beyond the stability limit.
    """
    if name == SIMULATION:
        if address:
            raise SettingsError(
                f'device.address must be empty for a simulated element; got {clipped(address)}'
            )
        return Simulation.of(made or design, settings.time)
    if made is not None:
        raise SettingsError(f'device.specimen needs device.driver {SIMULATION}; got {name}')
    make = loaded(name)

    return Watchdog(name, lambda: make(design, settings, address), settings.scale.time)


def loaded(name: str) -> Callable[[Design, Settings, str], Driver]:
    """Return the class of a driver.

    Raises:
        SettingsError: There is none of that name; the message says what was found.
    """
    module, colon, kind = SHIPPED.get(name, name).partition(':')
    if not (colon and module and kind):
        known = ', '.join((SIMULATION, *SHIPPED))
        raise SettingsError(
            f'device.driver must be {known} or package.module:Class; got {clipped(name)}'
        )
    try:
        found = getattr(importlib.import_module(module), kind)
    except AttributeError:
        raise SettingsError(f'device.driver {name}: {module} has no {kind}') from None
    except (Exception, SystemExit) as error:  # the module may raise anything
        why = printable(repr(error), 300)
        raise SettingsError(f'device.driver {name}: {module} cannot be imported: {why}') from error
    if not (isinstance(found, type) and issubclass(found, Driver)):
        raise SettingsError(
            f'device.driver {name}: {kind} must be a subclass of mlmem_ros.device.Driver; '
            f'got {clipped(repr(found), 100)}'
        )
    return found


T = TypeVar('T')

PATIENCE = 10.0
"""Seconds after which a call to a driver times out."""

LOOKS = 10
"""Waits that make up a time-out: a host that is held up loses one of them, not all."""


EXPECTED = (DriverError, SettingsError, DesignError, StateError)
"""What a driver may raise. Anything else becomes a `DriverError` that names it."""


class Watchdog(Driver):
    """Runs a driver in a thread of its own, which is abandoned if it hangs.

    What a driver raises, even SystemExit, is a `DriverError` here.
    """

    def __init__(
        self, name: str, make: Callable[[], Driver], seconds: float, patience: float = PATIENCE
    ) -> None:
        """Open a driver by calling `make`; its name is for messages.

        A time unit takes `seconds`. A call may take `patience` seconds longer than it plays.

        Raises:
            DriverError: It hangs, or raises something unexpected.
            One of `EXPECTED`: As `make` raises.
        """
        self._name, self._seconds, self._patience = name, seconds, patience
        self._work: SimpleQueue[Callable[[], Any] | None] = SimpleQueue()
        self._done: SimpleQueue[tuple[Any, BaseException | None]] = SimpleQueue()
        self._hangs = self._closed = False
        threads.Thread(target=self._run, name='mlmem-driver', daemon=True).start()
        try:
            self.driver = self._asked('opening', make)
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
        looks: int = 1,
    ) -> Array:
        """Return the samples of the driver; raises `DriverError` if it takes too long."""
        playing = len(V_N) / len(self.nodes) * self.dt * self._seconds
        return self._asked(
            'playing', lambda: self.driver.advance(V_N, held_cell, shake, looks), playing
        )

    def end(self, site: int) -> float:
        """Return the displacement of an end."""
        with self._guarded('measuring'):
            return self.driver.end(site)

    def force(self) -> float | None:
        """Return the force, if it is measured."""
        with self._guarded('measuring'):
            return self.driver.force()

    def health(self) -> dict[str, float | str]:
        """Return the driver's values for diagnostics."""
        with self._guarded('reporting'):
            return self.driver.health()

    def close(self) -> None:
        """Close the driver, unless it hangs."""
        if not (self._closed or self._hangs):
            self._closed = True
            self._asked('closing', self.driver.close)
            self._work.put(None)

    def _asked(self, what: str, work: Callable[[], T], more: float = 0.0) -> T:
        if self._hangs:
            raise DriverHangs(f'the driver {self._name} hangs')
        self._work.put(work)
        for _ in range(LOOKS):
            with suppress(Empty):
                value, error = self._done.get(timeout=(self._patience + more) / LOOKS)
                break
        else:
            self._hangs = True
            raise DriverHangs(
                f'the driver {self._name} hangs: {what} takes longer than {self._patience:g} s'
            )
        with self._guarded(what):
            if error is not None:
                raise error
        result: T = value
        return result

    @contextmanager
    def _guarded(self, what: str) -> Iterator[None]:
        try:
            yield
        except EXPECTED:
            raise
        except BaseException as error:  # whatever it is, it must not end our thread
            raise DriverError(
                f'the driver {self._name} has failed while {what}: {printable(repr(error), 300)}'
            ) from error

    def _run(self) -> None:
        while (work := self._work.get()) is not None:
            try:
                self._done.put((work(), None))
            except BaseException as error:
                self._done.put((None, error))
