# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Where points are evaluated: processes of this machine, or an existing Dask cluster."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Iterator
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing.connection import wait
from typing import TYPE_CHECKING

from ... import __version__
from .errors import CampaignError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = '10s'
"""How long to wait for a cluster's scheduler to answer."""


def cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def workers(jobs: int, cluster: str = '') -> Iterator[Executor | None]:
    """Provide an executor of `concurrent.futures`; None stands for this process.

    Args:
        jobs: Parallel processes on this machine; 1 for this one only.
        cluster: Address of a Dask scheduler, as 'tcp://host:8786', whose workers are then used
            instead; they need mlmem_ros installed.

    Raises:
        CampaignError: The cluster does not answer, or jobs is below 1.
        ModuleNotFoundError: A cluster is named and dask.distributed is not installed.
    """
    if cluster:
        with _cluster(cluster) as executor:
            yield executor
    elif jobs < 1:
        raise CampaignError(f'jobs must be at least 1; got {jobs}')
    elif jobs == 1:
        yield None
    else:
        with _processes(jobs) as executor:
            yield executor


@contextmanager
def _processes(jobs: int) -> Iterator[Executor]:
    # Spawned, not forked: a forked child could inherit a lock that numba holds.
    context = multiprocessing.get_context('spawn')
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_begin_worker)
    try:
        yield pool
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


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
def _cluster(address: str) -> Iterator[Executor]:
    from distributed import Client

    try:
        client = Client(address, timeout=PATIENCE, set_as_default=False)
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
    def version() -> str:  # local, so that it is sent as code: the worker may have no mlmem_ros
        try:
            from mlmem_ros import __version__ as installed
        except ImportError:
            return 'none'
        return installed

    if found := set(client.run(version).values()) - {__version__}:
        raise CampaignError(
            f'the workers of {address} must have mlmem_ros {__version__} installed; got '
            f'{", ".join(sorted(found))}'
        )
