# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A running element for pages: what its node tells, in pictures; and what pages ask of it."""

from __future__ import annotations

import asyncio
import time
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np

from ..contract import told, topics
from ..contract.errors import NoAnswer, RequestError, RequestFailed, RequestRefused
from . import ear
from .actions import Actions, Asked, BadRequest
from .activity import Activity
from .echoes import thinned
from .element import WANTED, Element
from .frames import counts, packed
from .pages import Page, Pages

if TYPE_CHECKING:
    from ..ros.client import MemoryClient

PERIOD = 0.03
"""Least seconds between two pictures."""

TOGETHER = 0.004
"""Seconds in which the streams of one tick come in."""

SILENCE = 2.5
"""Seconds without a word after which a node counts as gone; it tells its health once a second."""

BEHIND = 0.03
"""Seconds for which an outcome waits for the echo that it was decoded from."""

HISTORY = 1800
"""Pictures that are kept for a page that opens: a minute."""

LEAVE = 30.0
"""Seconds for which the streams are listened to after the last page has gone."""

GAP = 0.2
"""Longest step of the picture's clock in seconds: while nothing comes, it stands still."""


class Live:
    """The element behind a node. All but `_told` runs in the server's event loop.

    Attributes:
        pages: Open pages; see `open` and `close`.
        recordings: Paths of the sessions that pages have recorded.
    """

    def __init__(self, client: MemoryClient) -> None:
        """Listen; to be called in the event loop."""
        self._client = client
        self._loop = asyncio.get_running_loop()
        self.pages = Pages()
        self.recordings: list[str] = []
        self._element: Element | None = None
        self._actions = Actions(client, lambda: self._element)
        self._activity = Activity()
        self._latest: dict[str, bytes] = {}  # what a page that opens is told first
        self._history: deque[tuple[float, float, Any, Any]] = deque(maxlen=HISTORY)
        self._streams: dict[topics.Topic, Any] = {}  # newest messages, from the client's thread
        self._fresh = False
        self._clock, self._stamp = 0.0, time.monotonic()
        self._heard, self._present, self._ticks = -SILENCE, False, 0.0
        self._meeting: asyncio.Task[None] | None = None
        self._again = False
        self._left = time.monotonic()
        self._ear = ear.Ear(client, self._told)
        self._ear.watch(True)
        self._keeper = self._loop.create_task(self._keep())

    # --- pages ---------------------------------------------------------------------------

    def open(self) -> Page:
        """Return a page that is told all there is to know, and whatever comes from now on."""
        page = Page()
        self._ear.watch(True)
        for frame in self._latest.values():
            page.tell(frame)
        if self._history and self._element is not None:
            page.tell(self._past())
        self.pages.add(page)
        return page

    def close(self, page: Page) -> None:
        """Forget a page."""
        self.pages.discard(page)
        self._left = time.monotonic()

    def end(self) -> None:
        """Listen no more."""
        self._keeper.cancel()
        self._ear.watch(False)

    async def ask(self, asked: Asked) -> dict[str, Any]:
        """Do what a page asks for; return what it is told, whatever comes of it."""
        try:
            reply = self._actions.ask(asked)
        except (BadRequest, ValueError) as error:
            return {'ok': False, 'kind': 'refused', 'text': str(error)}
        answer: asyncio.Future[Any] = self._loop.create_future()

        def done(reply: Any) -> None:
            def settle() -> None:
                if answer.done():
                    return
                if (error := reply.exception()) is not None:
                    answer.set_exception(error)
                else:
                    answer.set_result(reply.result())

            self._loop.call_soon_threadsafe(settle)

        taken = self._activity.asked(asked)
        reply.add_done_callback(done)
        try:
            found = await answer
        except RequestRefused as refusal:
            if taken:
                self._activity.refused()
            return {'ok': False, 'kind': 'refused', 'text': str(refusal)}
        except RequestFailed as failure:
            return {'ok': False, 'kind': 'failed', 'text': str(failure)}
        except NoAnswer as silence:
            if taken:
                self._activity.refused()
            return {'ok': False, 'kind': 'silent', 'text': str(silence)}
        except RequestError as error:
            return {'ok': False, 'kind': 'failed', 'text': str(error)}
        details = dict(getattr(found, 'details', {}))
        if asked.get('do') == 'record':
            details |= self._recorded(details)
        if asked.get('do') == 'self_test' and not found.passed:
            failed = '; '.join(f'{name}: {found.checks[name]}' for name in found.failed)
            return {'ok': False, 'kind': 'failed', 'text': failed, 'details': details}
        return {'ok': True, 'details': details}

    def _recorded(self, details: dict[str, Any]) -> dict[str, Any]:
        """Return by which number a finished recording can be fetched."""
        if details.get('recording') is not False or not details.get('path'):
            return {}
        if details['path'] not in self.recordings:
            self.recordings.append(details['path'])
        return {'id': f'r{self.recordings.index(details["path"])}'}

    # --- what the node tells -------------------------------------------------------------

    def _told(self, topic: topics.Topic, message: Any) -> None:
        """Take a message, in the thread of the client."""
        if topic in ear.STREAMS:
            self._streams[topic] = message
            if not self._fresh:
                self._fresh = True
                self._loop.call_soon_threadsafe(self._arrange)
        else:
            self._loop.call_soon_threadsafe(self._news, topic, message)

    def _news(self, topic: topics.Topic, message: Any) -> None:
        match topic:
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
                self._announce('echo', {'samples': data.shape[1], 't': self._clock}, data)

    def _ended(self, message: Any) -> None:
        values = told.values(message)
        self._activity.ended(values.get('procedure', ''))
        good = message.level == b'\0'
        said = {'ok': good, 'text': message.message, 'values': values, 't': self._clock}
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
        """Ask for the parameters that pages are made from; again if they change meanwhile."""
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
                self._history.clear()
            self._element = element
            self._announce('element', element.about)
            self._announce('link', {'alive': True, 'text': ''})

    async def _keep(self) -> None:
        """Notice a node that is gone, and streams that nobody looks at."""
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
        """Tell all pages, and those that open later."""
        frame = packed({'k': kind, **said}, body)
        self._latest.pop(kind, None)  # in the order of the last ones
        self._latest[kind] = frame
        self.pages.tell(frame)

    # --- pictures ------------------------------------------------------------------------

    def _arrange(self) -> None:
        """Have a picture made of what is coming in, not sooner than a period after the last."""
        self._hear()
        due = self._stamp + PERIOD - time.monotonic()
        self._loop.call_later(max(due, TOGETHER), self._picture)

    def _picture(self) -> None:
        self._fresh = False
        now = time.monotonic()
        self._clock += min(now - self._stamp, GAP)
        self._stamp = now
        element, field = self._element, self._streams.get(topics.FIELD)
        if element is None:
            return
        joints, walls = self._streams.get(topics.JOINT_STATES), self._streams.get(topics.WALL)
        head: dict[str, Any] = {'k': 'picture', 't': self._clock, **self._activity.told()}
        strain = 0.0
        if joints is not None:
            strain = told.displacement(joints) / element.length
        head['strain'] = strain
        head['walls'] = list(walls.data) if walls is not None else []
        column = None
        if field is not None and len(field.data) == element.design.N:
            column = counts(np.asarray(field.data)[:: element.stride], element.phases)
            self._history.append((self._clock, strain, head['walls'], column))
        if self.pages:
            self.pages.show(packed(head, column))

    def _past(self) -> bytes:
        """Return what the picture shows already."""
        t, strain, walls, columns = zip(*self._history, strict=True)
        head = {'k': 'history', 't': t, 'strain': strain, 'walls': walls}
        return packed(head, np.stack(columns))
