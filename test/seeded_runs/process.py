# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the program: a managed node without ROS, its host, and the requests of clients."""

from collections import deque
from dataclasses import replace

from mlmem import threads
from mlmem.physics import StateError
from mlmem_ros.bag import jazzy
from mlmem_ros.contract.streams import STREAMS, find_content
from mlmem_ros.contract.topics import Qos
from mlmem_ros.host import REFUSALS, Host, SessionPlan

from .invariants import describe_error
from .script import SESSION_PATH

LEVEL_STREAM = replace(STREAMS['level'], name='/mlmem/level', qos=Qos.RELIABLE)
BEAT_STREAM = replace(LEVEL_STREAM, name='/mlmem/beat')
"""Something to record, every few ticks."""

CLOCK_READING_S = 2e-3
"""Seconds that a look at the pacer's clock takes where no pace is kept: a tick has its time."""

UNSTEADY_POLL_S = 0.02
"""Seconds between two looks at a clock that has shown that it is not steady."""

TIMER_PERIOD_S = 1.0
"""Seconds between two looks at disks and intervals."""

TRANSITION_STATES = {
    'configure': ('unconfigured', 'inactive'),
    'activate': ('inactive', 'active'),
    'deactivate': ('active', 'inactive'),
    'cleanup': ('inactive', 'unconfigured'),
}
"""Transitions: from which state, and to which."""


