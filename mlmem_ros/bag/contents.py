# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a bag yields: messages, and records of those that were lost."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple


class Message(NamedTuple):
    """One recorded message, still encoded.

    Attributes:
        topic: Name of the topic.
        type: Name of the message type; empty when the bag does not say.
        log_time: When it was received, in nanoseconds.
        publish_time: When it was sent, in nanoseconds; the log time if the bag has none.
        cdr: The encoded message.
    """

    topic: str
    type: str
    log_time: int
    publish_time: int
    cdr: bytes


@dataclass(frozen=True)
class Loss:
    """A stretch of a file that could not be read.

    Attributes:
        file: The file.
        offset: Where in the file the stretch begins, in bytes.
        size: Its length in bytes; 0 when nothing is damaged but something is missing.
        reason: What is wrong with it.
    """

    file: Path
    offset: int
    size: int
    reason: str

    def __str__(self) -> str:
        return f'{self.file}, byte {self.offset}: {self.size} bytes lost, {self.reason}'
