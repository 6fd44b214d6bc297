# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running a campaign, in this process, in several, or on an existing Dask cluster; and its rows on
disk: the ledger, which survives a kill, and the table.
"""

from __future__ import annotations

import csv
import fcntl
import io
import json
import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np

from mlmem.atomic_files import write_atomically
from mlmem.parsing import DecodeError, require_regular
from mlmem_ros import __version__

from .campaign import Campaign, CampaignError, Row, evaluate_one

if TYPE_CHECKING:
    from distributed import Client

LEDGER_HEADER = b'{"campaign":'


class Ledger:
    """A file of JSON lines: the campaign's definition, then one row per finished point.

    Every row is handed to the system before the next is taken. A kill can tear the last line; it
    is dropped when the ledger is opened again, and its point is evaluated again. Use the ledger as
    a context manager; a second process that opens it is refused.
    """

    def __init__(self, path: Path, campaign: Campaign) -> None:
        """Open the ledger of a campaign, to begin or to continue it.

        Raises:
            CampaignError: It belongs to another campaign, is in use, or is not a ledger.
            OSError: The file cannot be read or written.
        """
        self.path = path
        self.rows: dict[int, Row] = {}
        if path.exists():
            _require_regular(path)
        self._stream: IO[bytes] = path.open('ab+')
        try:
            self._lock_file()
            self._read(campaign)
        except BaseException:
            self._stream.close()
            raise

    def __enter__(self) -> Ledger:
        return self

    def __exit__(self, *_: object) -> None:
        self._stream.close()

    def append(self, row: Row) -> None:
        """Store the row of a point.

        Raises:
            OSError: The disk is full or gone.
        """
        self._write(row)
        self.rows[row['point']] = row

    def table(self) -> list[Row]:
        """Return the finished rows in the order of their points."""
        return [self.rows[point] for point in sorted(self.rows)]

    def _lock_file(self) -> None:
        try:
            fcntl.flock(self._stream, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise CampaignError(
                f'{self.path} is in use by another process; wait for it or end it'
            ) from None

    def _read(self, campaign: Campaign) -> None:
        self._stream.seek(0)
        content = self._stream.read()
        whole = content.rfind(b'\n') + 1
        if whole:
            definition, self.rows = _parse_ledger(self.path, content[:whole])
            self._check(definition, campaign)
        elif not content.startswith(LEDGER_HEADER[: len(content)]):
            raise CampaignError(f'{self.path} is not the ledger of a campaign')
        self._stream.truncate(whole)
        if not whole:
            self._write({'campaign': campaign.definition()})

    def _check(self, found: dict[str, Any], campaign: Campaign) -> None:
        wanted, points = json.loads(json.dumps(campaign.definition())), campaign.points
        other = [name for name in wanted if wanted[name] != found.get(name)]
        if not other and not all(
            0 <= point < len(points) and points[point].items() <= row.items()
            for point, row in self.rows.items()
        ):
            other = ['set of points']
        if other:
            raise CampaignError(
                f'{self.path} belongs to a study with another {", ".join(other)}; '
                'give this one its own folder, or remove that one'
            )

    def _write(self, line: Row) -> None:
        self._stream.write(json.dumps(line, separators=(',', ':')).encode() + b'\n')
        self._stream.flush()


def read(path: Path) -> tuple[dict[str, Any], list[Row]]:
    """Return the definition and the rows of a ledger in the order of their points.

    Unlike `Ledger` it needs no campaign, and accepts a ledger that is still being written.

    Raises:
        CampaignError: It is not a ledger.
        OSError: It cannot be read.
    """
    if path.exists():
        _require_regular(path)
    content = path.read_bytes()
    definition, rows = _parse_ledger(path, content[: content.rfind(b'\n') + 1])
    return definition, [rows[point] for point in sorted(rows)]


def _require_regular(path: Path) -> None:
    try:
        require_regular(path)
    except DecodeError as error:
        raise CampaignError(f'{path}: {error}') from error


def _parse_ledger(path: Path, content: bytes) -> tuple[dict[str, Any], dict[int, Row]]:
    """Return the definition in a ledger's whole lines, and its rows by point."""
    try:
        head, *rows = map(json.loads, content.splitlines())
        return head['campaign'], {int(row['point']): row for row in rows}
    except (ValueError, LookupError, TypeError) as error:
        raise CampaignError(f'{path} is not the ledger of a campaign; {error!r}') from error


