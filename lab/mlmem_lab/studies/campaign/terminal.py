# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A campaign in the terminal, resumed after a kill or Ctrl-C, or mere calls: with progress."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from mlmem_tools.cli.command import JOBS_OPTION, declare_option
from mlmem_tools.cli.output import show_progress

from . import Ledger, count_cores, provide_workers, run

if TYPE_CHECKING:
    from rich.console import Console

    from . import Campaign, Row

Result = TypeVar('Result')

CAMPAIGN_OPTIONS = (
    declare_option('--seed', type=int, default=0, help='of all random numbers'),
    JOBS_OPTION,
    declare_option(
        '--cluster',
        default='',
        metavar='ADDRESS',
        help='scheduler of a Dask cluster to use instead, such as tcp://host:8786',
    ),
    declare_option(
        '--point', type=int, metavar='N', help='run point N of the table alone, in detail'
    ),
)
"""Options of every sub-command that runs a campaign."""


def evaluate_missing(
    console: Console,
    study: Campaign,
    path: Path,
    jobs: int | None,
    cluster: str = '',
    *,
    what: str = 'points',
    rows_of: Callable[[Ledger, Executor | None], Iterator[Row]] | None = None,
) -> list[Row]:
    """Evaluate the points missing from the ledger; return the complete table.

    Args:
        jobs: Processes side by side; None for one a core.
        cluster: Address of a Dask scheduler to use instead.
        rows_of: Evaluates them if not all may be needed; by default `run`.

    Raises:
        CampaignError: A worker died, or the ledger belongs to another campaign.
        OSError: The ledger cannot be written.
    """
    path.parent.mkdir(parents=True, exist_ok=True)
    with Ledger(path, study) as ledger:
        done = len(ledger.rows)
        total = len(study.points) if rows_of is None else None  # known only along the way
        if done == total:
            return ledger.table()
        if done:
            console.print(
                f'{_format_progress(done, total)} {what} were already done', highlight=False
            )
        try:
            wanted = count_cores() if jobs is None else jobs
            with provide_workers(min(wanted, len(study.points)), cluster) as executor:
                rows = rows_of(ledger, executor) if rows_of else run(study, ledger, executor)
                show_progress(console, rows, done, total, what)
        except KeyboardInterrupt:
            console.print(
                f'{_format_progress(len(ledger.rows), total)} {what} are kept in {path}; '
                'repeat the command to continue', highlight=False,
            )  # fmt: skip
            raise
        return ledger.table()


def map_calls(
    console: Console,
    jobs: int,
    what: str,
    function: Callable[..., Result],
    *columns: Iterable[Any],
    then: Callable[[Result], object] = lambda result: None,
) -> list[Result]:
    """Return the results of calls in their order.

    Args:
        jobs: Processes side by side; 1 for this one.
        *columns: Its arguments, as for `map`.
        then: Is given every result in turn, while others are computed.
    """
    tasks = list(zip(*columns, strict=True))
    found: list[Result] = []
    with provide_workers(jobs) as pool:
        done = (map if pool is None else pool.map)(function, *zip(*tasks, strict=True))

        def iterate_results() -> Iterator[object]:
            for result in done:
                found.append(result)
                yield then(result)

        show_progress(console, iterate_results(), 0, len(tasks), what)
    return found


def _format_progress(done: int, total: int | None) -> str:
    return f'{done}' if total is None else f'{done} of {total}'


class Bar:
    """A progress bar that says what is being done."""

    def __init__(self, console: Console) -> None:
        columns = TextColumn('{task.description}'), BarColumn(), TimeElapsedColumn()
        self._bar = Progress(*columns, console=console, transient=True)
        self._task = self._bar.add_task('', total=1.0)

    def __enter__(self) -> Bar:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def __call__(self, what: str, share: float) -> None:
        """Show what is being done, and the fraction done."""
        self._bar.update(self._task, description=what, completed=share)
