# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replay: run the recorded commands through a device without ROS, and compare."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections import defaultdict
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import (
    MAX_RUN_TICKS,
    Calibration,
    Command,
    DelayTable,
    Event,
    MemoryElement,
    Outcome,
    Refused,
    Simulation,
    StateError,
    snapshot,
)

from ..bag.errors import BagError
from ..contract.streams import STREAMS
from ..contract.topics import Status
from .data import SessionData
from .records import collect_versions, name_errors
from .report import Comparison, ReplayReport, describe_ending

ReportProgress = Callable[[int, int], None]
"""Called periodically with the ticks done and the ticks to do."""


def build_element(session: SessionData) -> MemoryElement:
    """Return the device of a session in the state where the session began.

    Raises:
        BagError: The header is invalid, or describes a real element.
    """
    header = session.header
    if not header.simulated:
        raise BagError(
            'a session of a real element cannot be replayed, since its state is unknown'
        )
    unknown = DelayTable(tuple(float(level) for level in range(header.design.levels)))
    with name_errors('the initial state in the session header'):
        driver = Simulation.build_blank(header.made, header.settings.time)
        known = Calibration(unknown, unknown)
        element = MemoryElement(header.design, header.settings, known, driver)
        element.forecast = header.forecast
        if header.twin is not None:
            element.adopt_twin(header.twin)
        initial = dict(header.initial)
        # The delays belong to exactly these settings, even if a later version changes the key.
        initial.pop('calibration_key', None)
        snapshot.restore_snapshot(element, initial)
    return element


def run_replay(session: SessionData, progress: ReportProgress | None = None) -> ReplayReport:
    """Run a session again and compare states, levels and events.

    Raises:
        BagError: The header is invalid, the records are implausible or begin before it (code
            `begins_in_the_middle`), or the material diverges.
    """
    element, header = build_element(session), session.header
    first_hash = min((each.tick for each in session.hashes), default=element.ticks)
    report = ReplayReport(
        recorded_endings=[describe_ending(values) for _, values in session.outcomes],
        lost=session.lost,
        missing_parts=session.missing_parts,
        begins_late=first_hash > element.ticks + header.hash_every,
        other_build=_find_other_build(header.versions),
    )
    player = _Player(element, report, session)
    player.play_commands(session.stamped, find_last_tick(session, element.ticks), progress)
    player.reach_recorded_events(header.hash_every)  # a killed recorder leaves no hash at the end
    return report


class _Player:
    """Runs stamped commands through a device and compares with what was recorded."""

    def __init__(self, element: MemoryElement, report: ReplayReport, session: SessionData) -> None:
        self._element = element
        self._report = report
        # another build may word and round texts otherwise
        self._recorded = {
            name: [values for _, values in session.events[name]]
            for name in STREAMS
            if name in session.events
            and not (report.other_build and isinstance(session.events[name][0][1], Status))
        }
        self._hashes = {recorded.tick: recorded for recorded in session.hashes}
        report.states = Comparison(len(self._hashes))
        report.events = {
            name: Comparison(len(recorded)) for name, recorded in self._recorded.items()
        }

    def play_commands(
        self, stamped: Sequence[tuple[int, Command]], last: int, progress: ReportProgress | None
    ) -> None:
        """Apply the commands at their ticks and advance until the last tick is done."""
        due: defaultdict[int, list[Command]] = defaultdict(list)
        for tick, given in stamped:
            due[tick].append(given)
        first = self._element.ticks
        self._stops = sorted({*due, *self._hashes})
        self._compare_state()  # a session without ticks has the hash of its first state
        reported = first
        while (now := self._element.ticks) < last:
            for given in due.get(now, ()):
                self._apply_command(given)
            self._run_ticks(last)
            now = self._element.ticks
            if progress and (now == last or now - reported >= 500):
                reported = now
                progress(now - first, last - first)

    def reach_recorded_events(self, ticks: int) -> None:
        """Advance until all recorded events were computed, at most so many ticks."""
        last = self._element.ticks + ticks
        while self._element.ticks < last and any(
            each.compared < each.recorded for each in self._report.events.values()
        ):
            self._run_ticks(last)

    def _apply_command(self, given: Command) -> None:
        try:
            self._element.apply(given)
            self._report.commands += 1
        except Refused as refusal:
            self._report.refused.append(f'tick {self._element.ticks}: {refusal}')

    def _run_ticks(self, last: int) -> None:
        """Advance by a run of ticks, at most to the next command or hash, or to the last tick."""
        begun = self._element.ticks
        place = bisect_right(self._stops, begun)
        stop = min([last, *self._stops[place : place + 1]])
        try:
            events = self._element.advance(min(MAX_RUN_TICKS, stop - begun))
        except (StateError, ArithmeticError) as error:
            raise BagError(f'tick {self._element.ticks} cannot be replayed: {error}') from error
        for event in events:
            if isinstance(event, Outcome):
                self._report.outcomes.append(event)
            self._compare_event(event)
        self._report.ticks += self._element.ticks - begun
        self._compare_state()

    def _compare_event(self, event: Event) -> None:
        """Compare what an event publishes with the next of the recording on each stream."""
        for name, recorded in self._recorded.items():
            stream, compared = STREAMS[name], self._report.events[name]
            if compared.compared == compared.recorded or not stream.reports_event(event):
                continue
            values = stream.values(self._element, event)
            difference = find_difference(recorded[compared.compared], values)
            compared.add(self._element.ticks, difference, difference == 0.0)

    def _compare_state(self) -> None:
        """Compare the state, if it was recorded at this tick."""
        tick = self._element.ticks
        if (recorded := self._hashes.get(tick)) is not None:
            difference = float(np.abs(self._element.chain.v - recorded.v).max())
            is_equal = snapshot.hash_state(self._element) == recorded.hash
            self._report.states.add(tick, 0.0 if is_equal else difference, is_equal)


