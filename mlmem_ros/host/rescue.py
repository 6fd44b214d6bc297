# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What becomes of the content of a device that has failed."""

from __future__ import annotations

import math
from typing import Any

from ..device import Abort, MemoryElement
from ..physics import StateError
from .errors import REFUSALS
from .throttled_log import ThrottledLog


def released(element: MemoryElement, log: ThrottledLog) -> bool:
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
            log.exception('releasing', error)
    return False


class Rescue:
    """Keeps the content of a failed device until the next one is configured."""

    def __init__(self, log: ThrottledLog) -> None:
        self._log = log
        self._content: dict[str, Any] | None = None

    def keep(self, element: MemoryElement) -> None:
        """Keep the content of a released device; of a real one, calibration and statistics."""
        from ..device import snapshot  # few devices fail

        self._content = snapshot.take(element)

    def restore(self, element: MemoryElement | None) -> None:
        """Give a new device what is kept, if it fits; None: forget it."""
        content, self._content = self._content, None
        if content is None or element is None:
            return
        from ..device import snapshot

        try:
            snapshot.restore(element, content)
        except StateError:
            blank = ': the element is blank' if element.simulated else ''
            self._log.warning(f'the failed device had another design{blank}')
        else:
            what = 'content' if element.simulated else 'calibration'
            self._log.info(f'the {what} of the failed device is restored')
