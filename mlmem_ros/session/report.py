# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The report of a replay: what it compared, what agrees, what was missing, and the verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from ..bag.contents import NOT_CLOSED
from ..contract.answers import ended
from ..device import BLANK, UNDECODABLE, Outcome
from ..procedures import WIDE
from .streams import ROUNDING, Compared


@dataclass(frozen=True)
class Difference:
    """The first difference between a replay and the recording.

    Attributes:
        tick: The first hashed tick whose state differs.
        by: Greatest difference of a displacement there, in cells.
    """

    tick: int
    by: float


@dataclass
class ReplayReport:
    """Result of a replay.

    Attributes:
        refused: Commands that the replay refused, with reasons.
        hashes: State hashes compared.
        difference: The first that differs, or None.
        state_difference: Greatest difference of a displacement at any of them, in cells.
        levels: Levels decoded by the replay, in order.
        recorded_levels: Recorded levels, by echo; None where there was none.
        equal_echoes: Recorded echoes that the replay reproduced bit for bit.
        echo_difference: Greatest difference between a recorded and a replayed echo, in cells.
        other_echoes: Recorded echoes with another number of samples than the replayed ones.
        recorded_endings: How they ended in the recording; see `ending`.
        streams: How the published streams of a session agree, by topic.
        lost: What is missing from the recording, one line each.
        altered: What is not as it was recorded, one line each.
        foreign: Whether another recorder wrote the bag: then levels are compared, not bits.
        other_build: Differences in the versions that the bits may depend on.
    """

    ticks: int = 0
    commands: int = 0
    refused: list[str] = field(default_factory=list)
    hashes: int = 0
    equal_hashes: int = 0
    difference: Difference | None = None
    state_difference: float = 0.0
    levels: list[int] = field(default_factory=list)
    recorded_levels: Sequence[int | None] = ()
    equal_echoes: int = 0
    echo_difference: float = 0.0
    other_echoes: int = 0
    outcomes: list[Outcome] = field(default_factory=list)
    recorded_endings: Sequence[str] = ()
    streams: dict[str, Compared] = field(default_factory=dict)
    lost: Sequence[str] = ()
    altered: Sequence[str] = ()
    foreign: bool = False
    other_build: dict[str, tuple[str, str]] = field(default_factory=dict)

    @property
    def endings(self) -> list[str]:
        """How the procedures ended in the replay, as `recorded_endings`."""
        return [ending(ended(outcome)) for outcome in self.outcomes]

    @property
    def compared(self) -> bool:
        """Whether there was anything to compare with."""
        return bool(self.hashes or comparable(self.recorded_levels) or self.recorded_endings)

    @property
    def levels_agree(self) -> bool:
        """Whether every recorded level was decoded again, and every ending reached."""
        return all(
            agreeing(then, now) == comparable(then)
            for then, now in (
                (self.recorded_levels, self.levels),
                (self.recorded_endings, self.endings),
            )
        )

    @property
    def exact(self) -> bool:
        """Whether all recorded states, echoes, levels and streams are the same to the bit."""
        same = self.difference is None and self.echo_difference == 0.0 and not self.other_echoes
        return same and self.levels_agree and all(each.exact for each in self.streams.values())

    @property
    def rounded(self) -> bool:
        """Whether states and echoes differ by no more than another build's rounding."""
        difference = max(self.state_difference, self.echo_difference)
        return difference <= ROUNDING and not self.other_echoes

    @property
    def other_streams(self) -> list[str]:
        """The streams that differ by more than the build explains."""
        return [
            f'~/{name}'
            for name, each in self.streams.items()
            if not (each.exact or (self.other_build and each.rounded))
        ]

    @property
    def passed(self) -> bool:
        """Whether there was something to compare, and all of it agrees as guaranteed.

        Levels must always agree; a session's states and echoes to the bit on the build that
        recorded it, and to rounding on another. Nothing may have been altered since.
        """
        if self.altered or not self.compared or not self.levels_agree:
            return False
        close = self.exact or (bool(self.other_build) and self.rounded and not self.other_streams)
        return self.foreign or (close and not self.refused)

    @property
    def whole(self) -> bool:
        """Whether nothing is missing from the recording."""
        return not self.lost

    @property
    def verdict(self) -> str:
        """The verdict in one sentence, with any reason against it in capitals."""
        if not self.compared:
            return (
                'NOTHING TO COMPARE: the bag has neither ~/outcome, nor ~/echo and ~/level, '
                'nor states of a session'
            )
        if not self.levels_agree:
            return 'THE LEVELS DIFFER from those that were recorded'
        if self.altered:
            return f'ALTERED since it was recorded: {self.altered[0]}'
        if not self.passed:
            if self.rounded and not self.refused and (streams := self.other_streams):
                return f'THE STREAMS DIFFER from what the states give: {", ".join(streams)}'
            return f'THE BITS DIFFER{self._beyond}; all levels agree'
        agree = 'the levels agree'
        if not self.foreign:
            other = (
                f'the levels agree, and the bits but for rounding (less than {ROUNDING:g} cells)'
            )
            agree = 'exact: the same bits' if self.exact else other
        return remains(self.lost) + agree

    def as_dict(self) -> dict[str, Any]:
        """Return the report as plain values, for programs."""
        return {
            'verdict': self.verdict,
            'passed': self.passed,
            'whole': self.whole,
            'exact': self.exact,
            'foreign': self.foreign,
            'lost': list(self.lost),
            'altered': list(self.altered),
            'ticks': self.ticks,
            'commands': self.commands,
            'refused': self.refused,
            'states': {
                'recorded': self.hashes, 'equal': self.equal_hashes,
                'greatest_difference': self.state_difference,
                'first_difference': self.difference and self.difference.tick,
            },
            'echoes': {
                'recorded': len(self.recorded_levels), 'equal': self.equal_echoes,
                'greatest_difference': self.echo_difference, 'other_length': self.other_echoes,
            },
            'streams': {name: asdict(each) for name, each in self.streams.items()},
            'levels': {'recorded': list(self.recorded_levels), 'replayed': self.levels},
            'procedures': {'recorded': list(self.recorded_endings), 'replayed': self.endings},
            'other_build': {name: list(pair) for name, pair in self.other_build.items()},
        }  # fmt: skip

    @property
    def _beyond(self) -> str:
        if self.refused:
            return ', commands that took effect are refused'
        if self.rounded:
            return ''
        return ' by more than rounding: design, settings or commands are not the recorded ones'


