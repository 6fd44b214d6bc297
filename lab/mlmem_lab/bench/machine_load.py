# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""How busy the machine is with work that is not ours."""

from __future__ import annotations

import os
import time
from collections.abc import Iterable
from pathlib import Path

QUIET = 10.0
"""Share of a core, in percent, that others may take on a quiet machine."""

HERTZ = os.sysconf('SC_CLK_TCK')

IDLE = (3, 4, 8, 9)
"""Columns of /proc/stat that are not work, or are counted twice: idle, iowait and guests."""


class Load:
    """Measures from its start which share of a core others use."""

    def __init__(self, processes: Iterable[int] = ()) -> None:
        """Begin to measure.

        Args:
            processes: Ids of the processes that are ours, beside this one. They must live on.
        """
        self._ours = [os.getpid(), *processes]
        self._begun = time.monotonic(), self._others()

    def others(self) -> float:
        """Return the share of others since the start, in percent of a core."""
        when, used = self._begun
        return max(0.0, 100.0 * (self._others() - used) / (time.monotonic() - when))

    def _others(self) -> float:
        """Return the seconds that others have used since the machine started."""
        first = Path('/proc/stat').read_text(encoding='ascii').split('\n', 1)[0].split()[1:]
        busy = sum(int(ticks) for column, ticks in enumerate(first) if column not in IDLE)
        return (busy - sum(map(_used, self._ours))) / HERTZ


def _used(process: int) -> int:
    """Return the ticks of the processor that a process has used, in its code and the system's."""
    fields = Path(f'/proc/{process}/stat').read_text(encoding='utf-8').rpartition(')')[2].split()
    return int(fields[11]) + int(fields[12])
