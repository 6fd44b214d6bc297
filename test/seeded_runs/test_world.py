# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated scheduler and disk find lost updates and lost files, and repeat them by seed."""

from pathlib import Path

from mlmem import atomic_files, threads

from .disk import Disk, mount_disk
from .primitives import use_scheduler
from .scheduler import Scheduler

STATE_PATH = Path('/state.json')


def count_to_two(seed, locked):
    """Let two threads add one each; return the total and the history of the threads."""
    total = [0]

    def main():
        lock = threads.Lock()

        def add():
            if locked:
                lock.acquire()
            before = total[0]
            threads.monotonic()  # the scheduler may switch here
            total[0] = before + 1
            if locked:
                lock.release()

        started = [threads.Thread(target=add, name=f'adder {k}') for k in range(2)]
        for thread in started:
            thread.start()
        for thread in started:
            thread.join()

    scheduler = Scheduler(seed)
    with use_scheduler(scheduler):
        scheduler.run(scheduler.spawn(main, 'main'))
    return total[0], list(scheduler.history)


def test_scheduler_finds_a_lost_update_that_a_lock_prevents():
    assert {count_to_two(seed, locked=False)[0] for seed in range(50)} == {1, 2}
    assert {count_to_two(seed, locked=True)[0] for seed in range(50)} == {2}


def test_scheduler_repeats_a_history_by_its_seed():
    assert count_to_two(7, locked=True) == count_to_two(7, locked=True)
    assert len({str(count_to_two(seed, locked=True)) for seed in range(20)}) > 10


def run_on_disk(seed, work, crash_at=None):
    """Run a process on a new disk until it ends or is killed; return what a power cut leaves."""
    scheduler = Scheduler(seed)
    disk = Disk(scheduler)
    with use_scheduler(scheduler), mount_disk(disk):
        atomic_files.write_atomically(STATE_PATH, 'old')
        scheduler.crash_at = crash_at
        scheduler.spawn(work, 'work')
        scheduler.settle(3600.0)
        assert not scheduler.failures
        disk.cut_power()
        return atomic_files.read_text(STATE_PATH)


def test_atomic_write_leaves_old_or_new_after_every_crash():
    def work():
        atomic_files.write_atomically(STATE_PATH, 'the new content, and longer')

    found = {run_on_disk(seed, work, crash_at) for crash_at in range(1, 12) for seed in range(40)}
    assert found == {'old', 'the new content, and longer'}


def test_atomic_write_that_returned_survives_a_power_cut():
    for seed in range(200):
        assert run_on_disk(seed, lambda: atomic_files.write_atomically(STATE_PATH, 'new')) == 'new'


def test_write_without_sync_is_lost_on_some_disks():
    def work():
        flags = atomic_files.os.O_WRONLY | atomic_files.os.O_CREAT
        file = atomic_files.DurableFile(atomic_files.os.open('/.state.new', flags))
        file.write(b'new')
        file.close()
        atomic_files.os.replace('/.state.new', STATE_PATH)
        atomic_files.sync_directory(STATE_PATH.parent)

    assert {'', 'new'} <= {run_on_disk(seed, work) for seed in range(40)}
