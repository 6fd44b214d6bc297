# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Work that waits for a disk: in order, answered once, within `WORK_TIMEOUT_S`; and its log: each
subject once a second, in short lines, at no cost.
"""

import itertools
import threading

import pytest
from timeouts import TIMEOUT_S

from mlmem import threads
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import Overdue
from mlmem_ros.host.worker import WORK_TIMEOUT_S, Worker


@pytest.fixture
def worker(throttled):
    return Worker('test', throttled)


@pytest.fixture
def disk():
    """A disk that hangs until the test lets it go on."""
    hung = threading.Event()
    yield hung
    hung.set()


def test_worker_does_jobs_in_order(worker, disk):
    done = []
    worker.do('work', disk.wait)
    answers = [worker.do('work', lambda n=n: done.append(n) or n) for n in range(50)]
    disk.set()
    assert [answer.result(TIMEOUT_S) for answer in answers] == list(range(50)) == done
    assert worker.wait(TIMEOUT_S)
    for thread in threading.enumerate():
        if thread.name == 'test':
            thread.join(TIMEOUT_S)
            assert not thread.is_alive()
    assert worker.do('more', lambda: 'again').result(TIMEOUT_S) == 'again'


def test_defects_of_a_job_are_logged_and_errors_returned(worker, throttled, log):
    def fail(error):
        raise error

    refused = worker.do('work', lambda: fail(BagError('the disk is full')))
    assert str(refused.exception(TIMEOUT_S)) == 'the disk is full'
    assert throttled.caught == 0
    defect = worker.do('work', lambda: fail(KeyError('views')))
    assert isinstance(defect.exception(TIMEOUT_S), KeyError)
    assert worker.wait(TIMEOUT_S)
    assert throttled.caught == 1
    assert 'work failed; this is a fault in the software' in log.of('ERROR')[0]


def test_job_on_a_hanging_disk_times_out(worker, disk, monkeypatch):
    hung = worker.do('writing', disk.wait)
    behind = worker.do('closing', lambda: pytest.fail('nobody waits for it any more'))
    worker.on_timer()
    assert not hung.done()
    now = threads.monotonic
    monkeypatch.setattr(threads, 'monotonic', lambda: now() + WORK_TIMEOUT_S)
    worker.on_timer()
    for answer, what in ((hung, 'writing'), (behind, 'closing')):
        with pytest.raises(Overdue, match=f'{what} takes longer than 10 s: the disk does not'):
            answer.result(0.0)
    disk.set()
    assert worker.wait(TIMEOUT_S)
    assert worker.do('more', lambda: 'again').result(TIMEOUT_S) == 'again'


def test_flood_of_one_subject_is_one_line_a_second(throttled, log, monkeypatch):
    clock = itertools.count(0, 1)  # a thousand a second
    monkeypatch.setattr(threads, 'monotonic', lambda: next(clock) / 1024)
    for _ in range(10 * 1024):
        throttled.refused('~/strain', 'it is not finite')
    assert throttled.refusals == 10 * 1024
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
