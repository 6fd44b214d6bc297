# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Work that waits for a disk: in order, answered once, within PATIENCE."""

import threading

import pytest

from mlmem import Refused, threads
from mlmem_ros.bag.errors import BagError
from mlmem_ros.host import Overdue
from mlmem_ros.host.worker import WORK_TIMEOUT_S, Worker

SOON = 60.0
"""Longest wait in seconds, on a loaded machine."""


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


def test_work_is_done_in_order_and_its_thread_ends_with_it(worker):
    done = []
    answers = [worker.do('work', lambda n=n: done.append(n) or n) for n in range(50)]
    assert [answer.result(SOON) for answer in answers] == list(range(50)) == done
    assert worker.wait(SOON)
    for thread in alive():
        thread.join(SOON)
    assert not alive()
    assert worker.do('more', lambda: 'again').result(SOON) == 'again'


def test_refusals_go_to_the_caller_and_defects_also_to_the_log(worker, throttled, log):
    def fail(error):
        raise error

    refused = worker.do('work', lambda: fail(BagError('the disk is full')))
    assert str(refused.exception(SOON)) == 'the disk is full'
    assert throttled.caught == 0
    defect = worker.do('work', lambda: fail(KeyError('views')))
    assert isinstance(defect.exception(SOON), KeyError)
    assert worker.wait(SOON)
    assert throttled.caught == 1
    assert 'work failed; this is a fault in the software' in log.of('error')[0]


def test_waiting_for_a_disk_that_hangs_ends_with_an_error(worker, disk, later):
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
    assert worker.wait(SOON)
    assert worker.do('more', lambda: 'again').result(SOON) == 'again'


def test_a_wait_is_limited_and_cancels_what_it_waited_for(worker, disk):
    hung = worker.do('writing', disk.wait)
    assert not worker.wait(0.01)
    assert isinstance(hung.exception(0.0), Overdue)


def test_a_step_that_comes_too_late_is_not_taken(worker, disk, later):
    taken = []

    def work():
        disk.wait()
        worker.unless_given_up(lambda: taken.append(1))

    wanted = worker.do('work', lambda: worker.unless_given_up(lambda: 'in time'))
    assert wanted.result(SOON) == 'in time'
    late = worker.do('work', work)
    later()
    worker.on_timer()
    disk.set()
    assert worker.wait(SOON)
    assert isinstance(late.exception(0.0), Overdue)
    assert not taken


def test_a_refused_step_is_answered_once(worker, disk, later, throttled):
    """It was answered before; its refusal is no defect either."""
    late = worker.do('work', lambda: disk.wait() and worker.unless_given_up(int))
    later()
    worker.on_timer()
    disk.set()
    assert worker.wait(SOON)
    assert not isinstance(late.exception(0.0), Refused)
    assert throttled.caught == 0


def test_a_thread_that_does_not_start_is_not_waited_for_ever(worker, monkeypatch):
    """Its job is refused with the reason, and the next one is done."""

    class NoThread:
        def __init__(self, **_):
            pass

        def start(self):
            raise RuntimeError("can't start new thread")

    with monkeypatch.context() as patch:
        patch.setattr(threads, 'Thread', NoThread)
        refused = worker.do('saving', lambda: 1)
        with pytest.raises(Refused, match="saving is not possible: can't start new thread"):
            refused.result(SOON)
        assert worker.wait(0.0)
    assert worker.do('saving', lambda: 2).result(SOON) == 2
