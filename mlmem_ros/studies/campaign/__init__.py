# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many independent simulations: defined once, run anywhere, continued after a kill.

A `Campaign` is a table of points and the function that evaluates one. `run` evaluates those
missing from the `Ledger` on disk, on an executor of `concurrent.futures`: local processes or a
Dask cluster (`workers`). `save_table` writes the results.
"""

from .campaign import Campaign, Row
from .errors import CampaignError
from .execution import run
from .executors import cores, workers
from .ledger import Ledger
from .table import FORMATS, save_table

__all__ = [
    'FORMATS',
    'Campaign',
    'CampaignError',
    'Ledger',
    'Row',
    'cores',
    'run',
    'save_table',
    'workers',
]
