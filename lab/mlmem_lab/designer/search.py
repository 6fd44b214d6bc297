# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From levels, scatter and friction to an element that one set of kicks writes.

The search (CMA-ES, Hansen 2016, arXiv:1604.00772) varies what the laws of `checks.budget` leave
open: width of the wall, cells per level, profile of the defects, gradient, damping, shape of the
kick, rise behind the last level. A trial kicks a wall into scattered elements, each with its own
speed, and counts the share of elements that come to the level that their speed stands for. Trials
scatter by 2.5 times what is requested, so that rare failures show. The speeds are then chosen on
other elements, and the result is counted on yet others.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mlmem import Settings
from mlmem.moves.kick import KickSettings
from mlmem.moves.strain_cycle import WriteSettings
from mlmem.physics import Design, DesignError
from mlmem.physics.values import Array
from mlmem.settings import ActuatorSettings, ReadSettings, RegisterSettings, TransducerSettings
from mlmem_tools.checks.budget import most_levels_with_friction, width_for_scatter

from ..windows.astray import find_scattered_ends


class DesignNotFound(ValueError):
    """No design was found: the message says for what, and why."""


@dataclass(frozen=True)
class DesignRequest:
    """What the element must be like.

    Attributes:
        levels: Number of levels.
        scatter: Standard deviation of on-site stiffness, springs and masses, relative.
        friction: Dry friction of every cell in k_r a.
    """

    levels: int
    scatter: float
    friction: float = 0.0

    @property
    def trial_scatter(self) -> float:
        """Scatter of a trial: so great that many kicks go astray."""
        return 2.5 * self.scatter


class Range(NamedTuple):
    """A quantity that the search varies: where it begins, and its bounds."""

    start: float
    low: float
    high: float


def list_ranges(request: DesignRequest) -> dict[str, Range]:
    """Return what the search varies, around what the laws say."""
    wanted = width_for_scatter(request.levels, request.scatter)
    braked = min(1.0, request.levels / most_levels_with_friction(request.friction))
    # against friction a narrow wall has a shorter way to go
    width = min(max(wanted * (1.0 - 0.5 * braked), 1.7), 8.0)
    return {
        'width': Range(width, 0.75 * width, 1.3 * width),
        'cells per width': Range(1.85, 1.5, 2.6),
        'middle': Range(0.17, 0.05, 0.6),
        'side': Range(0.5, 0.1, 0.95),
        'gradient': Range(0.1, -0.3, 0.5),
        'damping': Range(1.4 * (1.0 - 0.9 * braked), 0.03, 2.5),
        'late': Range(0.8, 0.0, 1.0),
        'rise': Range(0.5, 0.0, 1.0),
    }


def build_candidate(request: DesignRequest, values: Sequence[float]) -> tuple[Design, Settings]:
    """Return the design of values of `list_ranges`, in their order, with a kick without speeds.

    Raises:
        DesignError: They are none of a memory.
    """
    width, per_width, middle, side, gradient, damping, late, rise = values
    J = max(3, round(per_width * width))
    # in fewer than 8 cells behind the last level no wall is held, as a read expects
    way, behind = request.levels * J, max(J, 8)
    design = Design(
        N=way + behind, J=J, J_s=2 * J, j_0=round(0.38 * 2 * J, 2), tail=behind - 1,
        d=float(f'{0.25 / width**2:.4g}'), beta=0.0, gamma=float(f'{gradient / way:.3g}'),
        eta=float(f'{damping / way:.4g}'), profile=f'{side:.3g} {middle:.3g} {side:.3g}',
        rise=round(rise, 3), friction=request.friction,
    )  # fmt: skip
    design.require_memory()
    low, high = math.sqrt(design.k_s1), math.sqrt(design.k_s2)
    kick = KickSettings(late=round(late, 3), settle=400.0, erase_speed=0.5, erase_settle=400.0)
    return design, Settings(
        actuator=ActuatorSettings(present=False),
        write=WriteSettings(method='kick'),
        kick=kick,
        transducer=TransducerSettings(max_speed=2.0),
        read=ReadSettings(method='waveform', end='both'),
        # a carrier between the lower band edges, which a wall reflects whole
        register=RegisterSettings(
            omega_c=float(f'{low + 0.62 * (high - low):.4g}'), sigma=6.0, listen=240.0,
            min_margin=0.3,
        ),
    )  # fmt: skip


