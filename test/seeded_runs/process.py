# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One run of the program: a host, its drivers, and the requests of clients."""

from dataclasses import replace

from mlmem import threads
from mlmem.physics import StateError
from mlmem_ros.bag import jazzy
from mlmem_ros.contract.streams import STREAMS, find_content
from mlmem_ros.contract.topics import Qos
from mlmem_ros.host import Host, SessionPlan

from .node import Executor, Node
from .script import SESSION_PATH

LEVEL_STREAM = replace(STREAMS['level'], name='/mlmem/level', qos=Qos.RELIABLE)
BEAT_STREAM = replace(LEVEL_STREAM, name='/mlmem/beat')
"""Something to record, every few ticks."""

CLOCK_READING_S = 2e-3
"""Seconds that a look at the pacer's clock takes where no pace is kept: a tick has its time."""

UNSTEADY_POLL_S = 0.02
"""Seconds between two looks at a clock that has shown that it is not steady."""


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


class Process:
    """One run of the program: a host, its node and its executor, and the requests of clients."""

    def __init__(self, run):
        self.run = run
        self.invariants = run.invariants
        self.pacer = Pacer(run.scheduler)
        self.speed = 1.0
        self.loop = None
        self.host = Host(run.invariants.write_line, run.now_ns, failed=self._post_failure)
        self.node = Node(self.host, self._activate_host, run.given)
        callback_failed = run.invariants.report_callback
        self.executor = Executor(run.scheduler, self.host.on_timer, callback_failed)
        self.tickets = []

    def post_step(self, step):
        """Queue a step for the executor."""
        self.executor.post(str(step.what), lambda: self._do_step(step))

    def _post_failure(self):
        self.executor.post('failure', self.node.leave_on_failure)

    def _do_step(self, step):
        host, given = self.host, step.given
        match step.what:
            case 'submit':
                self._watch_request(given, host.submit(given).answer)
            case 'record':
                self._watch_request(
                    ('record', given), host.record(self._plan_session() if given else None)
                )
            case 'pause':
                self._watch_request(('pause', given), host.pause(given))
            case 'step':
                self._watch_request(('step', None), host.step().answer)
            case 'speed':
                self.set_speed(given)
            case 'break':
                self._break_element(forever=given == 'for good')
            case 'cancel':
                if self.tickets:
                    self.tickets[-1].future.cancel()
            case transition:
                before = self.node.state
                refusal = self.node.make_transition(transition)
                self.invariants.check_transition(self, transition, before, refusal)

    def close(self):
        """End it, as a signal would; called by the executor."""
        element = self.host.element if self.host.loop else None
        self.host.close()
        self.invariants.check_closed(self, element)

    def set_speed(self, speed):
        self.speed = speed
        self.pacer.hurried = not 0.0 < speed < 100.0
        self.host.set_speed(speed)

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
        host = self.host
        given = self.run.given
        host.activate(given, self._plan_session(), self._after_ticks, self.pacer, self.speed)

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
