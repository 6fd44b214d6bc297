# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running a campaign: the points missing from the ledger, in any order, on any executor."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed

import numpy as np

from .campaign import Campaign, Row, evaluate_one
from .errors import CampaignError
from .ledger import Ledger


def run(
    campaign: Campaign,
    ledger: Ledger,
    executor: Executor | None,
    points: Sequence[int] | None = None,
) -> Iterator[Row]:
    """Evaluate the points missing from the ledger; yield every row once it is stored.

    They are taken in shuffled order, so that progress predicts the remaining time.

    Args:
        campaign: What to evaluate.
        ledger: Its ledger, opened; rows are appended to it.
        executor: Where (see `workers`); None for this process.
        points: Which points; by default all.

    Raises:
        CampaignError: A worker died, or a point could not be evaluated; its error is the cause.
            Earlier results are kept.
    """
    wanted = range(len(campaign.points)) if points is None else points
    order = np.random.Generator(np.random.PCG64(campaign.seed)).permutation(wanted)
    todo = [int(point) for point in order if int(point) not in ledger.rows]
    for row in _here(campaign, todo) if executor is None else _there(campaign, todo, executor):
        ledger.append(row)
        yield row


def _here(campaign: Campaign, todo: Iterable[int]) -> Iterator[Row]:
    for point in todo:
        try:
            yield campaign.evaluate_point(point)
        except Exception as error:
            raise _failed(campaign, point, error) from error


def _there(campaign: Campaign, todo: Iterable[int], executor: Executor) -> Iterator[Row]:
    points = {
        executor.submit(
            evaluate_one, campaign.evaluate, campaign.common, campaign.points[point], point,
            campaign.seed_of(point),
        ): point
        for point in todo
    }  # fmt: skip
    try:
        for future in as_completed(points):
            try:
                yield future.result()
            except BrokenExecutor as error:
                raise CampaignError(
                    'a worker process died, perhaps out of memory; results so far are kept: '
                    'repeat the command with fewer jobs'
                ) from error
            except Exception as error:
                raise _failed(campaign, points[future], error) from error
    finally:
        for future in points:
            future.cancel()


def _failed(campaign: Campaign, point: int, error: Exception) -> CampaignError:
    return CampaignError(
        f'point {point} of {campaign.name}, {dict(campaign.points[point])}, could not be '
        f'evaluated: {error!r}; earlier results are kept'
    )
