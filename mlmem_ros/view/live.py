# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A running element for pages: its node's messages as pictures, and the pages' requests."""

from __future__ import annotations

import asyncio
import time
from typing import TYPE_CHECKING, Any

from ..contract import told, topics
from ..contract.errors import RequestError
from . import ear
from .actions import Actions, Asked
from .activity import Activity
from .echoes import thinned
from .element import WANTED, Element
from .frames import packed
from .pages import Page, Pages
from .pictures import Pictures
from .requests import Requests

if TYPE_CHECKING:
    from ..ros.client import MemoryClient

SILENCE = 2.5
"""Seconds of silence after which a node counts as gone; it reports its health every second."""

BEHIND = 0.03
"""Seconds for which an outcome waits for the echo that it was decoded from."""

LEAVE = 30.0
"""Seconds for which the streams are listened to after the last page has gone."""


class Live:
    """The element behind a node. All but `_told` runs in the server's event loop.

    Attributes:
        pages: Open pages; see `open` and `close`.
    """

    def __init__(self, client: MemoryClient) -> None:
        """Listen; to be called in the event loop."""
        self._client = client
        self._loop = asyncio.get_running_loop()
        self.pages = Pages()
        self._element: Element | None = None
        self._activity = Activity()
        self._requests = Requests(Actions(client, lambda: self._element), self._activity)
        self._latest: dict[str, bytes] = {}  # what a new page gets first
        self._pictures = Pictures(self._loop, self._show)
        self._heard, self._present, self._ticks = -SILENCE, False, 0.0
        self._meeting: asyncio.Task[None] | None = None
        self._again = False
        self._left = time.monotonic()
        self._ear = ear.Ear(client, self._told)
        self._ear.watch(True)
        self._keeper = self._loop.create_task(self._keep())

    # --- pages ---------------------------------------------------------------------------

    def open(self) -> Page:
        """Return a page that gets everything known so far, and whatever comes from now on."""
        page = Page()
        self._ear.watch(True)
        for frame in self._latest.values():
            page.tell(frame)
        if (past := self._pictures.past()) is not None:
            page.tell(past)
        self.pages.add(page)
        return page

    def close(self, page: Page) -> None:
        """Forget a page."""
        self.pages.discard(page)
        self._left = time.monotonic()

    def end(self) -> None:
        """Stop listening."""
        self._keeper.cancel()
        self._ear.watch(False)

    async def ask(self, asked: Asked) -> dict[str, Any]:
        """Do what a page asks for; return the reply, whatever the result."""
        return await self._requests.ask(asked)

    @property
    def recordings(self) -> list[str]:
        """Paths of the sessions that pages have recorded."""
        return self._requests.recordings

    # --- what the node publishes -------------------------------------------------------------

    def _told(self, topic: topics.Topic | str, message: Any) -> None:
        """Take a message, in the client's thread."""
        if topic in ear.STREAMS:
            self._pictures.take(topic, message)
        else:
            self._loop.call_soon_threadsafe(self._news, topic, message)

    def _news(self, topic: topics.Topic | str, message: Any) -> None:
        match topic:
            case str():
                self._activity.tells(topic, message.feedback)
            case ear.PARAMETERS:
                if message.node == self._client.name:
                    self._hear()
                    self._meet()
                return
            case topics.DIAGNOSTICS:
                self._health(message)
                return
            case topics.LEVEL:
                self._hear()
                self._announce('level', {'level': message.data})
            case topics.OUTCOME:
                self._hear()
                self._loop.call_later(BEHIND, self._ended, message)
            case topics.ECHO:
                self._hear()
                data = thinned(message)
                self._announce('echo', {'samples': data.shape[1], 't': self._pictures.clock}, data)

    def _ended(self, message: Any) -> None:
        values = told.values(message)
        self._activity.ended(values.get('procedure', ''))
        good = message.level == b'\0'
        said = {'ok': good, 'text': message.message, 'values': values, 't': self._pictures.clock}
        self._announce('outcome', said)

    def _health(self, message: Any) -> None:
        prefix = f'{self._client.name[1:]}: '
        found = {}
        for status in message.status:
            if status.name.startswith(prefix):
                found[status.name.removeprefix(prefix)] = {
                    'severity': status.level[0],
                    'text': status.message,
                    'values': told.values(status),
                }
        if not found:
            return
        self._hear()
        loop = found.get('loop', {}).get('values', {})
        self._activity.running(loop.get('procedure', ''))
        ticks = float(loop.get('ticks', 0.0) or 0.0)
        if ticks < self._ticks:  # another life of the node
            self._meet()
        self._ticks = ticks
        self._announce('health', {'parts': found})

    def _hear(self) -> None:
        self._heard = time.monotonic()
        if not self._present:
            self._present = True
            self._meet()

    # --- meeting a node ------------------------------------------------------------------

    def _meet(self) -> None:
        """Ask for the parameters that pages need; again if they change meanwhile."""
        self._again = True
        if self._meeting is None or self._meeting.done():
            self._meeting = self._loop.create_task(self._ask_parameters())

    async def _ask_parameters(self) -> None:
        while self._again:
            self._again = False
            await asyncio.sleep(0.05)  # they change by the dozen
            try:
                wait = self._client.parameters(*WANTED, timeout=3.0).wait
                parameters = await asyncio.to_thread(wait)
                element = Element.of(parameters, self._client.name)
            except (RequestError, ValueError, TypeError) as error:
                self._announce('link', {'alive': False, 'text': str(error)})
                self._present = False
                return
            if self._element is not None and element.design != self._element.design:
                self._pictures.forget()
            self._element = element
            self._announce('element', element.about)
            self._announce('link', {'alive': True, 'text': ''})

    def _show(self) -> None:
        self._hear()
        if self._element is not None:
            picture = self._pictures.make(self._element, self._activity.told())
            if self.pages:
                self.pages.show(picture)

    async def _keep(self) -> None:
        """Notice a node that is gone, and streams that nobody watches."""
        while True:
            await asyncio.sleep(0.25)
            now = time.monotonic()
            if self._present and now - self._heard > SILENCE:
                self._present = False
                self._activity.ended('')
                text = f'{self._client.name} is silent'
                self._announce('link', {'alive': False, 'text': text})
            elif not self._present and 'link' not in self._latest:
                text = f'waiting for {self._client.name}'
                self._announce('link', {'alive': False, 'text': text})
            if not self.pages and now - self._left > LEAVE:
                self._ear.watch(False)

    def _announce(self, kind: str, said: dict[str, Any], body: Any = None) -> None:
        """Send to all pages, and to those that open later."""
        frame = packed({'k': kind, **said}, body)
        self._latest.pop(kind, None)  # in the order of their latest values
        self._latest[kind] = frame
        self.pages.tell(frame)
