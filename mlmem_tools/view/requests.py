# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a page may ask for, as requests to the node; nothing else gets through. And what the node
is doing, as seen from outside: from requests, actions and diagnostics.
"""

from __future__ import annotations

import logging
import time
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from time import strftime
from typing import TYPE_CHECKING, Any

from mlmem import Faults
from mlmem.loop.timetable import MAX_SPEED, check_speed
from mlmem.procedure_table import PROCEDURES
from mlmem_ros.contract.answers import NoAnswer, RequestError, RequestRefused
from mlmem_ros.contract.requests import REQUEST_ARGUMENTS

from .about import About

if TYPE_CHECKING:
    from mlmem_ros.ros.client import MemoryClient
    from mlmem_ros.ros.client.reply import Reply


class Activity:
    """The running procedure."""

    def __init__(self, max_report_age_s: float = 1.5) -> None:
        """Take the age that a report in the diagnostics may have; they come once a second."""
        self._doing: dict[str, Any] = {}
        self._max_report_age_s = max_report_age_s
        self._begun = self._ended = -max_report_age_s

    def describe_running(self) -> dict[str, Any]:
        """Return its description for a picture; empty if none runs."""
        if not self._doing:
            return {}
        return {'doing': {**self._doing, 'for': round(time.monotonic() - self._begun, 2)}}

    def note_request(self, asked: Mapping[str, Any]) -> bool:
        """Note a page's request, unless a procedure runs, for then it will be refused; return
        whether it was noted.
        """
        name = asked.get('do')
        if name not in PROCEDURES or (self._doing and name != 'abort'):
            return False
        self._begin_procedure(name, asked.get('level', asked.get('word')))
        return True

    def drop_request(self) -> None:
        """Remove the note."""
        self._doing = {}

    def take_feedback(self, name: str, feedback: Any) -> None:
        """Take the feedback of an action; what waits for its turn is not running."""
        if not feedback.attempts:
            return
        # feedback may come later than the outcome of its procedure
        if not self._doing and time.monotonic() - self._ended > 0.3:
            self._begin_procedure(name)
        if self._doing.get('name') == name:
            self._doing |= {
                'phase': feedback.phase,
                'share': round(feedback.share, 3),
                'attempts': feedback.attempts,
            }

    def take_report(self, name: str) -> None:
        """Take the name of the running procedure, if any, from the diagnostics."""
        now = time.monotonic()
        if name and not self._doing and now - self._ended > self._max_report_age_s:
            self._begin_procedure(name)
        elif not name and now - self._begun > self._max_report_age_s:
            self._doing = {}

    def note_end(self, name: str = '') -> None:
        """Take the end of a procedure; without a name, of any."""
        if not name or self._doing.get('name') in (name, 'abort'):
            self._doing = {}
            self._ended = time.monotonic()

    def _begin_procedure(self, name: str, content: Any = None) -> None:
        self._doing = {'name': name, 'content': content if isinstance(content, int) else None}
        self._begun = time.monotonic()


Asked = Mapping[str, Any]
"""A page's message: `do`, which names the request, and its arguments."""

HEALTHY_FAULTS = {f'faults.{name}': value for name, value in asdict(Faults()).items()}
"""The parameters of all faults, and their values without any."""


