# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The host of an element: its life cycle beside the requests to it, and what a failure leaves."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from mlmem import (
    Abort,
    Asked,
    Command,
    DriverError,
    ErrorCode,
    Event,
    Faults,
    Feedback,
    Loop,
    MemoryElement,
    Outcome,
    Pacer,
    Refused,
    Request,
    SetFaults,
    SetMethod,
    Stamped,
    StateError,
    is_kernel_cached,
    snapshot,
)

from .building import Built, build_device
from .sessions import Sessions
from .settings import Parameters, SessionPlan
from .worker import REFUSALS, ThrottledLog, Worker, WriteLine

if TYPE_CHECKING:
    from .recording import Recording

T = TypeVar('T')

TickListener = Callable[[Sequence[Event]], None]
"""Called in the loop's thread after every tick, or run of ticks."""


class Host:
    """Holds one element, from configuration to release.

    Its life cycle is that of a managed node. One thread, the executor's, calls `adopt_device`,
    `activate`, `deactivate`, `release_device` and `on_timer`; requests may come from any thread.
    Each is answered or refused.

    Attributes:
        loop: Its running loop; None while it is not active.
        stopped: Why there is no device, if it has stopped or is waited for; empty otherwise.
        preparing: What is being done to configure the device; empty if nothing is.
        held_up: What its time waits for, such as /clock; empty if for nothing.
    """

    def __init__(
        self,
        write_line: WriteLine,
        now: Callable[[], int],
        *,
        name: str = '/mlmem',
        failed: Callable[[], None] = lambda: None,
    ) -> None:
        """Create an empty host.

        Args:
            write_line: Writes to the log.
            now: Returns the time of recorded messages in nanoseconds.
            name: Of the node, which owns its state file.
            failed: Called in the loop's thread if the device fails: `release_failed` is due.
        """
        self.log = ThrottledLog(write_line)
        self.loop: Loop | None = None
        self.sessions = Sessions(self.log, now)
        self.stopped = self.preparing = self.held_up = ''
        self._closed = False
        self._unsaved = False  # the content, at the end of the last life
        self._name = name
        self._failed = failed
        self._device: Built | None = None
        self._disk = Worker('mlmem-store', self.log)
        self._rescued: dict[str, Any] | None = None  # of a failed device, for the next one

    @property
    def element(self) -> MemoryElement | None:
        """The element; None while unconfigured."""
        return None if self._device is None else self._device.element

    @property
    def failure(self) -> BaseException | None:
        """Why the device stopped while active, or None."""
        return self.loop.failure if self.loop is not None else None

    @property
    def content_name(self) -> str:
        """What the element holds, `level` or `word`; empty while unconfigured."""
        element = self.element
        return '' if element is None else element.content_name

    @property
    def lost(self) -> bool:
        """Whether the content as it is now, or any recording, could not be saved."""
        return self._unsaved or self.sessions.lost

    @property
    def recording(self) -> Recording | None:
        """What takes all messages: a session, the pre-trigger buffer's, or None."""
        return self.sessions.current or self.sessions.buffer

    # --- life cycle ----------------------------------------------------------------------

    def prepare_device(
        self, given: Parameters, blank: bool = False, is_retry: bool = False
    ) -> Built:
        """Check the design, build the device, restore its content unless it is to be `blank`, in
        any thread; `adopt_device` or `discard_device` it then.

        `preparing` says what takes the time meanwhile; of a retry the log does not.

        Raises:
            One of `REFUSALS`: Nothing is open.
        """
        begun, is_cached = time.monotonic(), is_kernel_cached(given.design)
        self.preparing = 'preparing the device'
        if not is_retry:
            self.log.info(self.preparing)
        if not is_cached:
            kernels = f'the kernels of the {given.design.substrate} substrate'
            self.preparing = f'compiling {kernels}'
            self.log.info(f'{self.preparing} (once; it takes some seconds)')
        try:
            built = build_device(given, self.log, self._disk, self._name, blank)
        finally:
            self.preparing = ''
        if blank:
            self._rescued = None
        if not is_cached:
            self.log.info(f'compiled in {time.monotonic() - begun:.1f} s, and cached')
        return built

    def discard_device(self, device: Built) -> None:
        """Release a device that is not adopted."""
        device.store.close()
        with self.log.guard_errors('releasing the element'):
            try:
                device.element.driver.close()
            except DriverError as error:
                self.log.error(str(error))
                self.log.log_cause(error)

    def adopt_device(self, device: Built) -> MemoryElement:
        """Put a device that was built into service, with what a failed one held."""
        self.stopped, self._device = '', device
        if (rescued := self._rescued) is not None:
            self._rescued = None
            self._restore_rescued(device.element, rescued)
        return device.element

    def activate(
        self,
        given: Parameters,
        plan: SessionPlan,
        listener: TickListener,
        pacer: Pacer,
        speed: float,
        has_subscribers: Callable[[], bool] = lambda: True,
        stream_period: Callable[[], int] = lambda: 1,
        paused: bool = False,
    ) -> None:
        """Start time, and a recording if a path is set.

        Args:
            given: The configuration, with the present faults and recording.
            listener: Called after ticks with their events.
            speed: Multiple of real time; 0: as fast as possible.
            has_subscribers: Returns whether anybody subscribes to a stream that must be on time.
            stream_period: Returns the ticks of which those of all streams and views that
                anybody takes are multiples; 0 if nobody takes any.
            paused: Whether time begins paused.

        Raises:
            One of `REFUSALS`: Nothing is changed.
        """
        assert self._device is not None
        element, store = self._device
        if given.record.path:
            self.sessions.begin(plan, element)
        if given.record.last_seconds:
            self.sessions.keep(plan, element)
        guard, hash_every = self.log.guard_errors, given.record.hash_every

        def publish_events(commands: Sequence[Stamped], events: Sequence[Event]) -> None:
            if (recording := self.recording) is not None:
                with guard('recording'):
                    recording.put_commands(commands)
            with guard('publishing'):
                listener(events)
            if recording is not None:
                with guard('recording'):
                    recording.record_tick(element)

        def resolve_request(request: Asked) -> None:
            store.resolve(request, element)
            if (outcome := request.outcome) is not None:  # a log line takes half a millisecond
                self.log.info(_format_outcome(outcome, element), outcome.procedure)

        loop = Loop(
            element,
            publish_events,
            pacer=pacer,
            speed=0.0 if element.driver.own_clock else speed,
            batch=given.publish.common_ticks,
            has_subscribers=lambda: self.recording is not None or has_subscribers(),
            stream_period=lambda: math.gcd(
                stream_period(), 0 if self.recording is None else hash_every
            ),
            queue=given.queue.most,
            resolve=resolve_request,
            failed=self._failed,
        )
        if given.faults != element.faults:
            loop.submit(SetFaults(given.faults))
        if (method := given.settings.write.method) != element.settings.write.method:
            loop.submit(SetMethod(method))
        self.loop = loop
        if paused:
            loop.pause(True)
        loop.start()

    def deactivate(self) -> None:
        """Abort any procedure, bring the strain to zero, close the recording, save the content.

        Raises:
            Refused: The node is not active.
            StateError: The device has failed: `release_failed` is due.
        """
        loop = self.open_loop()
        loop.shut_down()
        if loop.failure is not None:
            why = f'the device has stopped: {loop.failure}'
            raise StateError(ErrorCode.INACTIVE, reason=why)
        self.loop = None
        self._save_stopped(loop.element)

    def release_failed(self) -> None:
        """Save what can be saved of a failed device, and release it."""
        loop, self.loop = self.loop, None
        if loop is not None:
            element = loop.element
            loop.shut_down()
            self.stopped = f'the device has stopped: {loop.failure}'
            self.log.error(self.stopped)
            if isinstance(loop.failure, REFUSALS):
                self.log.log_cause(loop.failure)
            elif loop.failure is not None:
                self.log.exception('the device', loop.failure)
            self.sessions.close(None)
            saved = self._save_failed(element)
            again = '; if it fails again, reset the element' if element.is_simulated else ''
            self.log.error(f'{saved}; configure and activate to go on{again}')
        self.release_device()

    def release_device(self) -> None:
        """Release the device."""
        device, self._device = self._device, None
        if device is not None:
            self.discard_device(device)

    def close(self) -> None:
        """Shut down, whatever the device is doing: stop, save and release it."""
        self._closed = True
        if self.loop is not None:
            try:
                self.deactivate()
            except StateError:
                self.release_failed()
        self.release_device()

    def on_timer(self) -> None:
        """Save at intervals, and answer overdue requests; call it once a second."""
        self.sessions.on_timer()
        if self.loop is not None:
            self.loop.refuse_expired()
        if self._device is not None:
            self._device.store.on_timer(self.loop)

    # --- requests -----------------------------------------------------------------------

    def open_loop(self) -> Loop:
        """Return the running loop.

        Raises:
            Refused: The node is not active.
        """
        if (loop := self.loop) is None:
            stopped = f'{self.stopped}; ' if self.stopped else ''
            remedy = f'{stopped}configure and activate the node first'
            why = f'inactive: {"the node is shut down" if self._closed else remedy}'
            raise Refused(ErrorCode.INACTIVE, reason=why)
        return loop

    def submit(self, command: Command, wait: float | None = None) -> Asked:
        """Hand in a command for the next tick; see `Loop.submit`. With 0 s it may wait for
        its turn for a minute.

        With a state file, the outcome comes after the changed content is safe on the disk; if it
        cannot be saved, the outcome is a failure.
        """
        return self.submit_made(lambda _: command, wait)

    def submit_made(
        self, make: Callable[[MemoryElement], Command], wait: float | None = None
    ) -> Asked:
        """Hand in, as `submit` does, a command that is made for the element, such as one given in
        SI values; `make` may refuse it.
        """
        if wait == 0.0:  # it brings no deadline of its own
            wait = 60.0
        return self._send_request(lambda loop: loop.submit(make(loop.element), wait))

    def cancel(self, request: Asked) -> Asked:
        """Abort the procedure of a request; see `Loop.cancel`."""
        return self._send_request(lambda loop: loop.cancel(request))

    def feedback(self, request: Asked) -> Feedback | None:
        """Return the progress of a request's procedure, if it is running or waits for its turn.

        Call it in the loop's thread.
        """
        if (element := self.element) is None:
            return None
        if place := request.place:
            return Feedback('waiting', 0.0, element.transmission.encoder_strain, 0, place)
        return element.get_feedback() if element.is_running(request.run) else None

    def step(self, ticks: int = 1) -> Request[int]:
        """Run ticks while paused; see `Loop.step`."""
        return self._send_request(lambda loop: loop.step(ticks))

    def pause(self, paused: bool) -> Future[int]:
        """Pause or resume time; see `Loop.pause`."""
        return self._send_request(lambda loop: Request(None, loop.pause(paused))).answer

    def record(self, plan: SessionPlan | None) -> Future[Path]:
        """Begin a recording, or without a plan end it; see `Sessions`."""
        switch = self.sessions.stop if plan is None else partial(self.sessions.start, plan)
        return self._send_request(lambda loop: Request(None, switch(loop))).answer

    def set_faults(self, faults: Faults) -> None:
        """Hand in faults if time runs; otherwise they take effect at the next activation."""
        if self.loop is not None:
            self._hand_in(SetFaults(faults))

    def set_method(self, method: str) -> None:
        """Write by another method if time runs; otherwise from the next activation on."""
        if self.loop is not None:
            self._hand_in(SetMethod(method))

    def _hand_in(self, command: Command) -> None:
        """Hand in the command of a parameter, for which nobody waits; log why it is refused."""

        def log_refusal(done: Future[Any]) -> None:
            if (why := done.exception()) is not None:
                self.log.refused(type(command).__name__, why)

        self.submit(command).answer.add_done_callback(log_refusal)

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time; 0: as fast as possible."""
        if self.loop is not None and not self.loop.element.driver.own_clock:
            self.loop.set_speed(speed)

    def _send_request(self, ask: Callable[[Loop], Request[T]]) -> Request[T]:
        try:
            return ask(self.open_loop())
        except Refused as refusal:
            return Request[T](None).refuse(refusal)

    # --- end of a life -------------------------------------------------------------------

    def _save_stopped(self, element: MemoryElement) -> bool:
        """Save all of a device whose time has stopped; return whether that succeeded."""
        self.sessions.close(element)
        assert self._device is not None
        store = self._device.store
        kept = store.save_state(element)
        saved = store.flush() and kept.exception() is None
        self._unsaved = not saved
        return saved

    def _save_failed(self, element: MemoryElement) -> str:
        """Save what can be saved of a failed device; return a message that says what."""
        if not element.is_simulated:
            if not element.procedure:
                self._save_stopped(element)
                self._rescued = snapshot.take_snapshot(element)
            return 'its content is in the element'
        if not release_strain(element, self.log):
            self._unsaved = True
            return 'its content is as last saved'
        assert self._device is not None
        if self._save_stopped(element) and self._device.store.path is not None:
            return 'its content is saved'
        self._rescued = snapshot.take_snapshot(element)
        return 'its content is kept until the next configuration'

    def _restore_rescued(self, element: MemoryElement, rescued: dict[str, Any]) -> None:
        """Give a new device the content of a failed one, if it fits; a real one its calibration
        and statistics.
        """
        try:
            snapshot.restore_snapshot(element, rescued)
        except StateError:
            blank = ': the element is blank' if element.is_simulated else ''
            self.log.warning(f'the failed device had another design{blank}')
        else:
            what = 'content' if element.is_simulated else 'calibration'
            self.log.info(f'the {what} of the failed device is restored')


def _format_outcome(outcome: Outcome, element: MemoryElement) -> str:
    ticks = outcome.end_tick - outcome.start_tick
    if not outcome.success:
        return f'{outcome.procedure} failed after {ticks} ticks: {outcome.error}'
    found = f': {element.describe_content(outcome.reading.content)}' if outcome.reading else ''
    return f'{outcome.procedure} succeeded after {ticks} ticks{found}'


def release_strain(element: MemoryElement, log: ThrottledLog) -> bool:
    """Bring the strain to zero without a loop; return whether it got there."""
    erase = element.settings.erase
    most = 1 + math.ceil((erase.release + erase.settle) / element.tick)
    try:
        element.apply(Abort('the device has failed'))
        for _ in range(3 * most):
            if element.is_released:
                return True
            element.advance()
    except Exception as error:
        if not isinstance(error, REFUSALS):
            log.exception('releasing', error)
    return False
