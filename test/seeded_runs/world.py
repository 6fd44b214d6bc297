# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run: a script, carried out by a host on a disk, under a scheduler, watched by invariants."""

from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

from owner import owned

from mlmem import atomic_files
from mlmem.instrument.drivers import Simulation
from mlmem_ros.host import store, worker

from .disk import Disk, mount_disk
from .element import ELEMENT_KINDS
from .invariants import DISK_TIMEOUT_S, Invariants, describe_error
from .primitives import use_scheduler
from .process import Process
from .scheduler import Deadlock, Endless, Scheduler
from .script import SESSION_PATH, STATE_PATH, Step

DISK_ROOT = Path('/disk')


@contextmanager
def _shorten_timeouts():
    """Make the host wait for a disk no longer than a run lasts."""
    with (
        patch.object(worker, 'WORK_TIMEOUT_S', DISK_TIMEOUT_S),
        patch.object(worker.Worker.wait, '__defaults__', (DISK_TIMEOUT_S,)),
    ):
        yield


@contextmanager
def _hand_over_within_ticks(scheduler):
    """Let another task run within a tick, too: before and after the material moves."""
    advance = Simulation.advance

    def advance_in_between(self, *given):
        scheduler.hand_over('half a tick')
        ends = advance(self, *given)
        scheduler.hand_over('most of a tick')
        return ends

    with patch.object(Simulation, 'advance', advance_in_between):
        yield


class SeededRun:
    """A run from a script.

    Attributes:
        disk: The disk with its files.
        invariants: The invariants that watch it.
        given: The configuration of the host.
    """

    @property
    def element(self):
        """The device of the present process."""
        return self._process.host.element

    def __init__(self, script):
        self.script = script
        self.scheduler = Scheduler(script.seed)
        self.disk = Disk(self.scheduler)
        self.invariants = Invariants(self)
        self.kind = ELEMENT_KINDS[script.levels]
        self.given = self.kind.make_parameters(
            record=SESSION_PATH if script.record else '',
            state=STATE_PATH if script.state else '',
            interval=script.interval,
            sync_interval=script.sync_interval,
        )
        self._process = None

    def run(self):
        """Run it, and return what is wrong."""
        present = lambda: self.scheduler.current  # noqa: E731
        watched, within = (
            owned(self.invariants.report, present),
            _hand_over_within_ticks(self.scheduler),
        )
        with (
            use_scheduler(self.scheduler),
            mount_disk(self.disk),
            _shorten_timeouts(),
            watched,
            within,
        ):
            self._write_earlier_files()
            self._process = Process(self)
            fate = self.scheduler.spawn(self._take_steps, 'fate', outside=True)
            try:
                self.scheduler.run(fate)
            except (Deadlock, Endless) as error:
                self.invariants.report(f'{type(error).__name__}: {error}')
                self.scheduler.kill()
            for name, failure in self.scheduler.failures:
                self.invariants.report(f'{name} raised {describe_error(failure)}')
        return self.invariants.found

    # --- what the host sees of the world -------------------------------------------------

    def now_ns(self):
        """Return the time of day in nanoseconds."""
        return round(self.scheduler.time() * 1e9)

    # --- fate ----------------------------------------------------------------------------

    def _write_earlier_files(self):
        """Put the files of an earlier run on the disk."""
        atomic_files.make_directory(DISK_ROOT, exist_ok=True)
        if self.script.state:
            path = Path(STATE_PATH)
            store.save_snapshot(path, self.kind.make_snapshot(self.script.level))

    def _take_steps(self):
        """Take the steps, from outside the process."""
        for step in self.script.steps:
            self.scheduler.sleep(step.after)
            self._restart_after_crash()
            self.scheduler.add_note(step)
            match step.what:
                case 'crash':
                    self._dies_by, counted, number = step.given
                    if counted == 'calls':
                        self.disk.crash_in = number
                    else:
                        self.scheduler.crash_at = self.scheduler.handovers + number
                case 'trouble':
                    self.disk.trouble = step.given
                case 'heal':
                    self.disk.clear_trouble()
                case 'clock':
                    self._process.pacer.change_clock(step.given)
                case 'shutdown':
                    self._end_process()
                    if not self._restart_after_crash():
                        self._start_process()
                case _:
                    self._process.post_step(step)
        self.scheduler.sleep(0.5)
        self._restart_after_crash()
        self.scheduler.crash_at = self.disk.crash_in = None
        self._end_process()
        self.invariants.check_after_death('power')

    def _restart_after_crash(self):
        if not self.scheduler.crashed:
            return False
        self.scheduler.crashed = False
        self.invariants.check_after_death(self._dies_by)
        self._process = Process(self)
        return True

    def _start_process(self):
        """Start the program, as a node that starts itself."""
        self._process = Process(self)
        for name in ('configure', 'activate'):
            self._process.post_step(Step(0.0, name))

    def _end_process(self):
        """End the program as a signal does; a disk that hangs is healed when all is given up."""
        process, scheduler = self._process, self.scheduler
        process.executor.post('close', process.close)
        process.executor.end()
        for _ in range(30):
            if process.executor.task.ended:
                break
            scheduler.sleep(1.0)
        self.disk.clear_trouble()
        scheduler.sleep(1.0)
        if not scheduler.crashed:
            self.invariants.check_end(process)
            scheduler.kill()
