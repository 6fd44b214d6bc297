# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated disk shows what a crash leaves of a file."""

from pathlib import Path

from mlmem import atomic_files

from .disk import Disk, mount_disk
from .primitives import use_scheduler
from .scheduler import Scheduler

STATE_PATH, LONGER = Path('/state.json'), 'the new content, and longer'


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
