# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The log: each subject once a second, in short lines, at no cost."""

import itertools

from mlmem import threads


def test_flood_of_one_subject_is_one_line_a_second(throttled, log, monkeypatch):
    clock = itertools.count(0, 1)  # a thousand a second
    monkeypatch.setattr(threads, 'monotonic', lambda: next(clock) / 1024)
    for _ in range(10 * 1024):
        throttled.refused('~/strain', 'it is not finite')
    told = log.of('WARN')
    assert len(told) == 10 + 9
    assert set(told[:10]) == {'~/strain refused: it is not finite'}
    more = told[11].removeprefix('~/strain refused: it is not finite ')
    assert more == '(and 1023 more since the last line)'


def test_log_line_is_short_whatever_came_in(throttled, log):
    throttled.refused(
        '~/strain_trajectory', f'the joint must be substrate; got {"j" * 5_000_000}!'
    )
    (told,) = log.of('WARN')
    assert len(told) < 520
    assert told.startswith('~/strain_trajectory refused: the joint must be substrate')
    assert told.endswith('jjj!')


def test_defect_is_logged_with_its_traceback_and_counted(throttled, log):
    for _ in range(3):
        with throttled.guard_errors('the test'):
            raise ZeroDivisionError('by hand')
    assert throttled.caught == 3
    told = log.of('ERROR')[0]
    assert told.startswith('the test failed; this is a fault in the software:')
    assert "raise ZeroDivisionError('by hand')" in told
