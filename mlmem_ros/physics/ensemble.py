# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Many elements at once: chains of their own designs, advanced side by side on all cores.

Every element is advanced by the kernel of a single chain, which releases the GIL; so the results
are those of a single chain to the bit, whatever the number of workers.

Memory: a chain of its own design takes 17 numbers of 8 bytes per cell with the rigid substrate
and 23 with the elastic one (38 and 50 kB at N = 225); a call adds 6 per element and step.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

from .chain import Chain, Drive
from .errors import StateError
from .potential import Array


class Ensemble:
    """Chains that advance together by the same number of steps.

    They may differ in design, length, substrate, step and state. Use it as a context manager, or
    call `close`, to end its threads.

    Attributes:
        chains: The elements; they may be read and changed between calls.
        workers: Number of threads.
    """

    def __init__(self, chains: Iterable[Chain], workers: int | None = None) -> None:
        """Combine chains.

        Args:
            chains: The elements, each once.
            workers: Number of threads; by default one per core, and no more than elements.

        Raises:
            StateError: There is no chain, one occurs twice, the integrators are not the same, or
                the workers are less than 1.
        """
        self.chains = tuple(chains)
        if not self.chains or len({id(chain) for chain in self.chains}) < len(self.chains):
            raise StateError(
                f'chains must be at least one, each once; got {len(self.chains)} with '
                f'{len({id(chain) for chain in self.chains})} different ones'
            )
        if len({chain.integrator for chain in self.chains}) > 1:
            raise StateError('all chains must have the same integrator')
        self._substeps = self.chains[0].integrator.substeps
        self.workers = min(_cores() if workers is None else workers, len(self.chains))
        if self.workers < 1:
            raise StateError(f'workers must be at least 1; got {workers}')
        self._pool = ThreadPoolExecutor(self.workers, thread_name_prefix='mlmem-ensemble')

    def __len__(self) -> int:
        return len(self.chains)

    def __enter__(self) -> Ensemble:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """End the threads; the chains stay."""
        self._pool.shutdown()

    def advance(
        self,
        V_N: Array,
        drives: Sequence[Drive | None] | None = None,
        shake: Array | None = None,
    ) -> Array:
        """Advance all elements by whole steps.

        Args:
            V_N: Displacement of the substrate's end at the sub-steps, as `Chain.advance` takes
                it, of each element, shape (elements, m steps), or the same for all, (m steps,).
            drives: For each element a boundary cell held at a prescribed motion, or None.
            shake: Acceleration of the base, of the same shapes as V_N, or None.

        Returns:
            Displacements v_1 and v_N of every element after every step, shape
            (elements, 2, steps).

        Raises:
            StateError: The inputs have the wrong shape or are not finite (nothing is changed),
                or elements became non-finite; the others have then advanced.
        """
        rows = self._rows('V_N', V_N)
        shakes: Sequence[Array | None] = (
            [None] * len(self) if shake is None else self._rows('shake', shake)
        )
        held = [None] * len(self) if drives is None else drives
        if len(held) != len(self):
            raise StateError(f'drives must be {len(self)}, one per element; got {len(held)}')
        for chain, row, drive, base in zip(self.chains, rows, held, shakes, strict=True):
            chain.check_inputs(row, drive, base)
        ends = np.empty((len(self), 2, len(rows[0]) // self._substeps))
        lost: list[int] = []

        def work(numbers: Iterator[int]) -> None:
            for i in numbers:
                try:
                    ends[i] = self.chains[i].advance(rows[i], held[i], shakes[i])
                except StateError:
                    lost.append(i)

        numbers = _Shared(len(self))
        for done in [self._pool.submit(work, numbers) for _ in range(self.workers)]:
            done.result()
        if lost:
            raise StateError(f'elements {sorted(lost)} became non-finite')
        return ends

    def _rows(self, name: str, values: Array) -> Sequence[Array]:
        """Return one row for every element, from one for each or one for all."""
        values = np.asarray(values, dtype=np.float64)
        if values.ndim not in (1, 2) or (values.ndim == 2 and len(values) != len(self)):
            wanted = f'({len(self)}, {self._substeps} steps)'
            raise StateError(f'{name} must have shape {wanted}; got {values.shape}')
        return list(values) if values.ndim == 2 else [values] * len(self)

    def rest(self, steps: int) -> Array:
        """Advance by whole steps with every substrate's end held where it is."""
        V_N = np.array([chain.V_N for chain in self.chains])
        return self.advance(np.repeat(V_N[:, None], self._substeps * steps, axis=1))


class _Shared:
    """The numbers below n, each handed to whichever thread asks next."""

    def __init__(self, n: int) -> None:
        self._numbers = iter(range(n))
        self._lock = threading.Lock()

    def __iter__(self) -> Iterator[int]:
        return self

    def __next__(self) -> int:
        with self._lock:
            return next(self._numbers)


def _cores() -> int:
    """Return the number of cores this process may use."""
    return (
        len(os.sched_getaffinity(0)) if hasattr(os, 'sched_getaffinity') else os.cpu_count() or 1
    )
