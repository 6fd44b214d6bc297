# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a campaign is: a table of points, and the function that evaluates one of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from mlmem_ros import __version__

Values = Mapping[str, Any]
"""Numbers and strings by name: what JSON can hold."""

Row = dict[str, Any]
"""A row of the table of results: point, seed, the point's values, and its results."""

Evaluate = Callable[[Values, Values, int], Row]
"""Returns the results of a point from (common values, values of the point, seed of the point)."""


class CampaignError(Exception):
    """A campaign cannot be run or continued; the message says what to do."""


@dataclass(frozen=True)
class Campaign:
    """Points to be evaluated, each on its own and in any order.

    Attributes:
        evaluate: Evaluates a point. It must be a module-level function, so that another process
            can import it, and depend on nothing but its arguments.
        common: What all points share, as JSON.
        points: The values of every point, as JSON. More may be added later, at the end.
        seed: The seeds of all points are derived from it.
    """

    name: str
    evaluate: Evaluate
    common: Values
    points: Sequence[Values]
    seed: int = 0

    def point_seed(self, point: int) -> int:
        """Return the seed of a point, an integer below 2^63, independent of all others."""
        state = np.random.SeedSequence(self.seed, spawn_key=(point,)).generate_state(1, np.uint64)
        return int(state[0] >> np.uint64(1))

    def evaluate_point(self, point: int) -> Row:
        """Return the row of a point: the same whenever and wherever it is evaluated.

        Raises:
            CampaignError: There is no such point.
        """
        self.check_point(point)
        return evaluate_one(*self.task(point))

    def task(self, point: int) -> tuple[Evaluate, Values, Values, int, int]:
        """Return the arguments of `evaluate_one` for a point."""
        return self.evaluate, self.common, self.points[point], point, self.point_seed(point)

    def check_point(self, point: int) -> None:
        """Raise `CampaignError` if there is no such point."""
        if not 0 <= point < len(self.points):
            raise CampaignError(
                f'point must be a whole number from 0 to {len(self.points) - 1}; got {point}'
            )

    def definition(self) -> dict[str, Any]:
        """Return everything the rows depend on besides the points, as JSON."""
        function = f'{self.evaluate.__module__}.{self.evaluate.__qualname__}'
        return {
            'name': self.name,
            'evaluate': function,
            'common': self.common,
            'seed': self.seed,
            'version': __version__,
        }


def evaluate_one(evaluate: Evaluate, common: Values, values: Values, point: int, seed: int) -> Row:
    """Return the row of one point. Workers are sent this, not the whole campaign."""
    return {'point': point, 'seed': seed, **values, **evaluate(common, values, seed)}
