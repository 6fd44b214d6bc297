# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Message types: their definition, their hash, and CDR to and from Python objects.

All of it comes from `rosbags`, so that bags are written and read where no ROS is installed.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde import SerdeError
from rosbags.typesys import Stores, TypesysError, get_typestore
from rosbags.typesys.store import Typestore

from .errors import BagError
from .schema_text import ENCODINGS, dependencies, parse_schema, schema_text

_HEADER_SIZE = 4  # bytes of CDR encapsulation
_WIDE = {'float64', 'int64', 'uint64'}
# What rosbags' parsers, code generators and generated code raise on input that is not right.
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
        encoding: Language of the text, ``ros2msg`` or ``ros2idl``; another word, or none, where
            there is no text. (An empty ``ros2msg`` defines a message without fields.)
        hash: The type's RIHS01 hash; empty when unknown.
    """

    type: str
    text: str
    encoding: str = 'ros2msg'
    hash: str = ''


class Codec:
    """Converts messages of a fixed set of types to CDR and back."""

    def __init__(self, store: Typestore) -> None:
        self._store = store
        self._wide: dict[str, bool] = {}

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
                f'The {len(cdr)} bytes must be CDR of a {type_name}: {error}.'
            ) from error
        return message, _HEADER_SIZE + size

    def _require(self, type_name: str) -> None:
        if type_name not in self._store.fielddefs:
            raise BagError(
                f'The definition of {type_name!r} is not known; give its text along with it.'
            )

    def _has_wide_sequence(self, type_name: str) -> bool:
        wide = any(
            kind == Nodetype.SEQUENCE and detail[0][1][0] in _WIDE
            for _, (kind, detail) in self._store.fielddefs[type_name][1]
        )
        return wide or any(map(self._has_wide_sequence, dependencies(self._store, type_name)))


@lru_cache(maxsize=1)
def jazzy() -> Codec:
    """Give the codec of the interfaces that ROS 2 Jazzy ships."""
    return Codec(get_typestore(Stores.ROS2_JAZZY))


def codec_of(definitions: Iterable[Definition]) -> Codec:
    """Build a codec from the definitions a bag holds, which may be those of any distribution.

    Args:
        definitions: Definitions with all they depend on. One that is not in a language known
            here is taken from Jazzy; one that cannot be parsed is left out.

    Returns:
        A codec of these types.
    """
    store = get_typestore(Stores.EMPTY)
    for definition in definitions:
        try:
            if definition.encoding not in ENCODINGS:
                definition = jazzy().definition(definition.type)
            types = parse_schema(definition.type, definition.text, definition.encoding)
            store.register(types)
        except (BagError, *_FAULTS):
            continue
    return Codec(store)
