# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many independent simulations: defined once, run anywhere, resumed after a kill.

A `Campaign` is a table of points and the function that evaluates one. `run` evaluates the points
missing from the `Ledger` on disk, on an executor of `concurrent.futures`: local processes or a
Dask cluster (`provide_workers`). `save_table` writes the results as CSV.
"""

from .campaign import Campaign, CampaignError, Row
from .execution import Ledger, count_cores, provide_workers, run, save_table

__all__ = [
    'Campaign',
    'CampaignError',
    'Ledger',
    'Row',
    'count_cores',
    'provide_workers',
    'run',
    'save_table',
]
