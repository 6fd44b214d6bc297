# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Open pages, and what waits for each: a slow one misses pictures and holds up nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator

KEPT = 64
"""News that wait for a page at most; of pictures only the newest waits."""

MOST = 16
"""Pages that are served at a time."""


class Page:
    """What waits for one page."""

    def __init__(self) -> None:
        self._news: deque[bytes] = deque(maxlen=KEPT)
        self._picture: bytes | None = None
        self._ready = asyncio.Event()

    def tell(self, frame: bytes) -> None:
        """Add news; the oldest are dropped where they are too many."""
        self._news.append(frame)
        self._ready.set()

    def show(self, frame: bytes) -> None:
        """Replace the picture that waits."""
        self._picture = frame
        self._ready.set()

    async def frames(self) -> AsyncIterator[bytes]:
        """Yield what there is to send, when it is asked for the next one."""
        while True:
            await self._ready.wait()
            if self._news:
                yield self._news.popleft()
            elif self._picture is not None:
                frame, self._picture = self._picture, None
                yield frame
            else:
                self._ready.clear()


class Pages(set[Page]):
    """All open pages."""

    @property
    def full(self) -> bool:
        """Whether no other page is served."""
        return len(self) >= MOST

    def tell(self, frame: bytes) -> None:
        """Tell all of them news."""
        for page in self:
            page.tell(frame)

    def show(self, frame: bytes) -> None:
        """Show all of them a picture."""
        for page in self:
            page.show(frame)
