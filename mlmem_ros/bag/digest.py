# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Running hashes over the messages of a bag, recorded in it: so any later change is noticed.

A *digest* is a message on a topic of its own: how many messages stand between it and the one
before, and the SHA-256 of that one's hash and of these messages, each with its topic, type, log
time and bytes (tools that copy a bag lose publish times and the hash of a type). A recorder writes
one with every sync, and the last when it closes the bag. So what a killed recorder leaves is
covered up to its last sync, and a stretch behind a damaged one, too. A hash is no signature: it
tells what a tool, a disk or an editor has changed, not who.
"""

from __future__ import annotations

import hashlib
import json
import struct
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING

from ..described import described, short_repr
from ..outside import DecodeError, decode, from_json
from . import jazzy
from .contents import TopicInfo
from .errors import BagError

if TYPE_CHECKING:  # a node only records
    from .reader import BagReader

TYPE = 'std_msgs/msg/String'

_NUMBERS = struct.Struct('<QQ')
_MOST = 10  # lines of findings


@dataclass(frozen=True)
class Digest:
    """The JSON object of a digest."""

    number: int = described(0, 'digests before it', low=0, high=2**53)
    messages: int = described(0, 'messages since the one before', low=0, high=2**53)
    sha256: str = described('', 'hash of the hash before, and of these messages')
    closed: bool = described(False, 'whether it ends the bag')


class Running:
    """The hash of the messages since the last digest."""

    def __init__(self) -> None:
        self._prefixes: dict[str, bytes] = {}  # by topic
        self.go_on(Digest(-1))

    def go_on(self, digest: Digest) -> None:
        """Begin after a digest."""
        self.number, self.messages = digest.number + 1, 0
        self._hash = hashlib.sha256(digest.sha256.encode())

    def add(self, info: TopicInfo, log_time: int, cdr: bytes) -> None:
        """Take a message."""
        prefix = self._prefixes.get(info.name)
        if prefix is None:
            prefix = '\0'.join((info.name, info.type, '')).encode(errors='replace')
            self._prefixes[info.name] = prefix
        self._hash.update(prefix + _NUMBERS.pack(log_time, len(cdr)))
        self._hash.update(cdr)
        self.messages += 1

    def digest(self, closed: bool = False) -> Digest:
        """Return the digest that is due."""
        found = self._hash.copy()
        found.update(b'closed' if closed else b'')
        return Digest(self.number, self.messages, found.hexdigest(), closed)


def message(digest: Digest) -> bytes:
    """Return a digest as CDR."""
    return jazzy.serialize(jazzy.message(TYPE, data=json.dumps(asdict(digest))))


@dataclass
class Findings:
    """What the digests of a bag tell, one line each."""

    lost: list[str] = field(default_factory=list)
    altered: list[str] = field(default_factory=list)


def check(reader: BagReader, topic: str) -> Findings:
    """Compare the messages of a bag with the digests on a topic of it."""
    found, running, closed = Findings(), Running(), False
    for each in reader.messages(as_written=True):
        if closed:
            found.altered.append('messages follow the digest that ended the recording')
            break
        if each.topic != topic:
            info = reader.topics[each.topic]
            running.add(info, each.log_time, each.cdr)
            continue
        try:
            if each.type != TYPE:
                raise DecodeError(f'the type must be {TYPE}; got {short_repr(each.type)}')
            told = decode(Digest, from_json(reader.deserialize(each).data))
        except (BagError, DecodeError) as error:
            found.altered.append(f'{topic}: {error}')
            continue
        _compare(running.digest(told.closed), told, found)
        running.go_on(told)
        closed = told.closed
    if not closed:
        found.lost.append('the digest that ends the recording')
    return Findings(found.lost[:_MOST], found.altered[:_MOST])


def _compare(due: Digest, told: Digest, found: Findings) -> None:
    """Judge the messages between two digests."""
    if told.number < due.number:
        found.altered.append(f'digest {told.number} follows digest {due.number - 1}')
    elif told.number > due.number:
        found.lost.append(f'digests {due.number} to {told.number - 1} and what they cover')
    elif told.messages > due.messages:
        missing = told.messages - due.messages
        found.lost.append(f'{missing} of {told.messages} messages before digest {told.number}')
    elif told != due:
        found.altered.append(f'the {told.messages} messages before digest {told.number}')
