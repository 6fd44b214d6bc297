# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Drivers by name: the simulation, the shipped driver, and any installed one."""

from __future__ import annotations

import importlib
from collections.abc import Callable

from ..clipped import clipped, printable
from ..physics import Design, Specimen
from .driver import Driver
from .errors import SettingsError
from .settings import Settings
from .simulation import Simulation

SIMULATION = 'sim'

SHIPPED = {'rig': 'mlmem_ros.rig:Rig'}


def opened(
    name: str, address: str, design: Design, settings: Settings, made: Specimen | None = None
) -> Driver:
    """Open and return the driver of an element.

    Args:
        name: 'sim', a name of `SHIPPED`, or 'package.module:Class'.
        address: Where the element is, as its driver understands it.
        design: The element.
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
    from .watched import Watched  # a simulation needs none of it

    return Watched(name, lambda: make(design, settings, address), settings.scale.time)


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
