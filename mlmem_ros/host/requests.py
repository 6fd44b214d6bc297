# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Requests to an element in service: each is answered, or refused and counted."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path
from typing import Any, TypeVar

from mlmem import Command, Faults, Loop, MemoryElement, Refused, SetFaults, SetMethod
from mlmem.commands import PHASE_WAITING, Feedback
from mlmem.instrument.instrument import Units
from mlmem.loop.mailbox import Asked, Request, TickRequest

from .sessions import Sessions
from .settings import SessionPlan

T = TypeVar('T')

QUEUE_TIMEOUT_S = 60.0
"""Longest wait of a request that brings no deadline of its own."""


class RequestGate:
    """Hands requests to the loop of an element, if it is active.

    Attributes:
        element: The element; None while unconfigured.
        stopped: Why there is no device, if it has stopped or is waited for; empty otherwise.
    """

    def __init__(self, sessions: Sessions) -> None:
        self.element: MemoryElement | None = None
        self.loop: Loop | None = None
        self.sessions = sessions
        self.stopped = ''
        self.refused = 0
        self._closed = False

    def open_loop(self) -> Loop:
        """Return the running loop.

        Raises:
            Refused: The node is not active.
        """
        if (loop := self.loop) is None:
            if self._closed:
                raise Refused('inactive: the node is shut down')
            stopped = f'{self.stopped}; ' if self.stopped else ''
            raise Refused(f'inactive: {stopped}configure and activate the node first')
        return loop

    def submit(self, command: Command, wait: float | None = None) -> Asked:
        """Hand in a command for the next tick; see `Loop.submit`. With 0 s it may wait for
        its turn for `QUEUE_TIMEOUT_S`.

        With a state file, the outcome comes after the changed content is safe on the disk; if it
        cannot be saved, the outcome is a failure.
        """
        if wait == 0.0:
            wait = QUEUE_TIMEOUT_S
        return self._asked(lambda loop: loop.submit(command, wait))

    def submit_scaled(self, make: Callable[[Units], Command]) -> Asked:
        """Hand in a command given in SI values, converted to the device's units."""
        return self._asked(lambda loop: loop.submit(make(loop.element.units)))

    def cancel(self, request: Asked) -> Asked:
        """Abort the procedure of a request; see `Loop.cancel`."""
        return self._asked(lambda loop: loop.cancel(request))

    def feedback(self, request: Asked) -> Feedback | None:
        """Return the progress of a request's procedure, if it is running or waits for its turn.

        Call it in the loop's thread.
        """
        element = self.element
        if element is not None and (place := request.place):
            return Feedback(PHASE_WAITING, 0.0, element.transmission.encoder, 0, place)
        return element.feedback() if element is not None and element.runs(request.run) else None

    def step(self, steps: TickRequest | None = None) -> Request[int]:
        """Run ticks while paused, by default one; see `Loop.step`."""
        return self._asked(lambda loop: loop.step(steps))

    def pause(self, paused: bool) -> Future[int]:
        """Pause or resume time; see `Loop.pause`."""
        return self._call_counted(lambda loop: loop.pause(paused))

    def record(self, plan: SessionPlan | None) -> Future[Path]:
        """Begin a recording, or without a plan end it; see `Sessions`."""
        if plan is None:
            return self._call_counted(self.sessions.stop)
        return self._call_counted(lambda loop: self.sessions.start(plan, loop))

    def set_faults(self, faults: Faults) -> None:
        """Hand in faults if time runs; otherwise they take effect at the next activation."""
        if self.loop is not None:
            self.submit(SetFaults(faults))

    def set_method(self, method: str) -> None:
        """Write by another method if time runs; otherwise from the next activation on."""
        if self.loop is not None:
            self.submit(SetMethod(method))

    def set_speed(self, speed: float) -> None:
        """Run at another multiple of real time; 0: as fast as possible."""
        if self.loop is not None and not self.loop.element.driver.own_clock:
            self.loop.set_speed(speed)

    def _asked(self, ask: Callable[[Loop], Request[T]]) -> Request[T]:
        try:
            request = ask(self.open_loop())
        except Refused as refusal:
            request = Request[T](None).refuse(refusal)
        request.answer.add_done_callback(self._count_refusal)
        return request

    def _call_counted(self, ask: Callable[[Loop], Future[T]]) -> Future[T]:
        try:
            answer = ask(self.open_loop())
        except Refused as refusal:
            answer = Request[T](None).refuse(refusal).answer
        answer.add_done_callback(self._count_refusal)
        return answer

    def _count_refusal(self, answer: Future[Any]) -> None:
        if not answer.cancelled() and isinstance(answer.exception(), Refused):
            self.refused += 1
