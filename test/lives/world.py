# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A life: one script, lived by a host on a disk, under a scheduler, before the eyes of oracles."""

from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

from mlmem_ros import durable, threads
from mlmem_ros.bag.definitions import jazzy
from mlmem_ros.bag.qos import RELIABLE
from mlmem_ros.device import calibration_file, state_file
from mlmem_ros.device.calibration import calibration_key
from mlmem_ros.host import Host, SessionPlan, worker
from mlmem_ros.physics import StateError

from . import element as small
from .disk import Disk, mounted
from .node import Executor, Node
from .oracles import PATIENCE, Oracles, told
from .primitives import scheduled
from .scheduler import Deadlock, Endless, Scheduler
from .script import SESSION, STATE, Step

ROOT = Path('/disk')
LEVEL = '/mlmem/level', 'std_msgs/msg/Int16', RELIABLE
FLAT_OUT = 2e-3
"""Seconds that a look at the pacer's clock takes where no pace is kept: a tick has its time."""

POLL = 0.02
"""Seconds between two looks at a clock that has shown that it is not steady."""


class Pacer:
    """The clock of a simulation: it runs, stands still, and jumps.

    Attributes:
        slack: As that of ROS time.
        hurried: Whether every look at it takes the time that a tick needs.
    """

    slack = 0.5

    def __init__(self, scheduler):
        self._scheduler = scheduler
        self._ahead = 0.0
        self._stopped_at = None
        self._steady = True
        self.hurried = False

    def now(self):
        if self.hurried:
            self._scheduler.now += FLAT_OUT
        present = threads.monotonic() if self._stopped_at is None else self._stopped_at
        return present + self._ahead

    def wait(self, changed, seconds):
        changed.wait(seconds if self._steady else POLL)  # else who knows how fast it runs

    def change(self, how):
        """Jump by seconds, 'stop' or 'go' on."""
        self._steady = False
        if how == 'stop':
            self._stopped_at = self._scheduler.now
        elif how == 'go':
            self._stopped_at = None
        else:
            self._ahead += how


class Process:
    """One run of the program: a host, its node and its executor, and what clients asked of it."""

    def __init__(self, life):
        self.life = life
        self.oracles = life.oracles
        self.pacer = Pacer(life.scheduler)
        self.speed = 1.0
        self.loop = None
        self.host = Host(life.log, life.now_ns, failed=self._wake)
        self.node = Node(self.host, self._activate, life.given)
        callback_failed = life.oracles.callback_failed
        self.executor = Executor(life.scheduler, self.host.tend, callback_failed)
        self.tickets = []

    def post(self, step):
        """Have the executor do a step."""
        self.executor.post(str(step.what), lambda: self._do(step))

    def _wake(self):
        self.executor.post('failure', self.node.mind_failure)

    def _do(self, step):
        host, given = self.host, step.given
        match step.what:
            case 'submit':
                self._asked(given, host.submit(given))
            case 'record':
                self._asked(('record', given), host.record(self._plan() if given else None))
            case 'pause':
                self._asked(('pause', given), host.pause(given))
            case 'step':
                self._asked(('step', None), host.step())
            case 'speed':
                self.set_speed(given)
            case 'break':
                self._break(forever=given == 'for good')
            case 'cancel':
                if self.tickets:
                    self.tickets[-1].future.cancel()
            case transition:
                before = self.node.state
                refusal = self.node.transit(transition)
                self.oracles.transited(self, transition, before, refusal)

    def close(self):
        """End it, as a signal does; to be called by the executor."""
        element = self.host.element if self.host.loop else None
        self.host.close()
        self.oracles.closed(self, element)

    def set_speed(self, speed):
        self.speed = speed
        self.pacer.hurried = not 0.0 < speed < 100.0
        self.host.set_speed(speed)

    def _break(self, forever):
        element = self.host.element
        if element is None:
            return
        advance = element.advance

        def fails():
            if not forever:
                element.advance = advance
            raise StateError('the chain stopped being finite, as it was told to')

        self.oracles.broken = True
        element.advance = fails

    def _asked(self, what, future):
        self.tickets.append(self.oracles.asked(self, what, future))

    def _plan(self):
        record = replace(self.life.given.record, path=SESSION)
        return SessionPlan('/mlmem', record, (LEVEL,), {})

    def _activate(self):
        host = self.host
        given = self.life.given
        host.activate(given, self._plan(), self._after_ticks, self.pacer, self.speed)

    def _after_ticks(self, events):
        host = self.host
        element = host.element
        self.loop = host.loop or self.loop  # which the host lets go of before its last tick
        self.oracles.ticked(element, events)
        if (recording := host.recording) is not None and element.ticks % 4 == 0:
            level = element.reading.level if element.reading else -2
            message = jazzy().message(LEVEL[1], data=level)
            recording.put(LEVEL[0], jazzy().serialize(message))


@contextmanager
def _impatient():
    """Have the host wait for a disk no longer than a life has time for."""
    with (
        patch.object(worker, 'PATIENCE', PATIENCE),
        patch.object(worker.Worker.wait, '__defaults__', (PATIENCE,)),
    ):
        yield


class Life:
    """A script that is lived.

    Attributes:
        script: What happens.
        scheduler: Under which it happens.
        disk: Where its files are.
        oracles: Which watch it.
        given: What the host is configured with.
    """

    def __init__(self, script):
        self.script = script
        self.scheduler = Scheduler(script.seed)
        self.disk = Disk(self.scheduler)
        self.oracles = Oracles(self)
        self.given = small.parameters(
            record=SESSION if script.record else '',
            state=STATE if script.state else '',
            interval=script.interval,
            sync_interval=script.sync_interval,
        )
        self._process = None

    def live(self):
        """Live it; return what was found wrong."""
        with scheduled(self.scheduler), mounted(self.disk), _impatient():
            self._furnish()
            self._process = Process(self)
            fate = self.scheduler.spawn(self._fate, 'fate', outside=True)
            try:
                self.scheduler.run(fate)
            except (Deadlock, Endless) as error:
                self.oracles.find(f'{type(error).__name__}: {error}')
                self.scheduler.kill()
            for name, failure in self.scheduler.failures:
                self.oracles.find(f'{name} raised {told(failure)}')
        return self.oracles.found

    # --- what the host sees of the world -------------------------------------------------

    def now_ns(self):
        """Return the time of day in nanoseconds."""
        return round(self.scheduler.time() * 1e9)

    @property
    def log(self):
        """Where the host tells what happens."""
        return self.oracles

    # --- fate ----------------------------------------------------------------------------

    def _furnish(self):
        """Put on the disk what an earlier life has left."""
        durable.make_directory(ROOT, exist_ok=True)
        if self.script.state:
            path = Path(STATE)
            key = calibration_key(small.DESIGN, small.SETTINGS)
            calibration_file.save(calibration_file.beside(path), key, small.CALIBRATION)
            if self.script.level >= 0:
                state_file.save(path, small.written(self.script.level))

    def _fate(self):
        """Take the steps, from outside of the process."""
        for step in self.script.steps:
            self.scheduler.sleep(step.after)
            self._go_on_after_crash()
            self.scheduler.note(str(step))
            match step.what:
                case 'crash':
                    self._dies_by, handovers = step.given
                    self.scheduler.crash_at = self.scheduler.handovers + handovers
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
        self.scheduler.crash_at = None
        self._end()
        self.oracles.died('power')

    def _go_on_after_crash(self):
        if not self.scheduler.crashed:
            return False
        self.scheduler.crashed = False
        self.oracles.died(self._dies_by)
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
            self.oracles.ended(process)
            scheduler.kill()
