# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The simulated disk loses what was not synced, and keeps what was, as `durable` needs it."""

import errno
from pathlib import Path

import pytest

from mlmem_ros import durable, threads

from .disk import Disk, mounted
from .primitives import scheduled
from .scheduler import Scheduler

STATE = Path('/state.json')


def live(seed, work, crash_at=None, trouble=''):
    """Run a process on a new disk until it ends or is killed; return the disk without power."""
    scheduler = Scheduler(seed)
    disk = Disk(scheduler)
    with scheduled(scheduler), mounted(disk):
        durable.write_atomically(STATE, 'old')
        disk.trouble = trouble
        scheduler.crash_at = crash_at
        scheduler.spawn(work, 'work')
        scheduler.settle(3600.0)
        assert not scheduler.failures
        disk.cut_power()
    return disk


def content(disk, path=STATE):
    """Return the content of a file; None if there is none."""
    with mounted(disk):
        try:
            return durable.read_text(path)
        except FileNotFoundError:
            return None


def test_what_is_replaced_atomically_is_old_or_new_at_every_crash():
    def work():
        durable.write_atomically(STATE, 'the new content, and longer')

    seen = {content(live(seed, work, crash_at)) for crash_at in range(1, 12) for seed in range(40)}
    assert seen == {'old', 'the new content, and longer'}


def test_what_was_confirmed_is_there():
    for seed in range(200):
        assert content(live(seed, lambda: durable.write_atomically(STATE, 'new'))) == 'new'


def test_without_sync_there_are_seeds_that_lose_it():
    def work():
        flags = durable.os.O_WRONLY | durable.os.O_CREAT
        file = durable.DurableFile(durable.os.open('/.state.new', flags))
        file.write(b'new')
        file.close()
        durable.os.replace('/.state.new', STATE)
        durable.sync_directory(STATE.parent)

    seen = {content(live(seed, work)) for seed in range(40)}
    assert {'', 'new'} <= seen


def test_without_a_sync_of_the_directory_there_are_seeds_that_lose_the_name():
    def work():
        flags = durable.os.O_WRONLY | durable.os.O_CREAT
        file = durable.DurableFile(durable.os.open('/fresh', flags))
        file.write(b'new')
        file.sync()
        file.close()

    assert {content(live(seed, work), '/fresh') for seed in range(40)} == {None, 'new'}


def test_directories_that_were_made_are_there_even_by_two_who_died():
    path = Path('/a/b/c')
    for crash_at in range(1, 30):
        for seed in range(10):
            scheduler = Scheduler(seed)
            disk = Disk(scheduler)
            with scheduled(scheduler), mounted(disk):
                scheduler.crash_at = crash_at
                scheduler.spawn(lambda: durable.make_directory(path, exist_ok=True), 'first')
                scheduler.settle(1.0)
                disk.kill()
                scheduler.spawn(lambda: durable.make_directory(path, exist_ok=True), 'second')
                scheduler.settle(1.0)
                disk.cut_power()
                assert durable.os.path.isdir(path)


@pytest.mark.parametrize('trouble', ['full', 'fails', 'moody'])
def test_a_failed_replacement_leaves_old_or_new_and_no_open_file(trouble):
    told = []

    def work():
        try:
            durable.write_atomically(STATE, 'new')
        except OSError as error:
            told.append(error.errno)

    for seed in range(100):
        disk = live(seed, work, trouble=trouble)
        assert content(disk) in ('old', 'new')
        assert not disk.open_files
    assert errno.ENOSPC in told


def test_a_disk_that_hangs_holds_up_who_called_until_it_is_healed():
    scheduler = Scheduler(1)
    disk = Disk(scheduler)
    ended = []

    def work():
        durable.write_atomically(STATE, 'new')
        ended.append(threads.monotonic())

    with scheduled(scheduler), mounted(disk):
        disk.trouble = 'hangs'
        scheduler.spawn(work, 'work')
        scheduler.settle(100.0)
        assert not ended
        disk.heal()
        scheduler.settle(1.0)
    assert ended == pytest.approx([1100.0], abs=1e-3)
    assert content(disk) == 'new'


def test_what_a_failed_sync_left_is_not_made_safe_by_the_next():
    def work():
        flags = durable.os.O_WRONLY | durable.os.O_CREAT
        descriptor = durable.os.open('/file', flags)
        durable.sync_directory(Path('/'))
        durable.os.write(descriptor, b'one')
        disk_of_work[0].trouble = 'full'
        with pytest.raises(OSError, match='No space'):
            durable.os.fsync(descriptor)
        disk_of_work[0].heal()
        durable.os.fsync(descriptor)

    seen = set()
    for seed in range(40):
        scheduler = Scheduler(seed)
        disk_of_work = [Disk(scheduler)]
        with scheduled(scheduler), mounted(disk_of_work[0]):
            scheduler.spawn(work, 'work')
            scheduler.settle(1.0)
            assert not scheduler.failures
            disk_of_work[0].cut_power()
        seen.add(content(disk_of_work[0], '/file'))
    assert {'', 'one'} <= seen


def test_the_disk_is_written_out_for_real_readers(tmp_path):
    disk = live(1, lambda: durable.make_directory(Path('/a/b')))
    disk.materialise(tmp_path)
    assert (tmp_path / 'state.json').read_text() == 'old'
    assert (tmp_path / 'a' / 'b').is_dir()
