# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replay: run the recorded commands through a device without ROS, and compare."""

from __future__ import annotations

import itertools
import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import (
    Calibration,
    Command,
    DelayTable,
    EchoReceived,
    Event,
    MemoryElement,
    Outcome,
    Refused,
    snapshot,
)
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.instrument import MAX_RUN_TICKS
from mlmem.physics import StateError

from ..bag.errors import BagError
from ..contract.streams import STREAMS
from .data import SessionData
from .records import MAX_HASH_INTERVAL_TICKS, Header, StateHash, collect_versions, name_errors
from .report import ComparedEvents, Difference, ReplayReport, describe_ending

Progress = Callable[[int, int], None]
"""Called periodically with the ticks done and the ticks to do."""

MAX_REPLAY_TICKS = 10**9
"""Most ticks of a replay by message stamps: three weeks at the default pace."""


def build_element(session: SessionData) -> MemoryElement:
    """Return the device of a session in the state where the session began.

    Raises:
        BagError: The header is missing or invalid, or describes a real element.
    """
    header = session.require_header()
    if 0 in session.missing_parts:
        raise BagError(
            'the session begins in the middle: its first part is missing, and a replay starts '
            'from the state in it',
            'begins_in_the_middle',
        )
    if not header.simulated:
        raise BagError(
            'a session of a real element cannot be replayed, since its state is unknown'
        )
    unknown = DelayTable(tuple(float(level) for level in range(header.design.levels)))
    with name_errors('the initial state in the session header'):
        driver = Simulation.of(header.made, header.settings.time)
        known = Calibration(unknown, unknown)
        element = MemoryElement(header.design, header.settings, known, driver)
        element.forecast = header.forecast
        if header.twin is not None:
            element.adopt(header.twin)
        initial = dict(header.initial)
        # The delays belong to exactly these settings, even if a later version changes the key.
        initial.pop('calibration_key', None)
        snapshot.restore_snapshot(element, initial)
    return element


def run_replay(session: SessionData, progress: Progress | None = None) -> ReplayReport:
    """Run a session again and compare states, levels and events.

    Raises:
        BagError: The header is missing or invalid, the records are implausible, or the material
            diverges.
    """
    element, header = build_element(session), session.require_header()
    report = _create_report(session)
    report.other_build = _find_other_build(header.versions)
    player = _Player(element, report, session)
    silence = find_max_gap(header)
    player.play(session.stamped, find_last_tick(session, element.ticks, silence), progress)
    player.reach_recorded_events(header.hash_every)  # a killed recorder leaves no hash at the end
    return report


def replay_commands(
    element: MemoryElement, session: SessionData, progress: Progress | None = None
) -> ReplayReport:
    """Run the commands in any recorder's bag through a device, at their stamps.

    Returns:
        The report. It compares levels and endings if they were recorded; there are no states.

    Raises:
        BagError: The stamps span too long a time, or the material diverges.
    """
    report = _create_report(session)
    report.foreign = True
    report.refused = [f'{time:.3f} s: {why}' for time, why in session.refused]
    player = _Player(element, report, session)
    tick_seconds, first = element.settings.tick_seconds, element.ticks
    longest = MAX_REPLAY_TICKS * tick_seconds
    if any(time > longest for time, _ in session.commands):
        raise BagError(
            f'the commands must span at most {longest:.3g} s; the last of {session.node} is at '
            f'{max(time for time, _ in session.commands):.3g} s'
        )
    stamped = [(first + round(time / tick_seconds), given) for time, given in session.commands]
    player.play(stamped, max([first, *(tick + 1 for tick, _ in stamped)]), progress)
    player.finish_procedure()
    return report


