# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The host of an element: its life cycle, and every request to it."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from .. import threads
from ..device import (
    Command,
    DriverError,
    Event,
    Faults,
    Loop,
    MemoryElement,
    Outcome,
    Read,
    Refused,
    SetFaults,
    SettingsError,
    describe_level,
    drivers,
)
from ..device.commands import Procedures
from ..device.loop import Stamped
from ..device.pacing import Pacer
from ..device.progress import Feedback
from ..device.units import Units
from ..physics import StateError
from .design_check import check_design
from .journal import Journal, Log
from .rescue import Rescue, let_go
from .sessions import Sessions
from .settings import Parameters, SessionPlan
from .store import Store
from .worker import Worker

if TYPE_CHECKING:
    from .transcript import Transcript

T = TypeVar('T')

Listener = Callable[[Sequence[Event]], None]
"""Called in the loop's thread after every tick, or run of ticks."""

INACTIVE = 'inactive: configure and activate the node first'


class Host:
    """Holds one element, from configuration to release.

    Its life cycle is that of a managed node. One thread, the executor's, calls `configure`,
    `activate`, `deactivate`, `release`, `fail` and `tend`; requests may come from any thread.

    Attributes:
        journal: The log.
        element: The device; None while unconfigured.
        loop: Runs it while active; otherwise None.
        sessions: Its recording.
        stopped: Why the device last stopped, until it is configured again; empty if it did not.
        refused: Requests refused since the host was made.
        lost: How often the content or the recording could not be saved at the end of a life.
    """

    def __init__(
        self,
        log: Log,
        now: Callable[[], int],
        *,
        name: str = '/mlmem',
        failed: Callable[[], None] = lambda: None,
    ) -> None:
        """Create an empty host.

        Args:
            log: Where log lines go.
            now: Returns the time of recorded messages in nanoseconds.
            name: Of the node, which owns its state file.
            failed: Called in the loop's thread when the device has failed: `fail` is due.
        """
        self.journal = Journal(log)
        self.element: MemoryElement | None = None
        self.loop: Loop | None = None
        self.stopped = ''
        self.refused = 0
        self.lost = 0
        self._name = name
        self._failed = failed
        self._root = ''
        self._store: Store | None = None
        self._disk = Worker('mlmem-store', self.journal)
        self._rescue = Rescue(self.journal)
        self.sessions = Sessions(lambda: self._root, self.journal, now)

    @property
    def failure(self) -> Exception | None:
        """Why the device stopped while active, or None."""
        return self.loop.failure if self.loop is not None else None

    @property
    def transcript(self) -> Transcript | None:
        """What takes all messages: a session, the last seconds, or None."""
        return self.sessions.transcript

    # --- life cycle ----------------------------------------------------------------------

    def configure(self, given: Parameters) -> MemoryElement:
        """Check the design, build the device, restore its content.

        Raises:
            One of `REFUSALS`: Nothing is changed.
        """
        self._root = given.files.root
        check_design(given.design, given.settings, given.check, self.journal)
        with ExitStack() as undo:
            driver = drivers.opened(
                given.device.driver, given.device.address, given.design, given.settings
            )
            undo.callback(driver.close)
            store = Store(given.state, given.files.root, self.journal, self._disk, self._name)
            undo.callback(store.close)
            element = store.new_element(given.design, given.settings, driver)
            _check_faults(element, given.faults)
            store.restore(element)
            undo.pop_all()
        self.stopped = ''
        self._rescue.restore(element)
        self.element, self._store = element, store
        return element

    def activate(
        self,
        given: Parameters,
        plan: SessionPlan,
        listener: Listener,
        pacer: Pacer,
        speed: float,
        heard: Callable[[], bool] = lambda: True,
    ) -> None:
        """Start time, and a recording if a path is set.

        Args:
            given: The configuration, with the present faults and recording.
            plan: What a session records.
            listener: Called after ticks with their events.
            pacer: The clock.
            speed: Multiple of real time; 0: as fast as possible.
            heard: Returns whether anybody subscribes to a stream.

        Raises:
            One of `REFUSALS`: Nothing is changed.
        """
        assert self.element is not None
        element = self.element
        if given.record.path:
            self.sessions.begin(plan, element)
        if given.record.last_seconds:
            self.sessions.keep(plan, element)
        guard = self.journal.guarded

        def listen(commands: Sequence[Stamped], events: Sequence[Event]) -> None:
            with guard('publishing'):
                listener(events)
            for event in events:
                if isinstance(event, Outcome):
                    self.journal.info(_line(event), event.procedure)
            if (transcript := self.transcript) is not None:
                with guard('recording'):
                    transcript.tick(element, commands)

        loop = Loop(
            element,
            listen,
            pacer=pacer,
            speed=0.0 if element.driver.own_clock else speed,
            batch=given.publish.common_ticks,
            publish_every=math.gcd(given.publish.every, given.record.hash_every),
            heard=lambda: self.transcript is not None or heard(),
            failed=self._failed,
        )
        if given.faults != element.faults:
            loop.submit(SetFaults(given.faults))
        self.loop = loop
        loop.start()

    def deactivate(self) -> None:
        """Abort any procedure, bring the strain to zero, close the recording, save the content.

        Raises:
            Refused: The node is not active.
            StateError: The device has failed: `fail` is due.
        """
        loop = self.open_loop()
        loop.finish()
        if loop.failure is not None:
            raise StateError(f'the device has stopped: {loop.failure}')
        self.loop = None
        self._put_away(loop.element)

    def fail(self) -> None:
        """Save what can be saved of a failed device, and release it."""
        loop, self.loop = self.loop, None
        element = self.element
        if loop is not None and element is not None:
            loop.stop()
            self.stopped = f'the device has stopped: {loop.failure}'
            self.journal.error(self.stopped)
            self._end_recording(None)
            self.journal.error(f'{self._save_failed(element)}; configure and activate to go on')
        self.release()

    def release(self) -> None:
        """Release the device."""
        if self._store is not None:
            self._store.close()
        if self.element is not None:
            with self.journal.guarded('releasing the element'):
                try:
                    self.element.driver.close()
                except DriverError as error:
                    self.journal.error(str(error))
        self.element = self._store = None

    def close(self) -> None:
        """Shut down, whatever the device is doing: stop, save and release it."""
        if self.loop is not None:
            try:
                self.deactivate()
            except StateError:
                self.fail()
        self.release()

    def tend(self) -> None:
        """Save at intervals, and answer overdue requests; call it once a second."""
        self.sessions.tend()
        if self._store is not None:
            self._store.tend(self.loop)

    # --- requests ------------------------------------------------------------------------

    def open_loop(self) -> Loop:
        """Return the running loop.

        Raises:
            Refused: The node is not active.
        """
        if (loop := self.loop) is None:
            raise Refused(INACTIVE)
        return loop

    def submit(self, command: Command) -> Future[Outcome | None]:
        """Hand in a command for the next tick; see `Loop.submit`.

        With a state file, the outcome comes after the changed content is safe on the disk; if it
        cannot be saved, the outcome is a failure.
        """
        return self._counted(lambda loop: self._kept(loop, command))

    def submit_scaled(self, make: Callable[[Units], Command]) -> Future[Outcome | None]:
        """Hand in a command given in SI values, converted to the device's units."""
        return self._counted(lambda loop: self._kept(loop, make(loop.element.units)))

    def cancel(self, command: Command) -> Future[Outcome | None]:
        """Abort the procedure of a command; see `Loop.cancel`."""
        return self._counted(lambda loop: self._saved(loop, loop.cancel(command)))

    def feedback(self, command: Command) -> Feedback | None:
        """Return the progress of a command's procedure, if it is running."""
        element = self.element
        return element.feedback() if element is not None and element.runs(command) else None

    def step(self) -> Future[int]:
        """Run one tick while paused; see `Loop.single_tick`."""
        return self._counted(lambda loop: loop.single_tick())

    def pause(self, paused: bool) -> Future[int]:
        """Pause or resume time; see `Loop.pause`."""
        return self._counted(lambda loop: loop.pause(paused))

    def record(self, plan: SessionPlan | None) -> Future[Path]:
        """Begin a recording, or without a plan end it; see `Sessions`."""
        if plan is None:
            return self._counted(self.sessions.stop)
        return self._counted(lambda loop: self.sessions.start(plan, loop))

    def be_faulty(self, faults: Faults) -> None:
        """Hand in faults if time runs; otherwise they take effect at the next activation."""
        if self.loop is not None:
            self.submit(SetFaults(faults))

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time; 0: as fast as possible."""
        if self.loop is not None and not self.loop.element.driver.own_clock:
            self.loop.set_speed(speed)

    def _counted(self, ask: Callable[[Loop], Future[T]]) -> Future[T]:
        try:
            answer = ask(self.open_loop())
        except Refused as refusal:
            answer = threads.Future()
            answer.set_exception(refusal)
        answer.add_done_callback(self._count)
        return answer

    def _count(self, answer: Future[Any]) -> None:
        if not answer.cancelled() and isinstance(answer.exception(), Refused):
            self.refused += 1

    def _kept(self, loop: Loop, command: Command) -> Future[Outcome | None]:
        answer = loop.submit(command)
        changing = isinstance(command, Procedures) and not isinstance(command, Read)
        return self._saved(loop, answer) if changing else answer

    def _saved(self, loop: Loop, answer: Future[Outcome | None]) -> Future[Outcome | None]:
        return self._store.once_saved(answer, loop.element) if self._store else answer

    # --- end of a life -------------------------------------------------------------------

    def _put_away(self, element: MemoryElement) -> bool:
        """Save all of a device whose time has stopped; return whether that succeeded."""
        self._end_recording(element)
        assert self._store is not None
        kept = self._store.keep(element)
        saved = self._store.settle() and kept.exception() is None
        self.lost += not saved
        return saved

    def _save_failed(self, element: MemoryElement) -> str:
        """Save what can be saved of a failed device; return a message that says what."""
        if not element.simulated:
            if not element.procedure:
                self._put_away(element)
            return 'its content is in the element'
        if not let_go(element, self.journal):
            self.lost += 1
            return 'its content is as last saved'
        if self._put_away(element) and self._store is not None and self._store.path is not None:
            return 'its content is saved'
        self._rescue.keep(element)
        return 'its content is kept until the next configuration'

    def _end_recording(self, element: MemoryElement | None) -> None:
        if not self.sessions.close(element):
            self.lost += 1


def _line(outcome: Outcome) -> str:
    """Return a log line on how a procedure ended."""
    ticks = outcome.end_tick - outcome.start_tick
    if not outcome.success:
        return f'{outcome.procedure} failed after {ticks} ticks: {outcome.error}'
    found = f': {describe_level(outcome.reading.level)}' if outcome.reading else ''
    return f'{outcome.procedure} succeeded after {ticks} ticks{found}'


def _check_faults(element: MemoryElement, faults: Faults) -> None:
    try:
        element.specimen(faults)
    except Refused as refusal:
        raise SettingsError(f'parameters {refusal}') from refusal
