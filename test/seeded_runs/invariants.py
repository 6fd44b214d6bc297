# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Conditions that must hold throughout every run, and of all that it leaves on the disk."""

import math
import os
import traceback
from concurrent.futures import Future
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import NoneType
from unittest.mock import patch

from mlmem import Disturb, Faults, Outcome, Refused, SetFaults, SetStrain, atomic_files
from mlmem.commands import FollowTrajectory
from mlmem.physics import find_level, find_walls
from mlmem.procedure_table import PROCEDURES, Procedures
from mlmem_ros.bag.contents import read_metadata
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.reader import BagReader
from mlmem_ros.host import REFUSALS, store
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay

from .script import DISK_PATH, STATE_PATH

DISK_TIMEOUT_S = 2.0
"""Seconds that the host waits for a disk in these runs."""

PROMPT_ANSWER_S = 1.0
"""Seconds within which whatever needs no disk is answered."""

SLOW_ANSWER_S = 5.0 * DISK_TIMEOUT_S + 3.0
"""Seconds within which whatever needs a disk is answered, be it that it does not answer."""

SLOW_CALLBACKS = ('configure', 'activate', 'deactivate', 'cleanup', 'close', 'failure')

SETTLING_TIME = 1000.0
"""Time after which nothing moves any more of what was set going."""

_list_faults = cache(Faults.list_active)  # computed once, not every tick
_MOVING_COMMANDS = (Procedures, SetStrain, FollowTrajectory, Disturb, SetFaults)


def may_move(command):
    """Return whether the wall may move after a command was accepted; listening moves none."""
    listens = any(type(command) is row.command and not row.changes for row in PROCEDURES.values())
    return isinstance(command, _MOVING_COMMANDS) and not listens


