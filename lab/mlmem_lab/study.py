# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem study`: measure many cases, on all cores, and keep each result as soon as it is there.

Without a case, those are measured that its file in lab/results lacks or whose modules have
changed. So a study that was stopped goes on when the command is repeated.
"""

from __future__ import annotations

import argparse
import importlib
import multiprocessing
import os
import shlex
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any, TypeVar

from rich.console import Console

from mlmem_tools.cli.command import JOBS_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, print_failure, show_progress

from . import results

Result = TypeVar('Result')

STUDY_MODULES = {
    'astray': 'windows.astray',
    'bad_cells': 'reads.bad_cells',
    'behaviour': 'behaviour',
    'curves': 'measured.study',
    'forecasts': 'forecasts',
    'kicks': 'windows.kicks',
    'one_wire': 'one_wire',
    'proofs': 'studies.proof',
    'reads': 'reads.count',
    'robust_reads': 'robust_reads',
    'robust_words': 'words',
    'robust_writes': 'robust_writes',
    'robust_losses': 'robust_losses',
    'shaken': 'shaken',
    'times': 'times',
    'tolerance': 'studies.tolerance.study',
    'twin_alarms': 'twins.study',
    'twin_changes': 'twins.study',
    'twin_fits': 'twins.study',
    'unseen': 'measured.study',
    'validity': 'validity',
    'words': 'words',
}
"""Module of every study, by its name, which is that of its result file: it defines NAME_study."""


def sum_counts(counts: Iterable[Mapping[str, Any]]) -> dict[str, int]:
    """Return the sums of whole numbers by name."""
    total = Counter[str]()
    for each in counts:
        total.update({name: count for name, count in each.items() if isinstance(count, int)})
    return dict(total)


@dataclass(frozen=True)
class Study:
    """What is measured of which cases.

    Attributes:
        name: That of the result file.
        measure: Returns what is found of a case; with a seed it takes this as `seed`. Another
            process must be able to import it.
        cases: The names of all cases.
        modules: Files of the checkout that are measured in addition to the device.
        seed: Of all random numbers; None if there are none.
        summarise: Returns what the result file has in addition, from what was found of every case.
        draw: Returns a Matplotlib figure of a result.
        is_sized: Whether `measure` takes how much is counted of a case, as `count`.
        file: The result file, if it is none of the pages.
        device_modules: What is measured of the device.
    """

    name: str
    measure: Callable[..., Any]
    cases: tuple[str, ...]
    modules: tuple[str, ...]
    seed: int | None = None
    summarise: Callable[[Mapping[str, Any]], Mapping[str, Any]] = lambda cases: {}
    draw: Callable[[Mapping[str, Any]], Any] | None = None
    is_sized: bool = False
    file: Path | None = None
    device_modules: tuple[str, ...] = results.DEVICE_MODULES

    @property
    def path(self) -> Path:
        """The result file."""
        return self.file or results.RESULT_FOLDER / f'{self.name}.json'

    def list_missing(self) -> list[str]:
        """Return the cases that the result file lacks, or whose modules have changed."""
        kept = results.load_kept(self.path)
        stale = set(results.find_stale_entries(kept)) if kept else set()
        known = set(kept.get('hashes', {})) - stale
        return [case for case in self.cases if case not in known]

    def measure_cases(
        self, console: Console, jobs: int | None, cases: Sequence[str], count: int | None = None
    ) -> None:
        """Measure some cases, and keep each result at once.

        Args:
            jobs: Processes side by side; None for one a core.
            count: How much is counted of each; None for the usual amount.

        Raises:
            ValueError, OSError: The result file cannot be read or written.
        """
        options = {'seed': self.seed, 'count': count}
        options = {name: value for name, value in options.items() if value is not None}
        measure = partial(self.measure, **options)
        left, is_whole = iter(cases), set(cases) == set(self.cases)
        map_calls(
            console, jobs or count_cores(), self.name, measure, cases,
            then=lambda found: self.keep(next(left), found, is_whole),
        )  # fmt: skip

    def keep(self, case: str, found: Any, is_whole: bool = False) -> None:
        """Put what was found of a case into the result file; the time of a whole run replaces
        that of the last one.
        """
        kept = results.load_kept(self.path)
        if is_whole:
            kept.pop('seconds', None)
        known = kept.get('cases', {}) | {case: found}
        cases = {each: known[each] for each in self.cases if each in known}
        command = shlex.join(['mlmem', 'study', self.name, *cases])
        modules = [*self.device_modules, *self.modules]
        result = {'cases': cases, **self.summarise(cases)}
        results.save_result(self.path, result, command, modules, [case], self.seed, kept)

    def draw_picture(self, picture: Path) -> None:
        """Draw the result file, and note the picture if it is on a page."""
        from .studies.style import style_context

        assert self.draw is not None
        with style_context():
            figure = self.draw(results.load_result(self.path))
            figure.savefig(picture, metadata={'Software': None})
        file = results.find_in_checkout(self.path)
        command = f'mlmem study {self.name} --figure {picture}'
        results.keep_picture(picture, command, [*self.modules, file])


def load_study(name: str) -> Study:
    """Return a study by its name, one of `STUDY_MODULES`."""
    module = importlib.import_module(f'.{STUDY_MODULES[name]}', __package__)
    found: Study = getattr(module, f'{name}_study')
    return found


@declare_command(
    'measure many cases, and keep the results for the pages',
    declare_option('name', choices=tuple(STUDY_MODULES), metavar='STUDY',
        help=', '.join(STUDY_MODULES)),
    declare_option('cases', nargs='*', metavar='CASE',
        help='such as an element; none: those that the result file lacks'),
    declare_option('--list', action='store_true', help='list the cases and exit'),
    declare_option('--figure', type=Path, metavar='PNG', help='only draw the result file'),
    declare_option('--count', type=int, metavar='N', help='how much is counted of each case'),
    JOBS_OPTION,
    text=__doc__,
)  # fmt: skip
def study(arguments: argparse.Namespace) -> int:
    """Measure; return 0, 1 if the result cannot be read or written, 2 for a wrong argument."""
    console, chosen = create_console(aside=False), load_study(arguments.name)
    if unknown := sorted(set(arguments.cases) - set(chosen.cases)):
        known = ', '.join(chosen.cases)
        return print_failure('study', f'a case must be one of {known}; got {unknown[0]}', 2)
    if arguments.figure is not None and chosen.draw is None:
        return print_failure('study', f'{chosen.name} has no figure', 2)
    if arguments.count is not None and not chosen.is_sized:
        return print_failure('study', f'{chosen.name} has a fixed size', 2)
    if arguments.list:
        console.print(*chosen.cases, sep='\n', highlight=False)
        return 0
    try:
        if arguments.figure is not None:
            chosen.draw_picture(arguments.figure)
            return 0
        cases = arguments.cases or chosen.list_missing()
        chosen.measure_cases(console, arguments.jobs, cases, arguments.count)
    except KeyError as error:
        return print_failure('study', f'{chosen.path} lacks {error}: measure its cases first', 1)
    except (OSError, ValueError) as error:
        return print_failure('study', f'{chosen.path}: {error}', 1)
    console.print(f'{len(cases)} cases: {chosen.path}', highlight=False, soft_wrap=True)
    return 0


# --- many calls, on all cores ------------------------------------------------------------------


def count_cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, 'sched_getaffinity'):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def provide_workers(jobs: int) -> Iterator[Executor | None]:
    """Provide an executor of so many processes; None, for a single job, stands for this one."""
    if jobs <= 1:
        yield None
        return
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


def map_calls(
    console: Console,
    jobs: int,
    what: str,
    function: Callable[..., Result],
    *columns: Iterable[Any],
    then: Callable[[Result], object] = lambda result: None,
) -> list[Result]:
    """Return the results of calls in their order, with a progress bar.

    Args:
        jobs: Processes side by side; 1 for this one.
        *columns: Its arguments, as for `map`.
        then: Is given every result in turn, while others are computed.
    """
    tasks = list(zip(*columns, strict=True))
    found: list[Result] = []
    if not tasks:
        return found
    with provide_workers(min(jobs, len(tasks))) as pool:
        done = (map if pool is None else pool.map)(function, *zip(*tasks, strict=True))

        def iterate_results() -> Iterator[object]:
            for result in done:
                found.append(result)
                yield then(result)

        show_progress(console, iterate_results(), len(tasks), what)
    return found
