# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message types: their definition, their hash, and CDR to and from Python objects.

All of it comes from `rosbags`, so bags can be written and read without a ROS installation.
"""

from __future__ import annotations

import re
import struct
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore
from rosbags.typesys.store import Typestore

from ..clipped import clipped, printable
from .errors import BagError
from .schema_text import dependencies, parse_schema, schema_text

_HEADER_SIZE = 4  # bytes of CDR encapsulation
_NOTHING = 'structure_needs_at_least_one_member', (Nodetype.BASE, ('uint8', 0))
_WIDE = {'float64', 'int64', 'uint64'}
# What rosbags' parsers, code generators and generated code raise on invalid input.
_FAULTS = (
    SerdeError,
    TypesysError,
    AssertionError,
    AttributeError,
    IndexError,
    KeyError,
    MemoryError,
    OverflowError,
    RecursionError,
    SyntaxError,
    TypeError,
    ValueError,
    struct.error,
)


@dataclass(frozen=True)
class Definition:
    """A message type as a bag holds it.

    Attributes:
        type: Name of the type, such as ``std_msgs/msg/Float64``.
        text: Definition of the type and of all it depends on.
        encoding: Language of the text, ``ros2msg`` or ``ros2idl``; anything else, or empty, if
            there is no text. (An empty ``ros2msg`` defines a message without fields.)
        hash: The type's RIHS01 hash; empty when unknown.
    """

    type: str
    text: str
    encoding: str = 'ros2msg'
    hash: str = ''


class Codec:
    """Converts messages of a fixed set of types to CDR and back."""

    def __init__(self, store: Typestore, refused: Mapping[str, str] | None = None) -> None:
        """Take the types.

        Args:
            store: Holds them.
            refused: Types whose definition is rejected, and why.
        """
        self._store = store
        self._refused = refused or {}
        self._wide: dict[str, bool] = {}

    def knows(self, type_name: str) -> bool:
        """Return whether a type is known here."""
        return type_name in self._store.fielddefs and type_name not in self._refused

    def has_fields(self, type_name: str, fields: Sequence[Any]) -> bool:
        """Return whether a known type has these fields, as rosbags parses them."""
        mine = self._store.fielddefs[type_name][1]
        return _plain(mine) == _plain(fields or [_NOTHING])

    def definition(self, type_name: str) -> Definition:
        """Describe a type in full.

        Args:
            type_name: Name of the type, such as ``std_msgs/msg/Float64``.

        Returns:
            Text and hash.

        Raises:
            BagError: The type is not known here.
        """
        self._require(type_name)
        return Definition(
            type=type_name,
            text=schema_text(self._store, type_name),
            hash=self._store.hash_rihs01(type_name),
        )

    def message(self, type_name: str, **values: Any) -> Any:
        """Make a message.

        Args:
            type_name: Name of the type.
            **values: Every field of the type; arrays of numbers as numpy arrays.

        Returns:
            An object with the fields as attributes.

        Raises:
            BagError: The type is not known here or the fields are not its fields.
        """
        self._require(type_name)
        try:
            return self._store.types[type_name](**values)
        except TypeError as error:
            raise BagError(f'The fields must be those of {type_name}: {error}.') from error

    def serialize(self, message: Any) -> bytes:
        """Encode a message as CDR.

        Args:
            message: A message made by `message`.

        Returns:
            Little-endian CDR with its encapsulation header.

        Raises:
            BagError: The type is not known here or a field has a wrong value.
        """
        type_name = getattr(message, '__msgtype__', type(message).__name__)
        self._require(type_name)
        try:
            return bytes(self._store.serialize_cdr(message, type_name, little_endian=True))
        except _FAULTS as error:
            raise BagError(f'The message must be a valid {type_name}: {error}.') from error

    def deserialize(self, cdr: bytes, type_name: str) -> Any:
        """Decode CDR.

        Args:
            cdr: The encoded message, with its encapsulation header. Bytes after the message
                are ignored, as ROS does.
            type_name: Name of its type.

        Returns:
            An object with the fields as attributes; arrays of numbers are numpy arrays.

        Raises:
            BagError: The type is not known here or the bytes are not a message of it.
        """
        message, _ = self._decode(cdr, type_name)
        return message

    def trim(self, cdr: bytes, type_name: str) -> bytes:
        """Cut off the unwritten memory that ``rclpy.serialization.serialize_message`` appends.

        Fast DDS reserves padding for every sequence of 8-byte numbers, which an empty one does
        not use: a JointState without effort ends in 4 stray bytes, a JointTrajectory in dozens.
        ROS does not mind, but `rosbags` refuses such a message. (Padding between fields is
        unwritten memory too, so messages are to be compared decoded, never as bytes.)

        Args:
            cdr: The encoded message, with its encapsulation header.
            type_name: Name of its type.

        Returns:
            The message alone; the very same bytes if its type has no such sequence.

        Raises:
            BagError: The type is not known here or the bytes are not a message of it.
        """
        self._require(type_name)
        if type_name not in self._wide:
            self._wide[type_name] = self._has_wide_sequence(type_name)
        if not self._wide[type_name]:
            return cdr
        _, size = self._decode(cdr, type_name)
        return cdr[:size]

    def _decode(self, cdr: bytes, type_name: str) -> tuple[Any, int]:
        # Typestore.deserialize_cdr does the same but refuses what ROS tolerates at the end.
        self._require(type_name)
        if len(cdr) < _HEADER_SIZE or cdr[0] != 0 or cdr[1] not in (0, 1):
            raise BagError(f'A {type_name} must begin with a CDR header; got {cdr[:4]!r}.')
        try:
            coder = self._store.get_msgdef(type_name)
            decode = coder.deserialize_cdr_le if cdr[1] else coder.deserialize_cdr_be
            body = memoryview(cdr)[_HEADER_SIZE:]
            message, size = decode(body, 0, coder.cls, self._store)
        except _FAULTS as error:
            raise BagError(
                f'The {len(cdr)} bytes must be CDR of a {type_name}: {printable(str(error), 200)}.'
            ) from error
        if size > len(body):
            raise BagError(f'A {type_name} of {size} bytes must be complete; got {len(body)}.')
        return message, _HEADER_SIZE + size

    def _require(self, type_name: str) -> None:
        if not self.knows(type_name):
            reason = self._refused.get(type_name, 'pass its text as well')
            raise BagError(f'The definition of {clipped(type_name)} is not known here; {reason}.')

    def _has_wide_sequence(self, type_name: str) -> bool:
        wide = any(
            kind == Nodetype.SEQUENCE and detail[0][1][0] in _WIDE
            for _, (kind, detail) in self._store.fielddefs[type_name][1]
        )
        return wide or any(map(self._has_wide_sequence, dependencies(self._store, type_name)))


def _plain(fields: Sequence[Any]) -> list[Any]:
    return [(name.lower(), detail) for name, detail in fields]


@lru_cache(maxsize=1)
def jazzy() -> Codec:
    """Give the codec of the interfaces that ROS 2 Jazzy ships."""
    return Codec(get_typestore(Stores.ROS2_JAZZY))


def codec_of(definitions: Iterable[Definition]) -> Codec:
    """Build a codec for the definitions a bag holds.

    Types that ship with ROS 2 Jazzy are Jazzy's, whatever a bag says. If the bag defines one with
    other fields, its messages are refused: they would decode to nonsense or not at all. Other
    types are as the bag defines them, within the limits of `schema_limits`.

    Args:
        definitions: Definitions with all they depend on. One that cannot be parsed is left out.

    Returns:
        A codec of these types and of Jazzy's.
    """
    own: dict[str, Any] = {}
    refused: dict[str, str] = {}
    for definition in definitions:
        try:
            own |= _own_types(definition)
        except (BagError, *_FAULTS) as error:
            refused[definition.type] = printable(str(error), 200)
    if not (own or refused):
        return jazzy()
    store = get_typestore(Stores.ROS2_JAZZY)
    if own:
        try:
            store.register(own)
        except _FAULTS as error:
            refused |= dict.fromkeys(own, printable(str(error), 200))
    return Codec(store, refused)


def _own_types(definition: Definition) -> dict[str, Any]:
    """Return the types of a definition that do not ship with ROS 2 Jazzy.

    Raises:
        BagError: A type that ships differs from Jazzy's, or the text does not define its type. On
            text in another language the parsers raise various errors.
    """
    name, ours = definition.type, jazzy()
    if ours.knows(name) and _is_hash(definition.hash):
        if definition.hash != ours.definition(name).hash:
            raise BagError(f'its hash is {definition.hash}, ROS 2 Jazzy has another')
        return {}
    try:
        types = parse_schema(name, definition.text, definition.encoding)
    except (BagError, *_FAULTS):
        if ours.knows(name):
            return {}
        raise
    for other in [each for each in types if ours.knows(each)]:
        if not ours.has_fields(other, types.pop(other)[1]):
            raise BagError(f'{other} has other fields than in ROS 2 Jazzy')
    if name not in types and not ours.knows(name):
        raise BagError('it does not define itself')
    return types


def _is_hash(text: str) -> bool:
    return re.fullmatch('RIHS01_[0-9a-f]{64}', text) is not None
