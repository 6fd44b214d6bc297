# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Devices of legal designs and settings, and the wildest legal commands."""

import legal

from mlmem import (
    Abort,
    Calibrate,
    Disturb,
    Erase,
    FollowTrajectory,
    Kick,
    MemoryElement,
    Read,
    SelfTest,
    SetFaults,
    SetStrain,
    SettingsError,
    Write,
)
from mlmem.instrument.faults import Faults
from mlmem.readers.calibration import Calibration, DelayTable


def device(random):
    """Return a device, or None if it is refused."""
    design = legal.design(random)
    table = DelayTable(tuple(level + 1.0 for level in range(design.levels)))
    try:
        return MemoryElement(design, legal.settings(random), Calibration(table, table))
    except SettingsError:  # a tick or a rest that would take too long
        return None


def strain(random, element):
    limit = element.settings.actuator.max_strain
    return random.choice((-limit, 0.0, limit, random.uniform(-limit, limit)))


def trajectory(random, element):
    times = sorted(legal.number(random, 0.0, 1e300) for _ in range(random.randint(1, 4)))
    rates = [legal.number(random, -1e300, 1e300) for _ in times if random.random() < 0.9]
    return FollowTrajectory(times, [strain(random, element) for _ in times], rates)


def faults(random, element):
    drawn = legal.values(random, Faults, 0.3)
    last = element.design.N
    cells = {'weak_cell': random.randint(0, last), 'stuck_cell': random.randint(0, last)}
    return SetFaults(Faults(**(drawn | cells)))


def command(random, element):
    """Return any command."""
    limit = element.settings.disturbance.max_acceleration
    return random.choice((
        lambda: SetStrain(strain(random, element)),
        lambda: trajectory(random, element),
        lambda: Disturb(random.choice((-limit, limit, random.uniform(-limit, limit)))),
        lambda: faults(random, element),
        lambda: Write(random.randrange(element.design.levels)),
        lambda: Read(random.choice(('', 'left', 'right', 'both'))),
        lambda: random.choice((Erase(), Calibrate(), SelfTest())),
        lambda: Kick(10.0 ** random.uniform(-4.0, 1.0)),
        lambda: Abort('enough'),
    ))()  # fmt: skip
