# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A running element for pages: its node's messages as frames, and the pages' requests; and the
queue of each open page: a slow one misses pictures and delays nobody.
"""

from __future__ import annotations

import asyncio
import time
from collections import deque
from collections.abc import AsyncIterator, Callable
from functools import partial
from typing import TYPE_CHECKING, Any

from mlmem import element_file
from mlmem_ros.contract.answers import RequestError
from mlmem_ros.contract.requests import load_action_types
from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC, Qos, Status, Topic, parse_status
from mlmem_ros.host.settings import DESCRIPTION

from .about import About
from .frames import PICTURED_STREAMS, Pictures, pack_frame, thin_echo
from .requests import HEALTHY_FAULTS, Activity, PageRequests

if TYPE_CHECKING:
    from mlmem_ros.ros.client import MemoryClient


class Page:
    """The queue of one page: of news the newest, of pictures only the last."""

    def __init__(self, max_news: int = 64) -> None:
        self._news: deque[bytes] = deque(maxlen=max_news)
        self._picture: bytes | None = None
        self._ready = asyncio.Event()

    def add_news(self, frame: bytes) -> None:
        """Add news; the oldest are dropped if there are too many."""
        self._news.append(frame)
        self._ready.set()

    def set_picture(self, frame: bytes) -> None:
        """Replace the picture that waits."""
        self._picture = frame
        self._ready.set()

    async def iterate_frames(self) -> AsyncIterator[bytes]:
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


class Live:
    """The element behind a node, in the server's event loop."""

    def __init__(self, client: MemoryClient, max_silence_s: float = 2.5) -> None:
        """Listen; to be called in the event loop.

        Args:
            max_silence_s: Seconds of silence after which the node counts as gone; it reports its
                health every second.
        """
        self._client, self._max_silence_s = client, max_silence_s
        self._loop = asyncio.get_running_loop()
        self.pages = set[Page]()
        self._about: About | None = None
        self._activity = Activity()
        self.requests = PageRequests(client, self._activity)
        self._latest: dict[str, bytes] = {}  # what a new page gets first
        self._pictures = Pictures(self._loop, self._show_picture)
        self._last_message, self._present, self._ticks = -max_silence_s, False, 0.0
        self._meeting: asyncio.Task[None] | None = None
        self._left = time.monotonic()
        self._twin: tuple[float, dict[str, Status]] = -max_silence_s, {}
        self._streams: list[Any] = []
        self._subscribe_topics()
        self._watch_streams(True)
        self._keeper = self._loop.create_task(self._supervise_node())

    # --- pages ---------------------------------------------------------------------------

    def open(self) -> Page:
        """Return a page that gets everything known so far, and whatever comes from now on."""
        page = Page()
        self._watch_streams(True)
        for frame in self._latest.values():
            page.add_news(frame)
        page.add_news(self._pictures.pack_history())
        self.pages.add(page)
        return page

    def close(self, page: Page) -> None:
        """Forget a page."""
        self.pages.discard(page)
        self._left = time.monotonic()

    def end(self) -> None:
        """Stop listening."""
        self._keeper.cancel()
        self._watch_streams(False)

    # --- what the node publishes -------------------------------------------------------------

    def _subscribe_topics(self) -> None:
        parameter_events = Topic(
            '/parameter_events',
            'rcl_interfaces/msg/ParameterEvent',
            Qos.KEEP_ALL,
            'parameters that were set',
        )
        hand_over: Callable[..., Any] = self._loop.call_soon_threadsafe  # from the client's thread
        for topic, take in (
            (STREAMS['level'], self._on_level),
            (STREAMS['word'], self._on_level),
            (STREAMS['content'], self._on_content),
            (STREAMS['outcome'], self._on_outcome),
            (STREAMS['echo'], self._on_echo),
            (DIAGNOSTICS_TOPIC, self._on_diagnostics),
            (parameter_events, self._on_parameters),
        ):
            _subscribe_topic(self._client, topic, partial(hand_over, take))
        for name, action in load_action_types().items():
            self._client.node.create_subscription(
                action.Impl.FeedbackMessage,
                f'{self._client.name}/{name}/_action/feedback',
                partial(hand_over, partial(self._on_feedback, name)),
                Qos.RELIABLE.profile,
            )

    def _watch_streams(self, on: bool) -> None:
        if on and not self._streams:
            self._streams = [
                _subscribe_topic(
                    self._client, STREAMS[name], partial(self._pictures.take_message, name)
                )
                for name in PICTURED_STREAMS
            ]
        elif not on:
            while self._streams:
                self._client.node.destroy_subscription(self._streams.pop())

    def _on_level(self, message: Any) -> None:
        self._note_message()
        self._announce_frame('level', {'level': message.data})

    def _on_content(self, message: Any) -> None:
        self._note_message()
        self._announce_frame(
            'content', {**parse_status(message)._asdict(), 't': self._pictures.clock}
        )

    def _on_outcome(self, message: Any) -> None:
        self._note_message()
        # the echo that it was decoded from comes first
        self._loop.call_later(0.03, self._end_procedure, parse_status(message))

    def _end_procedure(self, outcome: Status) -> None:
        self._activity.note_end(outcome.values.get('procedure', ''))
        self._announce_frame('outcome', {**outcome._asdict(), 't': self._pictures.clock})

    def _on_echo(self, message: Any) -> None:
        self._note_message()
        data = thin_echo(message)
        self._announce_frame('echo', {'samples': data.shape[1]}, data)

    def _on_feedback(self, name: str, message: Any) -> None:
        self._activity.take_feedback(name, message.feedback)

    def _on_parameters(self, message: Any) -> None:
        if message.node == self._client.name:
            self._note_message()
            self._schedule_meeting()

    def _on_diagnostics(self, message: Any) -> None:
        parts = _parse_components(message, self._client.name)
        if 'twin' in parts:  # from the residual monitor, a node of its own
            self._twin = time.monotonic(), parts
        if 'loop' not in parts:
            return
        if time.monotonic() - self._twin[0] < self._max_silence_s:
            parts |= self._twin[1]
        self._note_message()
        loop = parts['loop'].values
        self._activity.take_report(loop.get('procedure', ''))
        ticks = float(loop.get('ticks', 0.0))
        if ticks < self._ticks:  # another life of the node
            self._schedule_meeting()
        self._ticks = ticks
        self._announce_frame(
            'health', {'parts': {name: part._asdict() for name, part in parts.items()}}
        )

    def _note_message(self) -> None:
        self._last_message = time.monotonic()
        if not self._present:
            self._present = True
            self._schedule_meeting()

    # --- meeting a node ------------------------------------------------------------------

    def _schedule_meeting(self) -> None:
        """Ask for the parameters that pages need; start again if they change meanwhile."""
        if self._meeting is not None:
            self._meeting.cancel()
        self._meeting = self._loop.create_task(self._request_parameters())

    async def _request_parameters(self) -> None:
        await asyncio.sleep(0.05)  # they change by the dozen
        try:
            parameters = await self._client.parameters(
                DESCRIPTION, 'time.speed', *HEALTHY_FAULTS, timeout=3.0
            )
            element = element_file.parse(parameters[DESCRIPTION], DESCRIPTION)
            about = About(element.design, element.settings, self._client.name, parameters)
        except (RequestError, ValueError) as error:
            self._announce_link(str(error))
            self._present = False
            return
        if self._about is not None and about.design != self._about.design:
            self._pictures.clear_history()
        self._about = self.requests.about = about
        self._announce_frame('element', about.json)
        self._announce_link('')

    def _show_picture(self) -> None:
        self._note_message()
        if self._about is None:
            return
        picture = self._pictures.make_picture(self._about, self._activity.describe_running())
        if picture is not None:
            for page in self.pages:
                page.set_picture(picture)

    async def _supervise_node(self) -> None:
        """Notice a node that is gone, and streams that nobody watches."""
        self._announce_link(f'waiting for {self._client.name}')
        while True:
            await asyncio.sleep(0.25)
            now = time.monotonic()
            if self._present and now - self._last_message > self._max_silence_s:
                self._present = False
                self._activity.note_end()
                self._announce_link(f'{self._client.name} is silent')
            if not self.pages and now - self._left > 30.0:  # streams cost the node time
                self._watch_streams(False)

    def _announce_link(self, problem: str) -> None:
        """Announce whether the node answers: no problem, or the reason."""
        self._announce_frame('link', {'problem': problem})

    def _announce_frame(self, kind: str, values: dict[str, Any], body: Any = None) -> None:
        """Send to all pages, and to those that open later."""
        frame = pack_frame({'k': kind, **values}, body)
        self._latest.pop(kind, None)  # in the order of their latest values
        self._latest[kind] = frame
        for page in self.pages:
            page.add_news(frame)


def _parse_components(message: Any, node: str) -> dict[str, Status]:
    """Return the status of every component of a node in a DiagnosticArray, by its name."""
    prefix = f'{node[1:]}: '
    return {
        status.name.removeprefix(prefix): parse_status(status)
        for status in message.status
        if status.name.startswith(prefix)
    }


def _subscribe_topic(client: MemoryClient, topic: Topic, take: Callable[[Any], None]) -> Any:
    """Subscribe to a topic of a client's memory node, of a stream to the newest message; `take` is
    called in the thread that spins the client's node.
    """
    name = topic.name if topic.name[0] == '/' else f'{client.name}/{topic.name}'
    qos = (Qos.SENSOR_DATA if topic.qos is Qos.STREAM else topic.qos).profile
    return client.node.create_subscription(topic.kind, name, take, qos)
