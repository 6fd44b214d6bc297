# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The report of a replay: what it compared, what agrees, what was missing, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from mlmem import BLANK, UNDECODABLE, Outcome
from mlmem.procedure_table import CONTENT_NAMES

from ..bag.contents import NOT_CLOSED_REASON
from ..contract.answers import outcome_to_dict

MAX_ROUNDING_CELLS = 1e-6
"""Greatest difference, in cells, that another build's rounding can cause.

Rounding every displacement at every tick, by four times a processor's rounding, changes the golden
sessions by less than 1e-12 cells. A greater difference has another cause.
"""

VERDICT_TEXTS = {
    'exact': 'exact: the same bits',
    'agrees': 'the levels agree, and the bits but for rounding (less than '
    f'{MAX_ROUNDING_CELLS:g} cells)',
    'nothing_to_compare': 'NOTHING TO COMPARE: the session has neither events nor states',
    'incomplete': 'NOT WHOLE: part of the recording is lost, perhaps with commands, and what '
    'remains does not replay to what was recorded',
    'begins_in_the_middle': 'BEGINS IN THE MIDDLE: the records after the state in the header are '
    'missing, and what remains does not replay to what was recorded',
    'levels_differ': 'THE LEVELS DIFFER from those that were recorded',
    'commands_rejected': 'THE BITS DIFFER, commands that took effect are refused; all levels '
    'agree',
    'states_differ': 'THE BITS DIFFER by more than rounding: design, settings or commands are not '
    'the recorded ones; all levels agree',
    'events_differ': 'THE EVENTS DIFFER from what the states give',
    'rounding_differs': 'THE BITS DIFFER; all levels agree',
}
"""The verdicts of a replay, by their codes, but for `part_missing`, which says which."""


@dataclass
class Comparison:
    """How the recorded states, or the events of one topic, agree with those that the replay
    computes, in order.

    Attributes:
        recorded: How many were recorded.
        compared: Those for which the replay has computed one.
        equal: Those that are the same to the bit.
        difference: Greatest difference of a number, infinite if there are more or fewer numbers.
        first_difference: The ticks done when the first that is not equal was compared, or None.
    """

    recorded: int = 0
    compared: int = 0
    equal: int = 0
    difference: float = 0.0
    first_difference: int | None = None

    def add(self, tick: int, difference: float, is_equal: bool) -> None:
        """Count one that the replay has computed after a tick."""
        self.compared += 1
        self.equal += is_equal
        self.difference = max(self.difference, difference)
        if not is_equal and self.first_difference is None:
            self.first_difference = tick

    @property
    def exact(self) -> bool:
        """Whether every one was computed again to the bit."""
        return self.equal == self.recorded

    @property
    def rounded(self) -> bool:
        """Whether every one was computed again up to another build's rounding."""
        return self.compared == self.recorded and self.difference <= MAX_ROUNDING_CELLS


