# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device observed while it works, for the x-t figures."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from mlmem import Command, EchoReceived, MemoryElement, Outcome
from mlmem.instrument.echo import Echo
from mlmem.physics import Design, find_walls
from mlmem.physics.values import Array


@dataclass
class Trace:
    """Observations at the end of every tick.

    Attributes:
        t: Times in time units.
        strain: Strain of the substrate.
        configuration: Delta_j, one row of N each.
        captions: What is done.
        begins: When every procedure began, in time units.
        outcomes: How every procedure ended, in order.
        echoes: What was detected.
    """

    t: list[float] = field(default_factory=list)
    strain: list[float] = field(default_factory=list)
    configuration: list[Array] = field(default_factory=list)
    captions: list[str] = field(default_factory=list)
    begins: list[float] = field(default_factory=list)
    outcomes: list[Outcome] = field(default_factory=list)
    echoes: list[Echo] = field(default_factory=list)

    def list_frames(self, count: int | None = None) -> dict[str, Any]:
        """Return so many observations, equally far apart, or all: `t`, `strain`, `field` (one row
        of N each) and `caption`; and the `success` of every procedure.
        """
        frames = np.linspace(0, len(self.t) - 1, count or len(self.t)).astype(int)
        return {
            't': np.array(self.t)[frames],
            'strain': np.array(self.strain)[frames],
            'field': np.array(self.configuration, dtype=np.float32)[frames],
            'caption': np.array(self.captions)[frames],
            'success': [outcome.success for outcome in self.outcomes],
        }


def record_procedures(element: MemoryElement, commands: Iterable[tuple[str, Command]]) -> Trace:
    """Return what is observed while procedures run one after the other, each with a caption."""
    trace = Trace()
    for caption, command in commands:
        record_procedure(element, command, trace, caption)
    return trace


def record_procedure(
    element: MemoryElement, command: Command, trace: Trace, caption: str = ''
) -> Outcome:
    """Apply a command, advance until its procedure has ended, and record every tick.

    Args:
        command: A command that starts a procedure.
        trace: Observations are appended to it.
        caption: What is done.

    Returns:
        How the procedure ended.
    """
    element.apply(command)
    trace.begins.append(element.ticks * element.tick)
    while True:
        events = element.advance()
        trace.t.append(element.ticks * element.tick)
        trace.strain.append(element.actuator.strain)
        trace.configuration.append(element.chain.configuration)
        trace.captions.append(caption)
        for event in events:
            if isinstance(event, EchoReceived):
                trace.echoes.append(event.echo)
            elif isinstance(event, Outcome):
                trace.outcomes.append(event)
                return event


def wall_position(design: Design, configuration: Array) -> float:
    """Return the position of the only wall of a configuration; NaN for none or several."""
    found = find_walls(design, configuration)
    return found[0].position if len(found) == 1 else float('nan')


def wall_path(design: Design, configurations: Iterable[Array]) -> Array:
    """Return the wall's position in each of m configurations, shape (m,), NaN for none."""
    return np.array([wall_position(design, configuration) for configuration in configurations])
