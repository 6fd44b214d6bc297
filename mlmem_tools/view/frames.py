# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames sent to a page, and the pictures in them of a running element, with the last minute's.

A frame is the length of its header (uint32, little-endian), the header, which is JSON, and the
body, numbers in binary form. Blanks pad the header, so that the body begins at a multiple of four.
"""

from __future__ import annotations

import asyncio
import json
import math
import struct
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem_ros.contract import answers

from ..json_values import to_json_value
from .about import About


def pack_frame(head: dict[str, Any], body: NDArray[Any] | None = None) -> bytes:
    """Return a frame, in whose header numbers that are not finite become null; integers are sent
    as int16, reals as float32.
    """
    data = b''
    if body is not None:
        kind = '<i2' if body.dtype.kind == 'i' else '<f4'
        head = {**head, 'body': kind[1:]}
        data = np.ascontiguousarray(body, dtype=kind).tobytes()
    text = json.dumps(to_json_value(head), separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 4)
    return struct.pack('<I', len(text)) + text + data


def thin_echo(message: Any) -> NDArray[np.float32]:
    """Return times and v_c of an echo, thinned out, of shape (2, n).

    Raises:
        ValueError: It is not an echo.
    """
    t, _, v_c = answers.parse_echo(message)
    group = math.ceil(len(t) / 1200)  # samples on a page; of a group the largest is kept
    whole = len(t) // group * group
    t, v_c = t[:whole].reshape(-1, group)[:, -1], v_c[:whole].reshape(-1, group).max(axis=1)
    return np.stack((t, v_c)).astype(np.float32)


def read_walls(message: Any) -> list[float]:
    """Return the sites of the walls."""
    return [round(float(site), 3) for site in message.data]


PICTURED_STREAMS = ('field', 'wall', 'joint_states')
"""Streams that a picture shows."""


class Pictures:
    """Makes pictures of the newest messages; any thread may call
    `take_message`, the loop the rest.
    """

    def __init__(self, loop: asyncio.AbstractEventLoop, due: Callable[[], None]) -> None:
        """Call `due` in the server's event loop when it is time for a picture."""
        self.clock = 0.0
        self._loop = loop
        self._due = due
        self._stamp = time.monotonic()
        self._newest: dict[str, Any] = {}
        self._fresh = False
        # one minute for a page that opens
        self._history: deque[tuple[float, float, Any]] = deque(maxlen=1800)
        self._shown: tuple[dict[str, Any], bytes] = ({}, b'')  # without its time
        self._held = 0.0  # until when nothing has changed since

    def take_message(self, name: str, message: Any) -> None:
        """Take a message of one of `PICTURED_STREAMS`."""
        self._newest[name] = message
        if not self._fresh:
            self._fresh = True
            self._loop.call_soon_threadsafe(self._schedule_picture)

    def clear_history(self) -> None:
        """Discard the history: it was another element's."""
        self._history.clear()

    def make_picture(self, about: About, doing: dict[str, Any]) -> bytes | None:
        """Return a picture of the newest messages; None if it is like that of a moment ago."""
        joints, column = self._newest.get('joint_states'), None
        strain = 0.0 if joints is None else about.read_strain(joints)
        # a real element publishes no field, and another element's may still come
        with suppress(KeyError, ValueError):
            column = about.scale_field(self._newest['field'])
        shown = {'strain': strain, 'walls': self._list_walls(), **doing}
        bits = b'' if column is None else column.tobytes()
        # longest time in seconds for which a picture that is like the last one is not sent
        max_unsent_s = 0.25
        since = self._history[-1] if self._history else (self._held - max_unsent_s, 0.0, None)
        if (shown, bits) == self._shown and self.clock - since[0] < max_unsent_s:
            self._held = self.clock
            return None
        self._shown = shown, bits
        head = {'k': 'picture', 't': self.clock, **shown}
        if self._history and self._held > since[0]:
            self._history.append((self._held, *since[1:]))
            head['held'] = self._held
        self._history.append((self.clock, strain, column))
        return pack_frame(head, column)

    def pack_history(self) -> bytes:
        """Return the pictures of the last minute in one frame."""
        columns = [(t, column) for t, _, column in self._history if column is not None]
        head = {
            'k': 'history',
            't': [t for t, _ in columns],
            'strain': [[t for t, *_ in self._history], [strain for _, strain, _ in self._history]],
            'walls': self._list_walls(),
        }
        return pack_frame(head, np.stack([column for _, column in columns]) if columns else None)

    def _list_walls(self) -> list[float]:
        walls = self._newest.get('wall')
        return [] if walls is None else read_walls(walls)

    def _schedule_picture(self) -> None:
        """Schedule a picture, no sooner than a period after the last."""
        wait = self._stamp + 0.03 - time.monotonic()  # 30 pictures a second
        # all streams of a tick arrive within 4 ms
        self._loop.call_later(max(wait, 0.004), self._end_picture_period)

    def _end_picture_period(self) -> None:
        self._fresh = False
        now = time.monotonic()
        # the clock of pictures stands still without messages
        self.clock += min(now - self._stamp, 0.2)
        self._stamp = now
        self._due()
