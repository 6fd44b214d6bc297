# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated scheduler finds lost updates, and the disk what a crash leaves of a file."""

from contextlib import nullcontext
from pathlib import Path

from mlmem import atomic_files, threads

from .disk import Disk, mount_disk
from .primitives import use_scheduler
from .scheduler import Scheduler

STATE_PATH, LONGER = Path('/state.json'), 'the new content, and longer'


def count_to_two(seed, locked):
    """Let two threads add one each; return the total."""
    total = [0]

    def main():
        lock = threads.Lock()

        def add():
            with lock if locked else nullcontext():
                before = total[0]
                threads.monotonic()  # the scheduler may switch here
                total[0] = before + 1

        started = [threads.Thread(target=add, name=f'adder {k}') for k in range(2)]
        for thread in started:
            thread.start()
        for thread in started:
            thread.join()

    scheduler = Scheduler(seed)
    with use_scheduler(scheduler):
        scheduler.run(scheduler.spawn(main, 'main'))
    return total[0]


def test_scheduler_finds_a_lost_update_that_a_lock_prevents():
    assert {count_to_two(seed, locked=False) for seed in range(50)} == {1, 2}
    assert {count_to_two(seed, locked=True) for seed in range(50)} == {2}


def write_until_crash(seed, crash_at):
    """Replace a file, in a process that is killed; return what a power cut leaves."""
    scheduler = Scheduler(seed)
    disk = Disk(scheduler)
    with use_scheduler(scheduler), mount_disk(disk):
        atomic_files.write_atomically(STATE_PATH, 'old')
        scheduler.crash_at = crash_at
        scheduler.spawn(lambda: atomic_files.write_atomically(STATE_PATH, LONGER), 'work')
        scheduler.settle(3600.0)
        assert not scheduler.failures
        disk.cut_power()
        return atomic_files.read_text(STATE_PATH)


def test_atomic_write_leaves_old_or_new_after_every_crash():
    found = {write_until_crash(seed, crash) for crash in range(1, 12) for seed in range(40)}
    assert found == {'old', LONGER}
