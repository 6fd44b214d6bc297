# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a move is: one way to take an element from one content to another; and how ends that
strayed are brought back before they are driven.

Every other module of this package with a function `moves_from(design, settings, start, target)`
adds its moves to the planner. That function yields the moves that begin at a content, or, from
`UNDECODABLE`, those that make an element blank whatever it holds. A family may leave out what
leads away from the target. What can be set on its moves stands in the same module; `Settings`
has a field for it.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from ..instrument.blocks import Procedure, catch_up, move_end, wait
from ..instrument.end import End, EndMove
from ..readers.calibration import PulseCorrection
from ..readers.reading import BLANK

if TYPE_CHECKING:
    from ..memory import Memory
    from ..settings import Settings

MIN_MARGIN = 0.1
"""Least margin of a move that the planner uses."""


@dataclass(frozen=True)
class Drive:
    """How a write drives its moves.

    Attributes:
        corrections: Of the pulses, by the level to which a move takes the wall.
        strain_factor: Factor on the peak strains of steps up, within the actuator's limit.
        speed_factor: Factor on the speed of a kick, within the transducer's limit.
        is_last: Whether the element is read after this move.
    """

    corrections: Sequence[PulseCorrection]
    strain_factor: float = 1.0
    speed_factor: float = 1.0
    is_last: bool = True


@dataclass(frozen=True)
class Move(ABC):
    """One way to take an element from one content to another.

    A content is a level or `BLANK`; of a register it is a word.

    Attributes:
        name: The kind of move in words, for messages.
        start: Content at which it begins; `UNDECODABLE` if any will do.
        target: Content at which it ends.
        duration: Time units that it takes; approximate if it listens.
        ringing: Time units for which it leaves the element ringing, until it can be read.
        margin: Relative change that its quantities tolerate.
        needs_actuator: Whether it strains the substrate.
        listens: Whether it listens on its way until it has succeeded. It is as fast as it says
            only from a content that was read, so it begins a route.
    """

    start: int
    target: int
    duration: float
    ringing: float = 0.0
    margin: float = MIN_MARGIN

    name: ClassVar[str]
    needs_actuator: ClassVar[bool] = False
    listens: ClassVar[bool] = False

    @abstractmethod
    def drive(self, element: Memory, how: Drive) -> Procedure[Any]:
        """Make the move; return what it read last if it listens.

        Raises:
            ProcedureFailed: It listens and has not succeeded; `NotFollowed` if the actuator does
                not follow.
        """


def blank_content(settings: Settings) -> int:
    """Return the content of an element without walls: `BLANK`, or word 0 of a register."""
    return 0 if settings.holds_words else BLANK


def bring_ends_back(element: Memory, ends: Iterable[End] = End) -> Procedure[None]:
    """Move those of some ends that strayed into a third ground state back to the active phase.

    A wall driven over a free end returns as a wall between the active phase and the next. No
    strain moves it, but the wall launched here removes it within some 90 cells.
    """
    yield from catch_up(element)
    for end in ends:
        if element.phase(end) is not None:
            continue
        element.forget_content('an end was brought back')
        start = element.transducer.find_displacement(end)
        # speeds of 0.1 to 0.4 work
        yield from move_end(element, end, EndMove(start, element.design.D_s2, 0.2))
        yield from wait(element, element.settings.erase.settle)
        yield from catch_up(element)