class Truth:
    """Watches the wall of a device, tick by tick, which only the experimenter may see.

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


@dataclass
class Ticket:
    """A pending request.

    Attributes:
        what: A command, or the name of a request.
        future: Its answer.
        asked: Time of the request, in seconds.
        moves: Whether it may move the wall once it is accepted.
        number: Number of such requests so far, including this one.
    """

    what: object
    future: Future
    asked: float
    moves: bool
    number: int

    def __str__(self):
        return f'{self.what!r:.80} asked at {self.asked:.3f}'


class Invariants:
    """Watch a run and collect findings.

    Attributes:
        found: The findings, in words.
        broken: Whether the device was made to fail.
        truth: What they know about the wall.
    """

    def __init__(self, run):
        self.found = []
        self.broken = False
        self.truth = Truth(self.report)
        self._run = run
        self._acknowledged = None  # ticks, level and movers of the last one that was saved
        self._closed_bags = set()

    def report(self, what):
        """Record a finding."""
        self.found.append(what)
        self._run.scheduler.add_note(f'FOUND {what}')

    # --- where the host logs -------------------------------------------------------------

    def write_line(self, severity, message):
        self._run.scheduler.add_note(('log', message))
        if severity != 'ERROR':
            return
        if 'fault in the software' in message or (
            'device has stopped' in message and not self.broken
        ):
            self.report(message)
        if 'its content is saved' in message and self._run.script.state:
            self._acknowledged = self._run.element.ticks, None, None

    # --- requests ------------------------------------------------------------------------

    def watch_request(self, process, what, future):
        """Watch a request."""
        moves = may_move(what)
        self.truth.asked += moves
        self.truth.waiting += moves
        ticket = Ticket(what, future, self._now, moves, self.truth.asked)
        future.add_done_callback(lambda _: self._check_answer(process, ticket))
        return ticket

    def _check_answer(self, process, ticket):
        if ticket.moves:
            self.truth.waiting -= 1
        if ticket.future.cancelled():
            return
        error = ticket.future.exception()
        self._run.scheduler.add_note(('answer', str(ticket), error or ticket.future.result()))
        if not isinstance(error, (*REFUSALS, NoneType)):
            self.report(f'{ticket} was answered with {describe_error(error)}')
            return
        if ticket.moves and not isinstance(error, Refused):
            self.truth.assume_motion(process.host.element)
        if isinstance(ticket.what, tuple):
            self._check_service(ticket, error)
        elif error is None and isinstance(outcome := ticket.future.result(), Outcome):
            self._check_outcome(ticket, outcome)
        elif error is None and isinstance(ticket.what, Procedures):
            self.report(f'{ticket} was answered without an outcome')

    def _check_service(self, ticket, error):
        (name, given), after = ticket.what, self._now - ticket.asked
        if after > (SLOW_ANSWER_S if name == 'record' else PROMPT_ANSWER_S):
            self.report(f'{ticket} was answered after {after:.3f} s')
        if name == 'record' and not given and error is None:
            self._closed_bags.add(ticket.future.result())

    def _check_outcome(self, ticket, outcome):
        if not isinstance(ticket.what, Procedures):
            self.report(f'{ticket} was answered with {outcome}')
        if outcome.success and self._run.script.state and ticket.moves:
            level = outcome.reading.level if outcome.reading else None
            if self._run.element.faults.stuck_cell:  # it echoes as a wall does
                level = None
            self._acknowledged = outcome.end_tick, level, ticket.number

    # --- the life cycle ------------------------------------------------------------------

    def check_transition(self, process, name, before, refusal):
        """Check a transition that was made, or was not."""
        self._run.scheduler.add_note(('transition', name, before, process.state, refusal))
        element = process.host.element
        if refusal is None and name == 'configure':
            self.truth.watch_refusals(element)
            self.truth.assume_motion(element)
        if refusal is None and name == 'deactivate':
            self.check_stopped(process, element)
        if refusal and process.state == before and self._is_disk_healthy():
            expected = ('is refused while', 'exists already', 'the device has stopped')
            if not any(text in refusal for text in expected):
                self.report(f'{name} is refused although the disk is healthy: {refusal}')

    def check_stopped(self, process, element):
        """Check an element whose loop has ended."""
        if not math.isfinite(float(element.chain.state().sum()) + element.chain.V_N):
            self.report('the state is not finite')
        if element.ticks and not process.host.lost and self._run.script.state:
            self._acknowledged = element.ticks, None, None

    # --- ends ----------------------------------------------------------------------------

    def check_end(self, process):
        """Check a process that has ended by itself, with a healed disk."""
        name, seconds = process.executor.longest
        if seconds > (SLOW_ANSWER_S if name in SLOW_CALLBACKS else PROMPT_ANSWER_S):
            self.report(f'callback {name} took {seconds:.3f} s')
        if process.loop is not None:
            numbers = vars(process.loop.statistics)
            if not all(0.0 <= value < math.inf for value in numbers.values()):
                self.report(f'the loop has kept time like this: {numbers}')
        for ticket in process.tickets:
            if not ticket.future.done():
                self.report(f'{ticket} was never answered')
        for left in self._run.scheduler.list_leftovers():
            self.report(f'left over: {left}')
        for open_file in self._run.disk.open_files.values():
            self.report(f'left open: {open_file.path}')

    def check_after_death(self, how):
        """Check what a process has left on the disk after a kill or a power cut."""
        disk = self._run.disk
        if how == 'power':
            disk.cut_power()
        else:
            disk.kill()
        self.truth.waiting = 0
        self.truth.assume_motion(None)
        self._check_saved_state()
        for finding in find_bag_errors(disk, self._closed_bags):
            self.report(finding)

    def _check_saved_state(self):
        if self._acknowledged is None:
            return
        ticks, level, number = self._acknowledged
        try:
            saved = store.load_snapshot(Path(STATE_PATH))
        except REFUSALS as error:
            self.report(f'the saved state cannot be read: {error}')
            return
        if saved is None or saved['ticks'] < ticks:
            had = saved and saved['ticks']
            self.report(f'what was acknowledged at tick {ticks} is lost: the file has tick {had}')
        elif level is not None and number == self.truth.asked:
            element = self._run.kind.restore_element(saved)
            truth = find_level(element.design, element.chain.configuration)
            if truth != level:
                self.report(f'level {level} was acknowledged; {truth} is on the disk')

    # --- helpers -------------------------------------------------------------------------

    @property
    def _now(self):
        return self._run.scheduler.now

    def _is_disk_healthy(self):
        disk = self._run.disk
        calm = self._now - disk.troubled_at > 2.0 * DISK_TIMEOUT_S
        return calm and not (disk.trouble or disk.held_up)


def describe_error(error):
    """Return an exception with the place where it was raised."""
    return ''.join(traceback.format_exception(error, limit=-4))


def find_bag_errors(disk, closed):
    """Yield what is wrong with the bags on a disk: real readers must find every message.

    Args:
        disk: The disk, after the recording process has ended.
        closed: Paths of the bags that were reported as closed.
    """
    names = [name for name in disk.list_names(DISK_PATH) if name.startswith('session')]
    for path in closed:
        if path.name not in names:
            yield f'{path} was closed and is not there'
    # The copy is on a real disk.
    with TemporaryDirectory() as folder, patch.object(atomic_files, 'os', os):
        disk.root.copy_to(Path(folder))
        for name in names:
            path = Path(DISK_PATH, name)
            try:
                yield from _find_errors(folder / path.relative_to('/'), path in closed)
            except BagError as error:
                yield f'{name}: {error}'


def _find_errors(bag, whole):
    metadata = read_metadata(bag)
    promised = sum(metadata.message_counts.values()) if metadata else 0  # they were synced
    try:
        reader = BagReader(bag)
    except BagError as error:
        if promised or whole:
            yield f'{bag.name} has {promised} messages that were synced, and: {error}'
        return
    count = sum(1 for _ in reader)
    if count < promised:
        yield f'{bag.name} has {count} messages; {promised} were synced'
    if whole and reader.losses:
        yield f'{bag.name} was closed and is not whole: {reader.losses}'
    topics = reader.topics
    if not any(name.endswith('/session') and info.message_count for name, info in topics.items()):
        return  # no session has begun, or its beginning was not synced
    report = run_replay(load_session(reader))
    if not report.exact or report.refused:
        differs = report.states.first_difference
        yield f'{bag.name} does not replay: {differs}, refused: {report.refused}'
