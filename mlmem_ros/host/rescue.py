# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of the content of a device that has failed."""

from __future__ import annotations

import math
from typing import Any

from ..device import Abort, MemoryElement, snapshot
from ..physics import StateError
from .errors import REFUSALS
from .journal import Journal


def let_go(element: MemoryElement, journal: Journal) -> bool:
    """Bring the strain to zero without a loop; return whether it got there."""
    erase = element.settings.erase
    most = 1 + math.ceil((erase.release + erase.settle) / element.tick)
    try:
        element.apply(Abort('the device has failed'))
        for _ in range(3 * most):
            if element.released:
                return True
            element.advance()
    except Exception as error:
        if not isinstance(error, REFUSALS):
            journal.exception('releasing', error)
    return False


class Rescue:
    """Keeps the content of a failed device until the next one is configured."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._content: dict[str, Any] | None = None

    def keep(self, element: MemoryElement) -> None:
        """Keep the content of a released device."""
        self._content = snapshot.take(element)

    def restore(self, element: MemoryElement) -> None:
        """Give a new device what is kept, if it fits."""
        content, self._content = self._content, None
        if content is None:
            return
        try:
            snapshot.restore(element, content)
        except StateError:
            self._journal.warning('the failed device had another design: the element is blank')
        else:
            self._journal.info('the content of the failed device is restored')