def list_speeds(settings: Settings, count: int) -> Array:
    """Return mean speeds from the slowest to the fastest that an end can do, most of them slow."""
    slowest = 0.004  # cells per time unit
    fastest = settings.transducer.max_speed / settings.kick.peak_speed_ratio
    return np.asarray(np.linspace(slowest**0.4, fastest**0.4, count) ** 2.5)


def try_candidate(request: DesignRequest, values: Sequence[float]) -> float:
    """Return the cost of a design: the share of kicks that go astray, and a tenth of that of the
    worst level; 2 for no memory.

    Every speed is tried on one element. A window of neighbouring speeds thus has several elements;
    what counts for a level is its best window, as the mean over windows of several widths.
    """
    try:
        design, settings = build_candidate(request, values)
        speeds = list_speeds(settings, 10 * request.levels)
        count = 6  # elements, whose seeds are 0 to 5
        own = {seed: speeds[seed::count].tolist() for seed in range(count)}
        found = find_scattered_ends(
            design, settings, request.trial_scatter, own, settings.kick.settle
        )
    except DesignError:
        return 2.0
    ends = np.empty(len(speeds), dtype=np.int64)
    for k, row in enumerate(found):
        ends[k::count] = row
    each = [_best_shares(ends, request.levels, width) for width in (5, 3, 8, 12)]
    shares = np.mean(each, axis=0)
    return float(1.0 - shares.mean() + 0.1 * (1.0 - shares.min()))


def _best_shares(ends: NDArray[np.int64], levels: int, window: int) -> Array:
    """Return the greatest share of neighbouring speeds that lead to a level, shape (levels,)."""
    weights = np.full(window, 1.0 / window)
    return np.array([np.convolve(ends == level, weights).max() for level in range(levels)])


def search_values(
    request: DesignRequest, pool: Executor | None, trials: int
) -> Iterator[tuple[float, Array]]:
    """Search, and yield the cost and the values of every trial.

    Args:
        pool: Evaluates trials side by side; None for this process.
        trials: How many at least.
    """
    import cma

    start, low, high = np.array(list(list_ranges(request).values())).T
    options = {'bounds': [0.0, 1.0], 'seed': 1, 'verbose': -9}
    search = cma.CMAEvolutionStrategy((start - low) / (high - low), 0.15, options)
    for _ in range(math.ceil(trials / search.popsize)):
        points = search.ask()
        values = [low + np.asarray(point) * (high - low) for point in points]
        costs = []
        found = (map if pool is None else pool.map)(try_candidate, [request] * len(values), values)
        for value, cost in zip(values, found, strict=True):
            costs.append(cost)
            yield cost, value
        search.tell(points, costs)


def try_speeds(request: DesignRequest, values: Sequence[float], seed: int) -> list[int]:
    """Return where kicks of all speeds leave the wall of one scattered element."""
    design, settings = build_candidate(request, values)
    speeds = {seed: list_speeds(settings, 40 * request.levels).tolist()}
    rest_time = settings.kick.settle
    return find_scattered_ends(design, settings, request.trial_scatter, speeds, rest_time)[0]


def choose_speeds(
    request: DesignRequest, values: Sequence[float], ends: Sequence[Sequence[int]]
) -> tuple[Design, Settings]:
    """Return a design with the speed to every level that leads most elements there.

    Args:
        values: Of the design.
        ends: Of every element what `try_speeds` returned.

    Raises:
        DesignNotFound: No speed leads half of the elements to a level.
    """
    design, settings = build_candidate(request, values)
    speeds = list_speeds(settings, len(ends[0]))
    smooth = np.full(5, 1.0 / 5.0)  # over neighbouring speeds
    shares = np.array([
        np.convolve((np.array(ends) == level).mean(axis=0), smooth, 'same')
        for level in range(request.levels)
    ])  # fmt: skip
    worst = int(shares.max(axis=1).argmin())
    if shares[worst].max() < 0.5:
        raise DesignNotFound(
            f'a kick must bring half of the trial elements to level {worst}; at most '
            f'{shares[worst].max():.0%} came: choose fewer levels, less scatter or less friction'
        )
    chosen = ' '.join(f'{speeds[row.argmax()]:.3g}' for row in shares)
    return design, replace(settings, kick=replace(settings.kick, speeds=chosen))
