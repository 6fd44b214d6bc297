# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The log: each subject once a second, in short lines, at no cost."""

import itertools

from mlmem_ros import threads
from mlmem_ros.host.journal import AT_ONCE, LONGEST


def test_a_flood_of_refusals_is_one_line_a_second(journal, log, monkeypatch):
    clock = itertools.count(0, 1)  # a thousand a second
    monkeypatch.setattr(threads, 'monotonic', lambda: next(clock) / 1024)
    for _ in range(10 * 1024):
        journal.refused('~/strain', 'it is not finite')
    told = log.of('warning')
    assert len(told) == AT_ONCE + 9
    assert set(told[:AT_ONCE]) == {'~/strain refused: it is not finite'}
    more = told[AT_ONCE + 1].removeprefix('~/strain refused: it is not finite ')
    assert more == '(and 1023 more since the last line)'


def test_a_flood_does_not_hide_other_lines(journal, log):
    for _ in range(100):
        journal.refused('~/strain', 'it is not finite')
    journal.refused('~/probe', 'busy')
    assert log.of('warning')[-1] == '~/probe refused: busy'


def test_a_log_line_is_short_whatever_came_in(journal, log):
    journal.refused('~/strain_trajectory', f'the joint must be substrate; got {"j" * 5_000_000}!')
    (told,) = log.of('warning')
    assert len(told) < LONGEST + 20
    assert told.startswith('~/strain_trajectory refused: the joint must be substrate')
    assert told.endswith('jjj!')


def test_a_defect_is_logged_with_its_traceback_and_counted(journal, log):
    for _ in range(3):
        with journal.guarded('the test'):
            raise ZeroDivisionError('by hand')
    assert journal.caught == 3
    told = log.of('error')[0]
    assert told.startswith('the test failed; this is a defect:')
    assert "raise ZeroDivisionError('by hand')" in told
