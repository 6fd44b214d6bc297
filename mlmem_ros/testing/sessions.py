# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Replays of recorded sessions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from os import PathLike

from ..session.data import SessionData, load_session
from ..session.replay import run_replay
from ..session.report import ReplayReport


@dataclass(frozen=True)
class ReplayedSession:
    """A replayed session.

    Attributes:
        session: What was recorded.
        report: How the replay went.
    """

    session: SessionData
    report: ReplayReport

    @property
    def levels(self) -> list[int]:
        """Final levels of writes and reads in the replay, in order (-1 is blank)."""
        return [
            outcome.reading.level
            for outcome in self.report.outcomes
            if outcome.procedure in ('write', 'read') and outcome.reading and outcome.success
        ]

    def assert_levels(self, expected: Sequence[int]) -> None:
        """Fail unless writes and reads ended with these levels."""
        wanted = list(expected)
        lost = '; '.join(['', *self.report.lost])
        assert self.levels == wanted, f'levels are {self.levels}; expected {wanted}{lost}'


def assert_replays(bag: str | PathLike[str], incomplete: bool = False) -> ReplayedSession:
    """Fail unless a replay reproduces a whole session, or if it is incomplete what there is of it.

    That means every bit on the build that recorded, and every decoded level on another one. A
    session that cannot be read or replayed raises `BagError`.

    Returns:
        The session and its replay, for further checks.
    """
    session = load_session(bag)
    report = run_replay(session)
    assert report.levels_agree, (
        f'{report.verdict}: procedures {report.endings}, recorded {report.recorded_endings}'
    )
    assert report.passed, '; '.join([report.verdict, *report.lost])
    assert report.whole or incomplete, f'{report.verdict}: {"; ".join(report.lost)}'
    return ReplayedSession(session, report)


def assert_written(bag: str | PathLike[str], level: int, incomplete: bool = False) -> None:
    """Fail unless the last write of a session reached a level, and does so again."""
    outcomes = assert_replays(bag, incomplete).report.outcomes
    writes = [outcome for outcome in outcomes if outcome.procedure == 'write']
    assert writes, f'{bag} holds no write'
    last = writes[-1]
    assert last.success, f'the last write of {bag} failed: {last.error}'
    found = last.reading.level if last.reading is not None else None
    assert found == level, f'the last write of {bag} found level {found}; expected {level}'