@dataclass
class ReplayReport:
    """Result of a replay.

    Attributes:
        refused: Commands that the replay refused, with reasons.
        states: How the recorded states agree; their differences are of displacements in cells.
        events: How the recorded events agree, by topic.
        outcomes: How the procedures ended.
        recorded_endings: How they ended in the recording; see `describe_ending`.
        lost: What is missing from the recording, one line each.
        missing_parts: Numbers, from 0, of the missing files of a split recording.
        begins_late: Whether the first state hash is later than the first that is due.
        other_build: Differences in the versions that the bits may depend on.
    """

    ticks: int = 0
    commands: int = 0
    refused: list[str] = field(default_factory=list)
    states: Comparison = field(default_factory=Comparison)
    events: dict[str, Comparison] = field(default_factory=dict)
    outcomes: list[Outcome] = field(default_factory=list)
    recorded_endings: Sequence[str] = ()
    lost: Sequence[str] = ()
    missing_parts: Sequence[int] = ()
    begins_late: bool = False
    other_build: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def endings(self) -> list[str]:
        """How the procedures ended in the replay, as `recorded_endings`."""
        return [describe_ending(outcome_to_dict(outcome)) for outcome in self.outcomes]

    @property
    def levels_agree(self) -> bool:
        """Whether every recorded level or word was decoded again, and every ending reached."""
        recorded = list(self.recorded_endings)
        contents = (self.events[name] for name in CONTENT_NAMES if name in self.events)
        return self.endings[: len(recorded)] == recorded and all(each.exact for each in contents)

    @property
    def exact(self) -> bool:
        """Whether all recorded states, levels and events are the same to the bit."""
        return self.levels_agree and all(
            each.exact for each in (self.states, *self.events.values())
        )

    @property
    def other_events(self) -> list[str]:
        """The topics whose events differ by more than the build explains."""
        return [
            f'~/{name}'
            for name, each in self.events.items()
            if not (each.exact or (self.other_build and each.rounded))
        ]

    @property
    def passed(self) -> bool:
        """Whether there was something to compare, and all of it agrees as guaranteed.

        Levels must always agree; a session's states and events to the bit on the build that
        recorded it, and to rounding on another.
        """
        return self.code in ('exact', 'agrees', 'part_missing')

    @property
    def whole(self) -> bool:
        """Whether nothing is missing from the recording."""
        return not self.lost

    @property
    def code(self) -> str:
        """The verdict as one of the keys of `VERDICT_TEXTS`, or `part_missing`."""
        if not (self.states.recorded or self.events):
            return 'nothing_to_compare'
        if differs := self._find_disagreement():
            if self.begins_late:
                return 'begins_in_the_middle'
            is_damaged = any(NOT_CLOSED_REASON not in line for line in self.lost)
            return 'incomplete' if is_damaged else differs
        if self.missing_parts:
            return 'part_missing'
        return 'exact' if self.exact else 'agrees'

    def _find_disagreement(self) -> str:
        """Return the code of what does not agree as guaranteed; empty if all does."""
        if not self.levels_agree:
            return 'levels_differ'
        if self.refused:
            return 'commands_rejected'
        if self.states.difference > MAX_ROUNDING_CELLS:
            return 'states_differ'
        if self.other_events:
            return 'events_differ'
        if not (self.states.exact or self.other_build):
            return 'rounding_differs'
        return ''

    @property
    def verdict(self) -> str:
        """The verdict in one sentence, with any reason against it in capitals."""
        if self.passed:
            return self._describe_missing() + VERDICT_TEXTS['exact' if self.exact else 'agrees']
        listed = f': {", ".join(self.other_events)}' if self.code == 'events_differ' else ''
        return VERDICT_TEXTS[self.code] + listed

    def _describe_missing(self) -> str:
        """Return how a verdict begins if something is missing from the recording."""
        if self.missing_parts:
            numbers = ', '.join(str(number + 1) for number in self.missing_parts)
            where = 'in what is replayed' if 0 in self.missing_parts else 'up to there'
            return f'NOT WHOLE: part {numbers} is missing; {where}, '
        if not self.lost:
            return ''
        if all(NOT_CLOSED_REASON in line for line in self.lost):
            return 'NOT WHOLE: the end of the recording is missing; up to there, '
        return 'NOT WHOLE: part of the recording is lost; in what remains, '

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain values, for programs."""
        return {
            'verdict': self.verdict,
            'code': self.code,
            'passed': self.passed,
            'whole': self.whole,
            'exact': self.exact,
            'lost': list(self.lost),
            'missing_parts': [number + 1 for number in self.missing_parts],
            'ticks': self.ticks,
            'commands': self.commands,
            'refused': self.refused,
            'states': asdict(self.states),
            'events': {name: asdict(each) for name, each in self.events.items()},
            'procedures': {'recorded': list(self.recorded_endings), 'replayed': self.endings},
            'other_build': {name: list(pair) for name, pair in self.other_build.items()},
        }


def describe_ending(values: Mapping[str, Any]) -> str:
    """Return in words how a procedure ended, by the values of its outcome, such as `write 3`,
    `erase blank` or `write failed`.
    """
    procedure = str(values.get('procedure', 'a procedure'))
    if 'error' in values:
        return f'{procedure} failed'
    content = str(values.get('word', values.get('level', '')))
    named = {str(BLANK): 'blank', str(UNDECODABLE): 'undecodable'}
    return f'{procedure} {named.get(content, content)}'.rstrip()
