# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The messages of a node in the order of events, with times that never run back."""

from __future__ import annotations

from collections.abc import Collection, Iterator

from ..bag.contents import Message
from ..bag.reader import BagReader
from .messages import HEADER


def timed(
    reader: BagReader, node: str, topics: Collection[str]
) -> Iterator[tuple[float, Message]]:
    """Yield messages of some topics (full names), each with the seconds since the first of the
    bag.

    A session is read as it was written, tick by tick: log times go back with the clock of a
    simulator that is reset, or that NTP corrects, and the seconds here stand still meanwhile.
    Another recorder does not write in the order of events, so its messages are read by time.
    """
    as_written = f'{node}/{HEADER}' in reader.topics
    start = None if as_written or reader.span is None else reader.span[0]
    latest = 0
    for message in reader.messages(topics, as_written):
        start = message.log_time if start is None else start - max(0, latest - message.log_time)
        latest = message.log_time
        yield (latest - start) / 1e9, message
