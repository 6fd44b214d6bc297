# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Feedback from a running procedure: its phase, its share of the time, its attempts."""

import itertools

import pytest

from mlmem import Abort, Read, SelfTest, Write, new_element, preset, snapshot
from mlmem.commands import (
    PHASE_LAUNCHING,
    PHASE_LISTENING,
    PHASE_SETTLING,
    PHASE_STRAINING,
    Progress,
)
from mlmem.move_settings import WriteSettings

from . import rig


def watched(element, command):
    """Perform a command; return the feedback after every tick, and the outcome."""
    told = []
    outcome = element.perform(command, lambda: told.append(element.feedback()))
    return told, outcome


def phases(told):
    return [phase for phase, _ in itertools.groupby(each.phase for each in told)]


def test_write_goes_through_its_phases(written):
    told, _ = watched(written(0), Write(1))
    assert phases(told)[:2] == [PHASE_STRAINING, PHASE_SETTLING]
    assert phases(told)[-1] == PHASE_LISTENING
    strained = [each.strain for each in told if each.phase == PHASE_STRAINING]
    assert max(map(abs, strained)) > 0.02
    assert told[-1].strain == 0.0
    launched, _ = watched(rig.device(), Write(0))
    assert PHASE_LAUNCHING in phases(launched)


@pytest.mark.parametrize('command', [Write(2), Write(1), Write(3), Read('both')])
def test_share_rises_to_about_one(written, command):
    told, outcome = watched(written(1), command)
    shares = [each.share for each in told]
    assert outcome.success
    assert shares == sorted(shares)
    assert 0.75 <= shares[-1] <= 1.0
    assert shares[len(shares) // 2] < 0.7


def test_parts_of_self_test_do_not_prolong_forecast():
    told, _ = watched(new_element(preset('kick_2')), SelfTest())
    shares = [each.share for each in told]
    assert 0.3 < shares[len(shares) // 2] < 0.9
    assert {each.attempts for each in told} == {1}


def test_failed_attempt_is_counted_and_prolongs_write(written):
    element = written(
        1, write=WriteSettings(tension=0.001, attempts=2)
    )  # a pull that no wall follows
    told, outcome = watched(element, Write(2))
    assert not outcome.success
    assert [count for count, _ in itertools.groupby(each.attempts for each in told)] == list(
        range(1, outcome.attempts + 1)
    )
    begun = next(index for index, each in enumerate(told) if each.attempts == 2)
    assert told[begun].share < told[begun - 1].share


def test_late_procedure_has_share_of_one():
    progress = Progress('read', 100)
    progress.expect_end(110)
    assert progress.share(105) == 0.5
    assert progress.share(110) == progress.share(200) == 1.0
    progress.expect_end(300)
    assert progress.share(200) == 0.5
    progress.tried('erase', 3)  # that of a procedure that it calls
    assert progress.attempts == 1


def test_procedure_runs_until_it_has_outcome(written):
    element = written(0)
    mine = element.apply(Read())
    assert element.runs(mine)
    assert mine.outcome is None
    aborting = element.apply(Abort())
    assert not element.runs(mine)
    assert mine.outcome.error == 'aborted'
    assert element.runs(aborting)
    assert not element.runs(None)


def test_feedback_changes_no_bit(written):
    plain, looked_at = written(1), written(1)
    plain.perform(Write(2))
    watched(looked_at, Write(2))
    assert snapshot.take_snapshot(plain) == snapshot.take_snapshot(looked_at)
