# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The element and the events of a run: steps of several clients, the disk and fate, from one
number.

Most elements have two levels and strong damping, so that a write takes some 40 ticks; else they
are shipped ones of up to 32 levels.
"""

import math
from dataclasses import dataclass, replace
from functools import cache, cached_property
from random import Random

from mlmem import (
    Abort,
    Calibrate,
    Disturb,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Locate,
    MemoryElement,
    Read,
    Reset,
    SelfTest,
    SetFaults,
    SetStrain,
    Settings,
    Write,
    factory_calibration,
    load_element,
    snapshot,
)
from mlmem.physics import Design

DISK_PATH = '/disk'
STATE_PATH = '/disk/state/memory.json'
SESSION_PATH = '/disk/session'


@dataclass(frozen=True)
class ElementKind:
    """A design with the settings of its instrument."""

    design: Design
    settings: Settings

    @cached_property
    def calibration(self):
        """Its factory calibration."""
        return factory_calibration(self.design, self.settings)

    @cache  # noqa: B019 (there are five)
    def make_snapshot(self, level):
        """Return the snapshot of an element on which a level was written, or of a blank one."""
        element = MemoryElement(self.design, self.settings, self.calibration)
        if level >= 0:
            assert element.perform(Write(level)).reading.level == level
        return snapshot.take_snapshot(element)

    def restore_element(self, taken):
        """Return a new element in the state of a snapshot."""
        element = MemoryElement(self.design, self.settings, self.calibration)
        snapshot.restore_snapshot(element, taken)
        return element


def _make_quick_kind():
    """Return an element that is written within seconds of its run: a tick is 0.1 s."""
    design, settings = load_element('bits_1').design_and_settings
    changes = {
        'write': {'final_settle': 300.0}, 'erase': {'settle': 300.0}, 'read': {'rest': 50.0},
        'probe_right': {'gain_decay': 1 / 160}, 'time': {'tick': 50.0}, 'scale': {'time': 2e-3},
    }  # fmt: skip
    groups = {name: replace(getattr(settings, name), **given) for name, given in changes.items()}
    return ElementKind(replace(design, eta=1 / 80), replace(settings, **groups))


def _load_shipped_kind(name):
    """Return a preset at a pace of twenty ticks a second: a write takes 15 to 25 of them."""
    design, settings = load_element(name).design_and_settings
    scale = replace(settings.scale, time=0.05 / settings.time.tick)
    return ElementKind(design, replace(settings, scale=scale))


ELEMENT_KINDS = {
    kind.design.levels: kind
    for kind in (_make_quick_kind(), *map(_load_shipped_kind, ('bits_2', 'case_2', 'bits_4')))
}
"""The elements, by the number of their levels."""


@dataclass(frozen=True)
class Step:
    """One event.

    Attributes:
        after: Seconds since the previous step.
        given: Its arguments.
    """

    after: float
    what: str
    given: object = None


@dataclass(frozen=True)
class Script:
    """The plan of a run.

    Attributes:
        level: Level that the element held before; -1: blank.
        record: Whether a recording begins with every activation.
        interval: Seconds between two saves; 0: none.
        sync_interval: Seconds after which a recording is synced.
    """

    levels: int
    level: int
    state: bool
    record: bool
    interval: float
    sync_interval: float
    steps: tuple[Step, ...]


GOOD_COMMANDS = (
    lambda chance: Write(chance.randrange(chance.levels)),
    lambda chance: Write(chance.randrange(chance.levels)),
    lambda chance: Read(chance.choice(('', 'right'))),
    lambda chance: Read(),
    lambda chance: Erase(),
    lambda chance: Abort(chance.choice(('', 'enough'))),
    lambda chance: Abort(),
    lambda chance: SetStrain(chance.choice((0.0, 0.0, 0.001, -0.01, 0.03))),
    lambda chance: FollowTrajectory((0.0, 0.3, 0.6), (0.0, chance.choice((1e-3, 5e-3)), 0.0)),
    lambda chance: Disturb(chance.choice((0.0, 1e-5, -1e-3))),
)

RARE_COMMANDS = (
    lambda chance: Calibrate(),
    lambda chance: SelfTest(),
    lambda chance: Locate(),
    lambda chance: Kick(chance.choice((0.02, 0.3, 9.0))),
    lambda chance: Reset(),
    lambda chance: SetFaults(Faults()),
    lambda chance: SetFaults(Faults(sensor_noise=1e-6, seed=chance.randrange(100))),
    lambda chance: SetFaults(Faults(sensor_dropout=0.2, actuator_lag=20.0)),
    lambda chance: SetFaults(Faults(actuator_stuck=True)),
    lambda chance: SetFaults(Faults(stuck_cell=12, weak_cell=3, missed_cycle=0.5)),
    lambda chance: SetFaults(Faults(actuator_offset=0.03, damping_factor=0.1)),
)

BAD_COMMANDS = (
    lambda chance: Write(chance.choice((chance.levels, -1, 255, True, 0.0, '1', None, math.nan))),
    lambda chance: Read(chance.choice(('up', None, 3))),
    lambda chance: SetStrain(chance.choice((1.0, math.nan, math.inf, True, '0', None))),
    lambda chance: Disturb(chance.choice((1.0, math.nan, -math.inf, True, 'x', None))),
    lambda chance: FollowTrajectory((0.0, math.nan), (0.0, 0.0)),
    lambda chance: FollowTrajectory((0.0, 1.0), (0.0, 1.0)),
    lambda chance: FollowTrajectory((), ()),
    lambda chance: FollowTrajectory((0.0, 1e300), (0.0, 1e-3)),
    lambda chance: FollowTrajectory((0.0, 1.0), (0.0,), joint='elbow'),
    lambda chance: SetFaults(Faults(stuck_cell=ELEMENT_KINDS[chance.levels].design.N)),
    lambda chance: SetFaults(Faults(weak_cell=90_000)),
    lambda chance: chance.choice((None, 'write', 7, Write)),
)

STEP_WEIGHTS = {
    'good': 30, 'rare': 4, 'bad': 8, 'patience': 8, 'record': 14, 'time': 14, 'transition': 8,
    'disk': 7, 'crash': 3, 'many': 4, 'break': 2,
}  # fmt: skip
"""How often steps of each kind come."""

TRANSITION_NAMES = ('configure', 'activate', 'deactivate', 'cleanup', 'shutdown')
DISK_TROUBLES = ('full', 'fails', 'hangs', 'moody', 'moody')


def make_script(seed):
    """Return the run with this number."""
    chance = Random(f'script {seed}')
    chance.levels = Random(f'element {seed}').choice((2,) * 35 + tuple(ELEMENT_KINDS))
    steps = []
    if chance.random() < 0.95:
        steps += [Step(0.0, 'configure'), Step(0.0, 'activate')]
    for _ in range(chance.choice((3, 6, 6, 12, 12, 25))):
        steps += _make_steps(chance)
    return Script(
        levels=chance.levels,
        level=chance.choice((-1, 0, chance.levels - 1)),
        state=chance.random() < 0.7,
        record=chance.random() < 0.15,
        interval=chance.choice((0.0, 0.0, 0.3, 2.0)),
        sync_interval=chance.choice((0.0, 0.2, 0.2, 0.5, 0.5, 1.0, 1.0)),
        steps=tuple(steps),
    )


def _make_steps(chance):
    """Return some steps that belong together."""
    after = chance.choice((0.0, 0.0, 0.0, 0.001, 0.05, 0.05, 0.3, 1.5))
    match chance.choices(tuple(STEP_WEIGHTS), tuple(STEP_WEIGHTS.values()))[0]:
        case 'good':
            return [Step(after, 'submit', chance.choice(GOOD_COMMANDS)(chance))]
        case 'rare':
            return [Step(after, 'submit', chance.choice(RARE_COMMANDS)(chance))]
        case 'bad':
            return [Step(after, 'submit', chance.choice(BAD_COMMANDS)(chance))]
        case 'patience':  # a write, and the time it takes
            write = Step(after, 'submit', Write(chance.randrange(chance.levels)))
            patience = chance.choice((6.0, 12.0))
            if chance.levels == 2:
                return [write, Step(patience, 'submit', Read())]
            ends = [chance.choice(('', 'left', 'right', 'both')) for _ in range(4)]
            return [write, *[Step(3.0 * patience, 'submit', Read(end)) for end in ends]]
        case 'record':
            on = chance.random() < 0.6
            return [Step(after, 'record', on)] * chance.choice((1, 1, 1, 2, 3))
        case 'time':
            return [_make_time_step(chance, after)]
        case 'transition':
            if chance.random() < 0.2:  # an end while single ticks wait
                held = Step(after, 'pause', True)
                return [held, *[Step(0.0, 'step')] * 3, Step(0.0, 'deactivate')]
            if chance.random() < 0.5:  # what makes sense, in a row
                rows = (('deactivate', 'activate'), ('deactivate', 'cleanup', 'configure'))
                return [Step(after, name) for name in chance.choice(rows)]
            return [Step(after, chance.choice(TRANSITION_NAMES))]
        case 'disk':
            heal = Step(chance.choice((0.01, 0.5, 4.0)), 'heal')
            ends = chance.random() < 0.8
            trouble = Step(after, 'trouble', chance.choice(DISK_TROUBLES))
            return [trouble, *_make_steps(chance), *([heal] if ends else [])]
        case 'crash':
            kind = chance.choice(('kill', 'power'))
            counted, most = chance.choice((('hand-overs', 400), ('calls', 16)))
            crash = Step(after, 'crash', (kind, counted, chance.randint(1, most)))
            return [crash, Step(0.0, 'configure'), Step(0.0, 'activate')]
        case 'break':  # the material stops being finite, in one tick or from now on
            fails = Step(after, 'break', chance.choice(('once', 'for good')))
            return [fails, Step(0.2, 'configure'), Step(0.0, 'activate')]
        case 'many':  # clients who ask for the same at once
            return _make_steps(chance)[:1] * chance.choice((2, 5))
    raise AssertionError('every kind has its steps')


def _make_time_step(chance, after):
    what = chance.choice(('pause', 'pause', 'step', 'step', 'speed', 'clock', 'cancel'))
    match what:
        case 'pause':
            return Step(after, 'pause', chance.random() < 0.6)
        case 'speed':
            return Step(after, 'speed', chance.choice((0.0, 1.0, 1.0, 0.5, 10.0, 1e6)))
        case 'clock':
            return Step(after, 'clock', chance.choice((-100.0, -0.1, 0.2, 1000.0, 'stop', 'go')))
    return Step(after, what)
