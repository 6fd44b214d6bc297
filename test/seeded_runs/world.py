# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A run: the script of a seed, carried out by a host on a disk, under a scheduler, watched by
invariants.
"""

from pathlib import Path
from pprint import pformat
from unittest.mock import patch

from owner import owned

from mlmem import atomic_files
from mlmem.instrument.drivers import Simulation
from mlmem_ros.host import store, worker
from mlmem_ros.host.settings import GROUPS, Parameters, RecordSettings, StateSettings

from .disk import Disk, mount_disk
from .invariants import DISK_TIMEOUT_S, Invariants, describe_error
from .process import Process
from .scheduler import Deadlock, Endless, Scheduler, use_scheduler
from .script import DISK_PATH, ELEMENT_KINDS, SESSION_PATH, STATE_PATH, Step, make_script


def _hand_over_within_ticks(scheduler):
    """Let another task run within a tick, too: before and after the material moves."""
    advance = Simulation.advance

    def advance_in_between(self, *given):
        scheduler.hand_over('half a tick')
        ends = advance(self, *given)
        scheduler.hand_over('most of a tick')
        return ends

    return patch.object(Simulation, 'advance', advance_in_between)


class SeededRun:
    """The run with this number.

    Attributes:
        disk: The disk with its files.
        invariants: The invariants that watch it.
        given: The configuration of the host.
    """

    @property
    def element(self):
        """The device of the present process."""
        return self._process.host.element

    def __init__(self, seed):
        self.script = script = make_script(seed)
        self.scheduler = Scheduler(seed)
        self.disk = Disk(self.scheduler)
        self.invariants = Invariants(self)
        self.kind = ELEMENT_KINDS[script.levels]
        record = SESSION_PATH if script.record else ''
        state = STATE_PATH if script.state else ''
        self.given = Parameters(
            design=self.kind.design,
            check='skip',
            settings=self.kind.settings,
            **GROUPS
            | {
                'record': RecordSettings(record, script.sync_interval, hash_every=20),
                'state': StateSettings(state, script.interval),
            },
        )
        self._process = None

    def run(self):
        """Run it, and return what is wrong."""
        scheduler, invariants = self.scheduler, self.invariants
        with (
            use_scheduler(scheduler),
            mount_disk(self.disk),
            patch.object(worker, 'WORK_TIMEOUT_S', DISK_TIMEOUT_S),
            patch.object(worker.Worker.wait, '__defaults__', (DISK_TIMEOUT_S,)),
            owned(invariants.report, here=lambda: scheduler.current),
            _hand_over_within_ticks(scheduler),
        ):
            atomic_files.make_directory(Path(DISK_PATH), exist_ok=True)
            if self.script.state:
                earlier = self.kind.make_snapshot(self.script.level)
                store.save_snapshot(Path(STATE_PATH), earlier)
            self._process = Process(self)
            fate = scheduler.spawn(self._take_steps, 'fate', outside=True)
            try:
                scheduler.run(fate)
            except (Deadlock, Endless) as error:
                invariants.report(f'{type(error).__name__}: {error}')
                scheduler.kill()
            for name, failure in scheduler.failures:
                invariants.report(f'{name} raised {describe_error(failure)}')
        return invariants.found

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
                        self._process = Process(self)
                        for name in ('configure', 'activate'):  # as a node starts itself
                            self._process.post_step(Step(0.0, name))
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


def describe_run(seed):
    """Do the run with this number, and describe it."""
    run = SeededRun(seed)
    found = run.run()
    lines = [
        f'{at:12.6f}  {who}: {" ".join(map(str, what)) if isinstance(what, tuple) else what}'
        for at, who, what in run.scheduler.history
    ]
    findings = [f'FOUND {finding}' for finding in found] or ['nothing is wrong']
    return '\n'.join([*lines, '', pformat(run.script, width=99), '', *findings])
