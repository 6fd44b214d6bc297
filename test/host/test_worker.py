# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Work that waits for a disk: in order, answered once, within PATIENCE."""

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


@pytest.fixture
def later(monkeypatch):
    """Let the patience of a worker end at once."""
    now = threads.monotonic
    return lambda: monkeypatch.setattr(threads, 'monotonic', lambda: now() + WORK_TIMEOUT_S)


def alive(name='test'):
    return [thread for thread in threading.enumerate() if thread.name == name]


def test_worker_does_jobs_in_order(worker, disk):
    done = []
    worker.do('work', disk.wait)
    answers = [worker.do('work', lambda n=n: done.append(n) or n) for n in range(50)]
    disk.set()
    assert [answer.result(TIMEOUT_S) for answer in answers] == list(range(50)) == done
    assert worker.wait(TIMEOUT_S)
    for thread in alive():
        thread.join(TIMEOUT_S)
    assert not alive()
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


def test_job_on_a_hanging_disk_times_out(worker, disk, later):
    hung = worker.do('writing', disk.wait)
    behind = worker.do('closing', lambda: pytest.fail('nobody waits for it any more'))
    worker.on_timer()
    assert not hung.done()
    later()
    worker.on_timer()
    for answer, what in ((hung, 'writing'), (behind, 'closing')):
        with pytest.raises(Overdue, match=f'{what} takes longer than 10 s: the disk does not'):
            answer.result(0.0)
    disk.set()
    assert worker.wait(TIMEOUT_S)
    assert worker.do('more', lambda: 'again').result(TIMEOUT_S) == 'again'
