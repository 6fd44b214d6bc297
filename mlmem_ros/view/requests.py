# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What pages ask of a running element, and the replies."""

from __future__ import annotations

import asyncio
from typing import Any

from ..contract.errors import NoAnswer, RequestError, RequestRefused
from .actions import Actions, Asked, BadRequest
from .activity import Activity


class Requests:
    """Sends requests of pages and waits for their answers, in the server's event loop.

    Attributes:
        recordings: Paths of the sessions that pages have recorded.
    """

    def __init__(self, actions: Actions, activity: Activity) -> None:
        """Prepare.

        Args:
            actions: What may be asked for.
            activity: Notified of requests.
        """
        self._actions = actions
        self._activity = activity
        self.recordings: list[str] = []

    async def ask(self, asked: Asked) -> dict[str, Any]:
        """Do what a page asks for; return what it is told, whatever comes of it."""
        try:
            reply = self._actions.ask(asked)
        except (BadRequest, ValueError) as error:
            return {'ok': False, 'kind': 'refused', 'text': str(error)}
        taken = self._activity.asked(asked)
        try:
            found = await _answer(reply)
        except RequestError as error:
            kind = {RequestRefused: 'refused', NoAnswer: 'silent'}.get(type(error), 'failed')
            if taken and kind != 'failed':
                self._activity.refused()
            return {'ok': False, 'kind': kind, 'text': str(error)}
        details = dict(getattr(found, 'details', {}))
        if asked['do'] == 'record':
            details |= self._recorded(details)
        if asked['do'] == 'self_test' and not found.passed:
            failed = '; '.join(f'{name}: {found.checks[name]}' for name in found.failed)
            return {'ok': False, 'kind': 'failed', 'text': failed, 'details': details}
        return {'ok': True, 'details': details}

    def _recorded(self, details: dict[str, Any]) -> dict[str, Any]:
        """Return the number by which a finished recording can be downloaded."""
        if details.get('recording') is not False or not details.get('path'):
            return {}
        if details['path'] not in self.recordings:
            self.recordings.append(details['path'])
        return {'id': f'r{self.recordings.index(details["path"])}'}


def _answer(reply: Any) -> asyncio.Future[Any]:
    """Return a request's answer, which another thread delivers, as a future of this loop."""
    loop = asyncio.get_running_loop()
    answer: asyncio.Future[Any] = loop.create_future()

    def settle() -> None:
        if answer.done():
            return
        if (error := reply.exception()) is not None:
            answer.set_exception(error)
        else:
            answer.set_result(reply.result())

    reply.add_done_callback(lambda _: loop.call_soon_threadsafe(settle))
    return answer
