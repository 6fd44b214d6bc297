# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The true wall, which only the experimenter may see: where it is, and whether the device is
right.
"""

import math
from functools import cache

from mlmem import Disturb, Faults, Outcome, Refused, SetFaults, SetStrain
from mlmem.commands import FollowTrajectory
from mlmem.physics import find_level, find_walls
from mlmem.procedure_table import PROCEDURES, Procedures

SETTLING_TIME = 1000.0
"""Time after which nothing moves any more of what was set going."""

_list_faults = cache(Faults.list_active)  # computed once, not every tick
_MOVING_COMMANDS = (Procedures, SetStrain, FollowTrajectory, Disturb, SetFaults)


def may_move(command):
    """Return whether the wall may move after a command was accepted; listening moves none."""
    listens = any(type(command) is row.command and not row.changes for row in PROCEDURES.values())
    return isinstance(command, _MOVING_COMMANDS) and not listens


class Truth:
    """Watches the wall of a device, tick by tick.

    Attributes:
        asked: Commands so far that may move the wall.
        waiting: Those of them without an answer.
        ticks: Ticks that the device has run.
    """

    def __init__(self, find):
        """Start without knowledge.

        Args:
            find: Called with each finding.
        """
        self.asked = 0
        self.waiting = 0
        self.ticks = 0
        self._find_node = find
        self._still = None  # where the walls are, while they have to stay there
        self._moved_at = -math.inf  # tick of the last motion

    def check_tick(self, element, events):
        """Check the true wall, in the loop's thread."""
        self.ticks = element.ticks
        if self.waiting or not (element.is_released and _is_undisturbed(element)):
            self.assume_motion(element)
        elif self._still is None:
            if _time_since(element, self._moved_at) > SETTLING_TIME:
                self._still = _find_wall_cells(element)
        elif (seen := _find_wall_cells(element)) != self._still:
            self._find_node(f'the wall moved by itself from {self._still} to {seen}')
            self._still = seen
        for event in events:
            if isinstance(event, Outcome) and event.success and event.reading:
                self._check_reading(element, event)

    def _check_reading(self, element, outcome):
        """Compare the outcome of a procedure with the truth."""
        calm = _time_since(element, self._moved_at) > SETTLING_TIME or outcome.procedure == 'write'
        if calm and _is_undisturbed(element) and outcome.procedure in ('write', 'read'):
            truth = find_level(element.design, element.chain.configuration)
            if truth != outcome.reading.level:
                self._find_node(f'{outcome} while the wall is at {truth}')

    def assume_motion(self, element):
        """Assume that the wall may move; after the end of a device, that it has moved."""
        self._still = None
        if element is not None:
            self._moved_at = element.ticks

    def watch_refusals(self, element):
        """Check that a refused command leaves a device unchanged."""
        apply = element.apply

        def watched(command):
            before = _collect_state(element)
            try:
                return apply(command)
            except Refused:
                if (after := _collect_state(element)) != before:
                    self._find_node(f'{command} was refused and changed {before} to {after}')
                raise

        element.apply = watched


def _time_since(element, tick):
    return (element.ticks - tick) * element.tick


def _find_wall_cells(element):
    found = find_walls(element.design, element.chain.configuration)
    return [(round(wall.position / element.design.J), wall.anti_kink) for wall in found]


def _is_undisturbed(element):
    """Return whether the device is healthy and its base and strain are zero."""
    transmission = element.transmission.state
    strains = (transmission.commanded, transmission.strain)
    return not _list_faults(element.faults) and element.base.is_still and not any(strains)


def _collect_state(element):
    """Return what a command could change at once."""
    actuator = element.actuator
    return (
        actuator.strain, actuator.elapsed, actuator.motion, element.procedure, element.reading,
        element.calibration, element.faults, element.base.state, element.ticks,
    )  # fmt: skip
