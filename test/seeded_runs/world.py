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

from .disk import Disk, mounted
from .element import KINDS
from .invariants import DISK_TIMEOUT_S, Invariants, describe_error
from .primitives import scheduled
from .process import Process
from .scheduler import Deadlock, Endless, Scheduler
from .script import SESSION, STATE, Step

ROOT = Path('/disk')


@contextmanager
def _impatient():
    """Make the host wait for a disk no longer than a run lasts."""
    with (
        patch.object(worker, 'WORK_TIMEOUT_S', DISK_TIMEOUT_S),
        patch.object(worker.Worker.wait, '__defaults__', (DISK_TIMEOUT_S,)),
    ):
        yield


@contextmanager
def _handing_over(scheduler):
    """Let another task run within a tick, too: before and after the material moves."""
    advance = Simulation.advance

    def advance_in_between(self, *given):
        scheduler.handover('half a tick')
        ends = advance(self, *given)
        scheduler.handover('most of a tick')
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
        self.kind = KINDS[script.levels]
        self.given = self.kind.parameters(
            record=SESSION if script.record else '',
            state=STATE if script.state else '',
            interval=script.interval,
            sync_interval=script.sync_interval,
        )
        self._process = None

    def run(self):
        """Run it, and return what is wrong."""
        present = lambda: self.scheduler.current  # noqa: E731
        watched, within = owned(self.invariants.find, present), _handing_over(self.scheduler)
        with scheduled(self.scheduler), mounted(self.disk), _impatient(), watched, within:
            self._furnish()
            self._process = Process(self)
            fate = self.scheduler.spawn(self._fate, 'fate', outside=True)
            try:
                self.scheduler.run(fate)
            except (Deadlock, Endless) as error:
                self.invariants.find(f'{type(error).__name__}: {error}')
                self.scheduler.kill()
            for name, failure in self.scheduler.failures:
                self.invariants.find(f'{name} raised {describe_error(failure)}')
        return self.invariants.found

    # --- what the host sees of the world -------------------------------------------------

    def now_ns(self):
        """Return the time of day in nanoseconds."""
        return round(self.scheduler.time() * 1e9)

    # --- fate ----------------------------------------------------------------------------

    def _furnish(self):
        """Put the files of an earlier run on the disk."""
        atomic_files.make_directory(ROOT, exist_ok=True)
        if self.script.state:
            path = Path(STATE)
            store.save_snapshot(path, self.kind.written(self.script.level))

    def _fate(self):
        """Take the steps, from outside the process."""
        for step in self.script.steps:
            self.scheduler.sleep(step.after)
            self._go_on_after_crash()
            self.scheduler.note(step)
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
                    self.disk.heal()
                case 'clock':
                    self._process.pacer.change(step.given)
                case 'shutdown':
                    self._end()
                    if not self._go_on_after_crash():
                        self._begin()
                case _:
                    self._process.post(step)
        self.scheduler.sleep(0.5)
        self._go_on_after_crash()
        self.scheduler.crash_at = self.disk.crash_in = None
        self._end()
        self.invariants.died('power')

    def _go_on_after_crash(self):
        if not self.scheduler.crashed:
            return False
        self.scheduler.crashed = False
        self.invariants.died(self._dies_by)
        self._process = Process(self)
        return True

    def _begin(self):
        """Start the program, as a node that starts itself."""
        self._process = Process(self)
        for name in ('configure', 'activate'):
            self._process.post(Step(0.0, name))

    def _end(self):
        """End the program as a signal does; a disk that hangs is healed when all is given up."""
        process, scheduler = self._process, self.scheduler
        process.executor.post('close', process.close)
        process.executor.end()
        for _ in range(30):
            if process.executor.task.ended:
                break
            scheduler.sleep(1.0)
        self.disk.heal()
        scheduler.sleep(1.0)
        if not scheduler.crashed:
            self.invariants.ended(process)
            scheduler.kill()