class PageRequests:
    """Sends the requests of pages and waits for the answers, in the server's event loop.

    Attributes:
        folder: Where recordings started by pages go, on the node's machine.
        recordings: Paths of the sessions that pages have recorded.
    """

    def __init__(self, client: MemoryClient, activity: Activity) -> None:
        self._client = client
        self._activity = activity
        self.about: About | None = None
        self.folder = Path.cwd() / 'sessions'
        self.recordings: list[str] = []

    async def serve_request(self, asked: Asked) -> dict[str, Any]:
        """Do what a page asks for; return the reply, whatever the result."""
        try:
            return await self._try_request(asked)
        except Exception as error:
            logging.getLogger(__name__).exception(
                'a request of a page failed; this is a fault in the software'
            )
            return {
                'ok': False,
                'kind': 'failed',
                'text': f'a fault in the software: {error!r}'[:200],
            }

    async def _try_request(self, asked: Asked) -> dict[str, Any]:
        try:
            reply = self.send_request(asked)
        except ValueError as error:
            return {'ok': False, 'kind': 'refused', 'text': str(error)}
        began = self._activity.note_request(asked)
        try:
            answer = await reply
        except RequestError as error:
            kind = {RequestRefused: 'refused', NoAnswer: 'silent'}.get(type(error), 'failed')
            if began and kind != 'failed':
                self._activity.drop_request()
            return {'ok': False, 'kind': kind, 'text': str(error)}
        details = dict(getattr(answer, 'details', {}))
        if asked['do'] == 'self_test':
            checks = answer.checks.items()
            details = {
                'checks': [[name, name not in answer.failed, said] for name, said in checks]
            }
            if not answer.passed:
                text = f'failed: {", ".join(answer.failed)}; see the events'
                return {'ok': False, 'kind': 'failed', 'text': text, 'details': details}
        if asked['do'] == 'record' and not answer.recording and answer.path:
            self.recordings.append(answer.path)
            details['id'] = f'r{len(self.recordings) - 1}'
        return {'ok': True, 'details': details}

    def send_request(self, asked: Asked) -> Reply[Any]:
        """Send a page's request.

        Raises:
            ValueError: It is not valid.
        """
        client = self._client
        match asked.get('do'):
            case str(name) if name in PROCEDURES:
                # some procedures write every level
                given = {key: asked[key] for key in REQUEST_ARGUMENTS[name] if key in asked}
                return client.procedure(name, 600.0, **given)
            case 'strain':
                return self._drag_strain(_check_number(asked, 'strain', -1.0, 1.0))
            case 'pause':
                return client.pause(asked.get('hold') is not False)
            case 'step':
                return client.step()
            case 'speed':
                speed = _check_number(asked, 'speed', 0.0, MAX_SPEED)
                return client.set_parameters({'time.speed': check_speed(speed)})
            case 'fault':
                return client.set_parameters(_check_fault(asked))
            case 'clear_faults':
                kept = {'faults.seed'}
                return client.set_parameters(
                    {name: HEALTHY_FAULTS[name] for name in HEALTHY_FAULTS.keys() - kept}
                )
            case 'record':
                on = asked.get('on') is not False
                path = str(self.folder / f'view-{strftime("%Y%m%d-%H%M%S")}')
                return client.record(on, path if on else '')
            case other:
                raise ValueError(f'there is no request {str(other)[:40]!r}')

    def _drag_strain(self, strain: float) -> Reply[Any]:
        """Drag the strain: a smooth move, in the time of the longest one.

        A set-point on `~/strain` would do the same, but be refused silently.
        """
        if self.about is None:
            raise ValueError('the element is not known yet')
        actuator, scale = self.about.settings.actuator, self.about.settings.scale
        seconds = (
            # a smooth move needs at least 1.5
            1.65 * 2.0 * actuator.max_strain / actuator.hand_rate_limit * scale.time
        )
        return self._client.follow([seconds], [strain], [0.0])


def _check_number(asked: Asked, name: str, low: float, high: float) -> float:
    value = asked.get(name)
    if (
        not isinstance(value, int | float)
        or isinstance(value, bool)
        or not low <= value <= high  # also of NaN, and of an integer that no float can hold
    ):
        raise ValueError(f'{name} must be a number from {low:g} to {high:g}')
    return float(value)


def _check_fault(asked: Asked) -> dict[str, Any]:
    name, value = f'faults.{asked.get("name")}', asked.get('value')
    if name not in HEALTHY_FAULTS:
        raise ValueError('name must be the name of a fault')
    if isinstance(HEALTHY_FAULTS[name], float):  # a page writes 7.0 as 7
        value = _check_number(asked, 'value', -1e6, 1e6)
    return {name: value}
