# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A request to a running device: one object from the edge to the answer."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass, field
from math import inf
from typing import TYPE_CHECKING, Any, Generic, Protocol, TypeVar

from .. import threads

if TYPE_CHECKING:
    from .element import Run
    from .events import Outcome

T = TypeVar('T')


class Client(Protocol):
    """Who asks."""

    @property
    def key(self) -> object:
        """What is equal for requests of one client."""

    @property
    def gone(self) -> bool:
        """Whether it is known to be there no more."""


@dataclass(eq=False)
class Request(Generic[T]):
    """What is asked of a device, who waits for it, and what came of it.

    Any thread may make one. The loop's thread takes it up and settles it, at once or when its
    procedure has ended.

    Attributes:
        asked: A command, a `Cancel`, or a function to call between two ticks.
        answer: Its outcome, for whoever waits: the exception `Refused` if it is not accepted.
        client: Who asks, and would wait for a turn; None: nobody would.
        deadline: When its turn must have come, on the steady clock.
        place: Its place among those that wait, from 1; 0 if it does not wait.
        run: The procedure that it has begun, or None.
    """

    asked: Any
    answer: Future[T] = field(default_factory=lambda: threads.Future())
    client: Client | None = None
    deadline: float = inf
    place: int = 0
    run: Run | None = None

    @property
    def outcome(self) -> Outcome | None:
        """How its procedure has ended; None without one, and while it runs."""
        return self.run.outcome if self.run is not None else None

    def taken_up(self) -> bool:
        """Return whether somebody still waits, who can no longer withdraw it then."""
        return self.answer.running() or self.answer.set_running_or_notify_cancel()

    def settle(self, outcome: T) -> None:
        """Answer it."""
        self.answer.set_result(outcome)

    def refuse(self, reason: BaseException) -> Request[T]:
        """Answer it with an exception; return it."""
        self.answer.set_exception(reason)
        return self


@dataclass(frozen=True)
class Cancel:
    """What ends the procedure of exactly this request, and no other."""

    of: Request[Any]
