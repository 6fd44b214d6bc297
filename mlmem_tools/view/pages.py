# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Open pages, and the queue of each: a slow one misses pictures and delays nobody."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import AsyncIterator

KEPT = 64
"""Most news items queued for a page; of pictures only the newest is queued."""

MOST = 16
"""Most pages served at a time."""


class Page:
    """The queue of one page."""

    def __init__(self) -> None:
        self._news: deque[bytes] = deque(maxlen=KEPT)
        self._picture: bytes | None = None
        self._ready = asyncio.Event()

    def tell(self, frame: bytes) -> None:
        """Add news; the oldest are dropped if there are too many."""
        self._news.append(frame)
        self._ready.set()

    def show(self, frame: bytes) -> None:
        """Replace the picture that waits."""
        self._picture = frame
        self._ready.set()

    async def frames(self) -> AsyncIterator[bytes]:
        """Yield what there is to send, one item at a time."""
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
        """Send news to all of them."""
        for page in self:
            page.tell(frame)

    def show(self, frame: bytes) -> None:
        """Send a picture to all of them."""
        for page in self:
            page.show(frame)