def remains(lost: Sequence[str]) -> str:
    """Return how a verdict begins if this is missing from the recording."""
    if not lost:
        return ''
    if all(NOT_CLOSED in line for line in lost):
        return 'NOT WHOLE: the end of the recording is missing; up to there, '
    return 'NOT WHOLE: part of the recording is lost; in what remains, '


def ending(values: Mapping[str, Any]) -> str:
    """Return in words how a procedure ended, by the values of its outcome, such as `write 3`,
    `erase blank` or `write failed`.
    """
    procedure = str(values.get('procedure', 'a procedure'))
    if 'error' in values:
        return f'{procedure} failed'
    level = str(values.get('level', ''))
    named = {
        str(BLANK): 'blank',
        str(UNDECODABLE): 'undecodable',
        str(WIDE): values.get('word', ''),
    }
    words = named.get(level, level)
    return f'{procedure} {words}'.rstrip()


def comparable(recorded: Sequence[object]) -> int:
    """Return how many values there are to compare with, that is, not None."""
    return len(recorded) - list(recorded).count(None)


def agreeing(recorded: Sequence[object], found: Sequence[object]) -> int:
    """Return how many of the recorded values were found again, in order."""
    pairs = zip(recorded, found, strict=False)
    return sum(then is not None and then == now for then, now in pairs)