class Pacer:
    """The clock of a simulation: it runs, stops, and jumps.

    Attributes:
        slack: As for ROS time.
        hurried: Whether every reading of it takes as long as a tick.
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
            self._scheduler.now += CLOCK_READING_S
        present = threads.monotonic() if self._stopped_at is None else self._stopped_at
        return present + self._ahead

    def wait(self, changed, seconds):
        changed.wait(seconds if self._steady else UNSTEADY_POLL_S)

    def change_clock(self, how):
        """Jump by seconds, 'stop' or 'go' on."""
        self._steady = False
        if how == 'stop':
            self._stopped_at = self._scheduler.now
        elif how == 'go':
            self._stopped_at = None
        else:
            self._ahead += how


class Executor:
    """Runs callbacks one after the other, as rclpy's does, and tends the host in between.

    Attributes:
        longest: Name and seconds of the callback that took longest.
    """

    def __init__(self, scheduler, on_timer, report):
        """Begin, with nothing to do.

        Args:
            scheduler: The scheduler under which it runs.
            on_timer: Called every `TIMER_PERIOD_S` seconds.
            report: Called with what a callback raised.
        """
        self.longest = '', 0.0
        self._on_timer = on_timer
        self._report = report
        self._waiting = deque()
        self._ending = False
        self._idle = False
        self._scheduler = scheduler
        self.task = scheduler.spawn(self._run_callbacks, 'executor')

    def post(self, name, callback):
        """Queue a callback; any thread may call."""
        self._waiting.append((name, callback))
        self._make_ready()

    def end(self):
        """Run no more callbacks than those that wait."""
        self._ending = True
        self._make_ready()

    def _make_ready(self):
        if self._idle:  # and does not wait for something within a callback
            self._scheduler.wake(self.task)

    def _run_callbacks(self):
        due = threads.monotonic() + TIMER_PERIOD_S
        while (turn := self._take_next(due)) is not None:
            name, callback = turn
            begun = threads.monotonic()
            try:
                callback()
            except Exception as failure:
                self._report(f'callback {name} raised {describe_error(failure)}')
            took = threads.monotonic() - begun
            self.longest = max(self.longest, (name, took), key=lambda pair: pair[1])
            if name == 'on_timer':
                due = threads.monotonic() + TIMER_PERIOD_S

    def _take_next(self, due):
        while not self._waiting:
            if self._ending:
                return None
            remaining = due - self._scheduler.now
            self._idle = remaining > 0.0
            woken = self._idle and self._scheduler.block('something to do', remaining)
            self._idle = False
            if not woken:
                return 'on_timer', self._on_timer
        return self._waiting.popleft()


class Process:
    """One run of the program.

    Attributes:
        state: Of its life cycle.
        loop: The last loop of its host.
        tickets: The requests of its clients.
    """

    def __init__(self, run):
        self.run = run
        self.invariants = run.invariants
        self.pacer = Pacer(run.scheduler)
        self.speed = 1.0
        self.loop = None
        self.state = 'unconfigured'
        self.host = host = Host(
            run.invariants.write_line, lambda: round(run.scheduler.time() * 1e9),
            failed=lambda: self.executor.post('failure', self._leave_on_failure),
        )  # fmt: skip
        self.executor = Executor(run.scheduler, host.on_timer, run.invariants.report)
        self.tickets = []
        self._transitions = {
            'configure': lambda: host.adopt_device(host.prepare_device(run.given)),
            'activate': self._activate_host,
            'deactivate': host.deactivate,
            'cleanup': host.release_device,
        }

    def post_step(self, step):
        """Queue a step for the executor."""
        self.executor.post(str(step.what), lambda: self._do_step(step))

    def _do_step(self, step):
        host, given = self.host, step.given
        match step.what:
            case 'submit':
                self._watch_request(given, host.submit(given).answer)
            case 'record':
                plan = self._plan_session() if given else None
                self._watch_request(('record', given), host.record(plan))
            case 'pause':
                self._watch_request(('pause', given), host.pause(given))
            case 'step':
                self._watch_request(('step', None), host.step().answer)
            case 'speed':
                self.speed = given
                self.pacer.hurried = not 0.0 < given < 100.0
                host.set_speed(given)
            case 'break':
                self._break_element(forever=given == 'for good')
            case 'cancel':
                if self.tickets:
                    self.tickets[-1].future.cancel()
            case transition:
                before = self.state
                refusal = self._make_transition(transition)
                self.invariants.check_transition(self, transition, before, refusal)

    def close(self):
        """End it, as a signal would; called by the executor."""
        element = self.host.element if self.host.loop else None
        self.host.close()
        if element is not None:
            self.invariants.check_stopped(self, element)

    def _make_transition(self, name):
        """Make a transition; return None, or why it failed or was refused."""
        begins, ends = TRANSITION_STATES[name]
        if self.state != begins:
            return f'{name} is refused while {self.state}'
        try:
            self._transitions[name]()
        except REFUSALS as refusal:
            if self.host.failure is not None:
                self._release_failed()
            return str(refusal)
        except Exception:
            self._release_failed()
            raise
        self.state = ends
        return None

    def _leave_on_failure(self):
        if self.host.failure is not None:
            self._make_transition('deactivate')

    def _release_failed(self):
        self.state = 'unconfigured'
        self.host.release_failed()

    def _break_element(self, forever):
        element = self.host.element
        if element is None:
            return
        advance = element.advance

        def fails(*_):
            if not forever:
                element.advance = advance
            raise StateError(reason='the chain stopped being finite, as it was told to')

        self.invariants.broken = True
        element.advance = fails

    def _watch_request(self, what, future):
        self.tickets.append(self.invariants.watch_request(self, what, future))

    def _plan_session(self):
        record = replace(self.run.given.record, path=SESSION_PATH)
        return SessionPlan('/mlmem', record, (LEVEL_STREAM, BEAT_STREAM), {})

    def _activate_host(self):
        plan = self._plan_session()
        self.host.activate(self.run.given, plan, self._after_ticks, self.pacer, self.speed)

    def _after_ticks(self, events):
        host = self.host
        element = host.element
        self.loop = host.loop or self.loop  # which the host lets go of before its last tick
        self.invariants.truth.check_tick(element, events)
        if (recording := host.recording) is not None:
            level = jazzy.encode_message(LEVEL_STREAM.type, data=find_content(element, None))
            reported = [LEVEL_STREAM for event in events if LEVEL_STREAM.reports_event(event)]
            for topic in (*reported, *([BEAT_STREAM] if element.ticks % 4 == 0 else ())):
                recording.put(topic.name, level)
