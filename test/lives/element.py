# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The element of the lives: two levels and strong damping, so that a write takes some 40 ticks."""

import math
from functools import cache

from mlmem_ros.device import Faults, MemoryElement, Settings, Write, factory, preset, snapshot
from mlmem_ros.host.settings import (
    FileSettings,
    Parameters,
    PublishSettings,
    RecordSettings,
    StateSettings,
)
from mlmem_ros.physics import Design

DESIGN = Design(
    N=81, gamma=-3e-5, beta=-1 / 20, J=9, J_s=18, j_0=6.84, d=0.0380, eta=1 / 80, tail=54
)

_FASTER = {
    'write': {'final_settle': 300.0},
    'erase': {'settle': 300.0},
    'read': {'rest': 50.0},
    'probe_right': {'gain_decay': DESIGN.eta / 2},
    'time': {'tick': 50.0},
    'scale': {'time': 2e-3},  # a tick is 0.1 s: a second costs 10 of them
}


def _settings():
    _, schedule = preset('bits_1')
    given = schedule.as_dict()
    for group, values in _FASTER.items():
        given[group] |= values
    return Settings.from_dict(given)


SETTINGS = _settings()
CALIBRATION = factory.factory_calibration(DESIGN, SETTINGS)

TICK_SECONDS = SETTINGS.time.tick * SETTINGS.scale.time
PUBLISH = PublishSettings(4, 4, 4, 8, 40, 8)


def parameters(*, record='', state='', interval=0.0, sync_interval=0.2, hash_every=20):
    """Return all parameters of a host."""
    return Parameters(
        design=DESIGN,
        check='skip',
        settings=SETTINGS,
        publish=PUBLISH,
        record=RecordSettings(record, sync_interval=sync_interval, hash_every=hash_every),
        state=StateSettings(state, interval),
        faults=Faults(),
        files=FileSettings(),
    )


@cache
def written(level):
    """Return the snapshot of an element on which a level was written, or of a blank one."""
    element = MemoryElement(DESIGN, SETTINGS, CALIBRATION)
    if level >= 0:
        element.apply(Write(level))
        while not element.released:
            element.advance()
        assert element.reading.level == level
    return snapshot.take(element)


def restored(taken):
    """Return a new element in the state of a snapshot."""
    element = MemoryElement(DESIGN, SETTINGS, CALIBRATION)
    snapshot.restore(element, taken)
    return element


def finite(element):
    """Return whether the state of the material is finite."""
    chain = element.chain
    return math.isfinite(float(chain.state().sum())) and math.isfinite(chain.V_N)


@cache
def healthy(faults):
    """Return whether a device has no faults."""
    return not faults.active()