class _Player:
    """Runs stamped commands through a device and compares with what was recorded."""

    def __init__(self, element: MemoryElement, report: ReplayReport, session: SessionData) -> None:
        self._element = element
        self._report = report
        # another build may word and round texts otherwise
        self._recorded = {
            name: session.recorded[name]
            for name in STREAMS
            if name in session.recorded
            and not (report.other_build and is_text(session.recorded[name][0]))
        }
        self._hashes = {recorded.tick: recorded for recorded in session.hashes}
        self._stops = sorted(self._hashes)
        report.events = {
            name: ComparedEvents(len(recorded)) for name, recorded in self._recorded.items()
        }

    def play(
        self, stamped: Sequence[tuple[int, Command]], last: int, progress: Progress | None
    ) -> None:
        """Apply the commands at their ticks and advance until the last tick is done."""
        due: defaultdict[int, list[Command]] = defaultdict(list)
        for tick, given in stamped:
            due[tick].append(given)
        first = self._element.ticks
        self._stops = sorted({*due, *self._hashes})
        self._check_state()  # a session without ticks has the hash of its first state
        reported = first
        while (now := self._element.ticks) < last:
            for given in due.get(now, ()):
                self._apply_command(given)
            self._run(last)
            now = self._element.ticks
            if progress and (now == last or now - reported >= 500):
                reported = now
                progress(now - first, last - first)

    def finish_procedure(self) -> None:
        """Advance until the running procedure has ended."""
        last = self._element.ticks + MAX_REPLAY_TICKS
        while self._element.procedure and self._element.ticks < last:
            self._run(last)

    def reach_recorded_events(self, ticks: int) -> None:
        """Advance until all recorded events were computed, at most so many ticks."""
        last = self._element.ticks + ticks
        while self._element.ticks < last and any(
            each.compared < each.recorded for each in self._report.events.values()
        ):
            self._run(last)

    def _apply_command(self, given: Command) -> None:
        try:
            self._element.apply(given)
            self._report.commands += 1
        except Refused as refusal:
            self._report.refused.append(f'tick {self._element.ticks}: {refusal}')

    def _run(self, last: int) -> None:
        """Advance by a run of ticks, at most to the next command or hash, or to the last tick."""
        begun = self._element.ticks
        place = bisect_right(self._stops, begun)
        stop = min([last, *self._stops[place : place + 1]])
        try:
            events = self._element.advance(min(MAX_RUN_TICKS, stop - begun))
        except (StateError, ArithmeticError) as error:
            raise BagError(f'tick {self._element.ticks} cannot be replayed: {error}') from error
        for event in events:
            if isinstance(event, EchoReceived):
                self._report.levels.append(event.reading.content)
            elif isinstance(event, Outcome):
                self._report.outcomes.append(event)
            self._compare_event(event)
        self._report.ticks += self._element.ticks - begun
        self._check_state()

    def _check_state(self) -> None:
        """Compare the state, if it was recorded at this tick."""
        recorded = self._hashes.get(self._element.ticks)
        if recorded is not None:
            self._compare_state(recorded)

    def _compare_event(self, event: Event) -> None:
        """Compare what an event publishes with the next of the recording on each stream."""
        for name, recorded in self._recorded.items():
            stream, compared = STREAMS[name], self._report.events[name]
            if compared.compared == compared.recorded or not stream.reports(event):
                continue
            values = stream.values(self._element, event)
            difference = find_difference(recorded[compared.compared], values)
            compared.compared += 1
            compared.equal += difference == 0.0
            compared.difference = max(compared.difference, difference)

    def _compare_state(self, recorded: StateHash) -> None:
        self._report.hashes += 1
        if snapshot.hash_state(self._element) == recorded.hash:
            self._report.equal_hashes += 1
            return
        by = float(np.abs(self._element.chain.v - recorded.v).max())
        self._report.state_difference = max(self._report.state_difference, by)
        if self._report.difference is None:
            self._report.difference = Difference(self._element.ticks, by)


def is_text(values: Any) -> bool:
    """Return whether values are texts or integers, not numbers that may be rounded."""
    return not isinstance(values, np.ndarray)


def find_difference(recorded: Any, computed: Any) -> float:
    """Return the greatest difference of numbers; infinite for other texts or another size."""
    if is_text(recorded):
        return 0.0 if recorded == computed else math.inf
    recorded, computed = recorded.ravel(), computed.ravel()
    if recorded.shape != computed.shape:
        return math.inf
    if np.array_equal(recorded, computed, equal_nan=True):
        return 0.0
    with np.errstate(invalid='ignore'):
        difference = float(np.abs(recorded - computed).max())
    return math.inf if math.isnan(difference) else difference


def _create_report(session: SessionData) -> ReplayReport:
    """Return a report that holds only what was recorded and what is missing."""
    return ReplayReport(
        recorded_levels=[echo.content for echo in session.echoes],
        recorded_endings=[describe_ending(values) for _, values in session.outcomes],
        lost=session.lost,
        missing_parts=session.missing_parts,
    )


def _find_other_build(recorded: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    here = collect_versions()
    return {
        name: (recorded.get(name, 'unknown'), here.get(name, 'unknown'))
        for name in {**recorded, **here}
        if recorded.get(name, 'unknown') != here.get(name, 'unknown')
    }


def find_max_gap(header: Header) -> int:
    """Return the most ticks that may lie between two records of a session."""
    # at most 100 in a row are missing, because of damage or a slow disk
    return min(100 * header.hash_every, MAX_HASH_INTERVAL_TICKS)


def find_last_tick(session: SessionData, first: int, silence: int) -> int:
    """Return the tick before which a session ends.

    Args:
        silence: The most ticks that may lie between two of its records.

    Raises:
        BagError: A record has an implausible tick, or belongs to another element; or the records
            are not in the order of their ticks.
    """
    hashed = [recorded.tick for recorded in session.hashes]
    commanded = [tick for tick, _ in session.stamped]
    for before, tick in itertools.chain(itertools.pairwise(hashed), itertools.pairwise(commanded)):
        if tick < before:
            raise BagError(
                f'the records of a session must be in the order of their ticks; got {tick} after '
                f'{before}: if the clock went back meanwhile, a copy sorted by time cannot be '
                'replayed, but the recorded bag can'
            )
    ticks = sorted([first, *hashed, *commanded])
    if ticks[0] < first:
        raise BagError(
            f'the records of a session must start at tick {first} or later; got {ticks[0]}'
        )
    for before, tick in itertools.pairwise(ticks):
        if tick - before > silence:
            raise BagError(
                f'a session must have a record every {silence} ticks (100 times '
                f'record.hash_every); got none between tick {before} and tick {tick}'
            )
    for recorded in session.hashes:
        if len(recorded.v) != session.design.N:
            raise BagError(
                f'the state hash of tick {recorded.tick} must have N = {session.design.N} '
                f'cells; got {len(recorded.v)}'
            )
    return max([first, *hashed, *(tick + 1 for tick in commanded)])
