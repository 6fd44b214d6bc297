# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The proof of a design: the node's device, put to every use of the memory.

Three kinds of run, each judged by the device's answers and by the true configuration:

- `upward`: from blank, every level is written in turn and verified, one attempt each.
- `down`: from a wall at rest at a level, a lower one is written: erase, launch, steps.
- `erase`: from a wall at rest at a level, the element is made blank.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..device import Calibration, Erase, MemoryElement, Settings, Write, factory_calibration
from ..physics import Design, Specimen, level_of
from ..physics.equilibrium import resting_wall
from .campaign import Campaign, Row
from .campaign.campaign import Values
from .climb import least_margins, write_upward

KINDS = ('upward', 'down', 'erase')

EVERY = 16
"""Number of levels up to which every downward write is made; above that a sample."""


@dataclass(frozen=True)
class Proof:
    """What to prove of a design.

    Attributes:
        design: The element.
        settings: The instrument's settings.
        sample: Most downward writes to make; by default all, or above `EVERY` levels as many as
            levels. Every level is erased.
        seed: Of the sample.
    """

    design: Design
    settings: Settings
    sample: int | None = None
    seed: int = 0

    def campaign(self) -> Campaign:
        """Return the runs, with the calibration that all share.

        Raises:
            SettingsError: A level gives no echo, or levels cannot be told apart.
        """
        settings = dataclasses.replace(
            self.settings, write=dataclasses.replace(self.settings.write, attempts=1)
        )
        common = {
            'design': dataclasses.asdict(self.design),
            'settings': settings.as_dict(),
            'calibration': factory_calibration(self.design, settings).as_dict(),
        }
        return Campaign('proof', evaluate, common, self.points(), self.seed)

    def points(self) -> list[dict[str, Any]]:
        """Return the runs: kind, the level begun at and the level asked for (-1 for blank)."""
        p = self.design.levels
        downs = [(start, goal) for start in range(p) for goal in range(start)]
        if p > EVERY or self.sample is not None:
            downs = self._some(downs, p if self.sample is None else self.sample)
        return [
            {'kind': 'upward', 'start': -1, 'goal': p - 1},
            *({'kind': 'erase', 'start': level, 'goal': -1} for level in range(p)),
            *({'kind': 'down', 'start': start, 'goal': goal} for start, goal in downs),
        ]

    def _some(self, whole: Sequence[Any], count: int) -> list[Any]:
        """Return a sample that holds the first and the last, in order."""
        if count >= len(whole):
            return list(whole)
        generator = np.random.Generator(np.random.PCG64(self.seed))
        inner = generator.choice(np.arange(1, len(whole) - 1), max(0, count - 2), replace=False)
        return [whole[i] for i in sorted({0, len(whole) - 1, *map(int, inner)})]


def evaluate(common: Values, values: Values, seed: int) -> Row:
    """Return how one run went.

    Returns:
        done: Levels written and read back upward; for other runs 1 on success, else 0.
        passed: Whether all succeeded at the first attempt.
        error: What the device said, or the truth if that differs.
        level_margin, threshold_margin: The least of the readings, None without one.
        time: Duration in time units.
    """
    design, settings = Design(**common['design']), Settings.from_dict(common['settings'])
    element = MemoryElement(design, settings, Calibration.from_dict(common['calibration']))
    if values['kind'] == 'upward':
        climb = write_upward(element)
        last, outcomes = climb.writes[-1], [each.outcome for each in climb.writes]
        done, passed = climb.reached, climb.passed
        error = '' if passed else f'level {last.asked}: {last.failure} {last.outcome.error}'
    else:
        element.chain.place(resting_wall(Specimen(design), values['start']))
        element.transducer.settle()
        command = Erase() if values['kind'] == 'erase' else Write(values['goal'])
        outcome = element.perform(command)
        true, outcomes = level_of(design, element.chain.configuration), [outcome]
        passed = outcome.success and true == values['goal']
        done = int(passed)
        error = outcome.error or ('' if passed else f'the wall is at level {true}')
    return {
        'done': done, 'passed': passed, 'error': error, **least_margins(outcomes),
        'time': element.ticks * element.tick,
    }  # fmt: skip


@dataclass(frozen=True)
class Tally:
    """The totals of a proof's runs.

    Attributes:
        upward: Levels written and read back upward, and of how many.
        down: Downward writes that succeeded, and of how many.
        erase: Erases that succeeded, and of how many.
        level_margin: Least level margin of all readings, NaN without one.
        erase_time: Longest erase in time units.
        errors: What failed and why, a line each; empty if everything succeeded.
    """

    upward: tuple[int, int]
    down: tuple[int, int]
    erase: tuple[int, int]
    level_margin: float
    erase_time: float
    errors: tuple[str, ...]

    @classmethod
    def of(cls, rows: Iterable[Row]) -> Tally:
        """Add up the rows of a campaign; one of them is the upward run."""
        rows = list(rows)
        of_kind = {kind: [row for row in rows if row['kind'] == kind] for kind in KINDS}
        done = {kind: sum(row['done'] for row in some) for kind, some in of_kind.items()}
        margins = [row['level_margin'] for row in rows if row['level_margin'] is not None]
        return cls(
            (done['upward'], of_kind['upward'][0]['goal'] + 1),
            (done['down'], len(of_kind['down'])),
            (done['erase'], len(of_kind['erase'])),
            min(margins, default=math.nan),
            max((row['time'] for row in of_kind['erase']), default=0.0),
            tuple(
                f'{row["kind"]} from {row["start"]} to {row["goal"]}: {row["error"]}'
                for row in rows
                if not row['passed']
            ),
        )
