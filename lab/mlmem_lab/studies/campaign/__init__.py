# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many independent simulations: defined once, run anywhere, resumed after a kill.

A `Campaign` is a table of points and the function that evaluates one. `run` evaluates the points
missing from the `Ledger` on disk, on an executor of `concurrent.futures`: local processes or a
Dask cluster (`workers`). `save_table` writes the results as CSV.
"""

from .campaign import Campaign, CampaignError, Row
from .execution import Ledger, cores, run, save_table, workers

__all__ = [
    'Campaign',
    'CampaignError',
    'Ledger',
    'Row',
    'cores',
    'run',
    'save_table',
    'workers',
]