def find_difference(recorded: Any, computed: Any) -> float:
    """Return the greatest difference of numbers; infinite for other texts, fields or sizes."""
    if isinstance(recorded, dict):
        if recorded.keys() != computed.keys():
            return math.inf
        return max(find_difference(recorded[name], computed[name]) for name in recorded)
    if not isinstance(recorded, np.ndarray | float):  # texts or an integer
        return 0.0 if recorded == computed else math.inf
    recorded, computed = np.ravel(recorded), np.ravel(computed)
    if recorded.shape != computed.shape:
        return math.inf
    if np.array_equal(recorded, computed, equal_nan=True):
        return 0.0
    with np.errstate(invalid='ignore'):
        difference = float(np.abs(recorded - computed).max())
    return math.inf if math.isnan(difference) else difference


def _find_other_build(recorded: Mapping[str, str]) -> dict[str, tuple[str, str]]:
    here = collect_versions()
    return {
        name: (recorded.get(name, 'unknown'), here.get(name, 'unknown'))
        for name in {**recorded, **here}
        if recorded.get(name, 'unknown') != here.get(name, 'unknown')
    }


def find_last_tick(session: SessionData, first: int) -> int:
    """Return the tick before which a session ends that begins at a tick.

    Raises:
        BagError: A record has an implausible tick, or belongs to another element; or the records
            are not in the order of their ticks.
    """
    hashed = [recorded.tick for recorded in session.hashes]
    commanded = [tick for tick, _ in session.stamped]
    if hashed != sorted(hashed) or commanded != sorted(commanded):
        raise BagError(
            'the records of a session must be in the order of their ticks: if the clock went back '
            'meanwhile, a copy sorted by time cannot be replayed, but the recorded bag can'
        )
    if (earliest := min([*hashed, *commanded], default=first)) < first:
        raise BagError(
            f'the session begins in the middle: with tick {earliest}, and its header with {first}',
            'begins_in_the_middle',
        )
    longest = 10**9  # ticks: three weeks at the default pace
    for tick in (*hashed, *commanded):
        if not first <= tick <= first + longest:
            raise BagError(
                f'the records of a session must have ticks from {first} to {first + longest}; '
                f'got {tick}'
            )
    cells = session.header.design.N
    for recorded in session.hashes:
        if len(recorded.v) != cells:
            raise BagError(
                f'the state hash of tick {recorded.tick} must have N = {cells} cells; '
                f'got {len(recorded.v)}'
            )
    return max([first, *hashed, *(tick + 1 for tick in commanded)])
