# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Proving designs in the terminal: with progress, continued after a kill, a table at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from . import campaigns
from .console import plain_table

if TYPE_CHECKING:
    from rich.console import Console

    from ..studies.proof import Proof, Tally


def prove(console: Console, proof: Proof, name: str, folder: Path, jobs: int) -> Tally:
    """Run a proof; results are kept in the folder, so that the same command continues.

    Args:
        console: Where to show progress.
        proof: What to show.
        name: What to call the design.
        folder: Of the ledgers; created if missing.
        jobs: Processes side by side.

    Raises:
        CampaignError: A worker died, or the ledger belongs to another proof.
        SettingsError: A level gives no echo, or levels cannot be told apart.
        OSError: The ledger cannot be written.
    """
    from ..studies.proof import Tally

    with console.status(f'{name}: calibrating {proof.design.levels} levels'):
        study = proof.campaign()
    ledger = folder / f'{name}.jsonl'
    return Tally.of(campaigns.evaluated(console, study, ledger, jobs, what=f'{name}: runs'))


def print_table(console: Console, rows: Sequence[Sequence[str]]) -> None:
    """Print what was proven, one design per column."""
    from ..studies.proof_table import COLUMNS

    table = plain_table('', '', *(row[0] for row in rows))
    for heading, *cells in zip(COLUMNS[1:], *(row[1:] for row in rows), strict=True):
        table.add_row(heading, *cells)
    console.print(table)