def save_table(rows: Sequence[Row], path: Path) -> Path:
    """Write rows as CSV and return the file.

    Args:
        rows: At least one, all with the same names.

    Raises:
        OSError: It cannot be written.
    """
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator='\n')
    writer.writeheader()
    writer.writerows(rows)
    write_atomically(path, text.getvalue())
    return path


SCHEDULER_TIMEOUT = '10s'
"""How long to wait for the scheduler of a cluster."""


def run(
    campaign: Campaign,
    ledger: Ledger,
    executor: Executor | None,
    points: Sequence[int] | None = None,
) -> Iterator[Row]:
    """Evaluate the points missing from the ledger; yield every row once it is stored.

    They are taken in shuffled order, so that progress predicts the remaining time.

    Args:
        ledger: Its ledger, opened; rows are appended to it.
        executor: Where (see `provide_workers`); None for this process.

    Raises:
        CampaignError: A worker died, or a point could not be evaluated; its error is the cause.
            Earlier results are kept.
    """
    wanted = range(len(campaign.points)) if points is None else points
    order = np.random.Generator(np.random.PCG64(campaign.seed)).permutation(wanted)
    todo = [int(point) for point in order if int(point) not in ledger.rows]
    for point, result in _iterate_results(campaign, todo, executor):
        try:
            row = result()
        except BrokenExecutor as error:
            raise CampaignError(
                'a worker process died, perhaps out of memory; results so far are kept: '
                'repeat the command with fewer jobs'
            ) from error
        except Exception as error:
            raise CampaignError(
                f'point {point} of {campaign.name}, {dict(campaign.points[point])}, could not be '
                f'evaluated: {error!r}; earlier results are kept'
            ) from error
        ledger.append(row)
        yield row


def _iterate_results(
    campaign: Campaign, todo: Sequence[int], executor: Executor | None
) -> Iterator[tuple[int, Callable[[], Row]]]:
    """Yield every point when it is its turn or it is done, with what returns its row."""
    if executor is None:
        for point in todo:
            yield point, partial(campaign.evaluate_point, point)
        return
    points = {executor.submit(evaluate_one, *campaign.task(point)): point for point in todo}
    try:
        for future in as_completed(points):
            yield points[future], future.result
    finally:
        for future in points:
            future.cancel()


def count_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def provide_workers(jobs: int, cluster: str = '') -> Iterator[Executor | None]:
    """Provide an executor of `concurrent.futures`; None stands for this process.

    Args:
        jobs: Parallel processes on this machine; 1 for this one only.
        cluster: Address of a Dask scheduler, such as 'tcp://host:8786', to use instead; its
            workers need mlmem_ros installed.

    Raises:
        CampaignError: The cluster does not answer, or jobs is below 1.
        ModuleNotFoundError: A cluster is named and dask.distributed is not installed.
    """
    if cluster:
        with _connect_cluster(cluster) as executor:
            yield executor
    elif jobs < 1:
        raise CampaignError(f'jobs must be at least 1; got {jobs}')
    elif jobs == 1:
        yield None
    else:
        # Spawned, not forked: a forked child could inherit a lock that numba holds.
        context = multiprocessing.get_context('spawn')
        pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin_worker)
        try:
            yield pool
        finally:
            pool.shutdown(cancel_futures=True)


def _begin_worker() -> None:
    """Leave Ctrl-C to the parent, and end with it even if it is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    assert parent is not None

    def end_with_parent() -> None:
        wait([parent.sentinel])
        os._exit(1)

    threading.Thread(target=end_with_parent, daemon=True).start()


@contextmanager
def _connect_cluster(address: str) -> Iterator[Executor]:
    from distributed import Client

    try:
        client = Client(address, timeout=SCHEDULER_TIMEOUT, set_as_default=False)
    except (OSError, ValueError) as error:  # a timeout is an OSError
        raise CampaignError(
            f'no Dask scheduler answers at {address!r} (such as tcp://host:8786); {error}'
        ) from error
    with client:
        _check_versions(client, address)
        executor = client.get_executor(pure=False)
        try:
            yield executor
        finally:
            executor.shutdown(wait=False)


def _check_versions(client: Client, address: str) -> None:
    def find_version() -> str:  # local, so that it is sent as code: the worker may lack both
        try:
            import mlmem_lab  # noqa: F401
            from mlmem_ros import __version__ as installed
        except ImportError:
            return 'none'
        return installed

    if found := set(client.run(find_version).values()) - {__version__}:
        raise CampaignError(
            f'the workers of {address} must have mlmem_lab and mlmem_ros {__version__}; got '
            f'{", ".join(sorted(found))}'
        )
