# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The message types of ROS 2 Jazzy: definitions, hashes, CDR to and from Python objects.

All of it comes from `rosbags`, so bags can be written and read without a ROS installation.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from rosbags.typesys import Stores, get_typestore
from rosbags.typesys.store import Typestore

from mlmem.schema import make_printable, short_repr

from .errors import BagError


class Definition(NamedTuple):
    """A message type: the text of its definition and of all it depends on, and its RIHS01 hash."""

    text: str
    hash: str


@lru_cache(maxsize=1)
def _load_typestore() -> Typestore:
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache
def find_definition(type_name: str) -> Definition:
    """Return the definition and hash of a type, such as ``std_msgs/msg/Float64``.

    The text lacks the comments of the ``.msg`` files, so it is the same with or without a ROS
    installation.

    Raises:
        BagError: Jazzy has no such type.
    """
    _require_type(type_name)
    text, _ = _load_typestore().generate_msgdef(type_name, ros_version=2)
    return Definition(text, _load_typestore().hash_rihs01(type_name))


def encode_message(type_name: str, **values: Any) -> bytes:
    """Return a message with all its fields as little-endian CDR with its encapsulation header;
    arrays of numbers are numpy arrays.

    Raises:
        BagError: Jazzy has no such type, or the values are not those of its fields.
    """
    _require_type(type_name)
    store = _load_typestore()
    try:
        message = store.types[type_name](**values)
        return bytes(store.serialize_cdr(message, type_name, little_endian=True))
    except Exception as error:  # whatever the generated code raises
        raise BagError(f'The values must be those of a {type_name}: {error}.') from error


def deserialize_message(cdr: bytes, type_name: str) -> Any:
    """Decode CDR.

    Args:
        cdr: The encoded message, with its encapsulation header. Bytes after the message are
            ignored, as ROS does.

    Returns:
        An object with the fields as attributes; arrays of numbers are numpy arrays.

    Raises:
        BagError: Jazzy has no such type, or the bytes are not a message of it.
    """
    return _decode_message(cdr, type_name)[0]


def trim_message(cdr: bytes, type_name: str) -> bytes:
    """Return a message without the bytes that ``rclpy.serialization.serialize_message`` appends.

    Fast DDS reserves padding for every sequence of 8-byte numbers, which an empty one does not
    use: a JointState without effort ends in 4 stray bytes, a JointTrajectory in dozens. ROS does
    not mind, but `rosbags` refuses such a message. (Padding between fields is unwritten memory
    too, so messages are to be compared decoded, never as bytes.)

    Raises:
        BagError: Jazzy has no such type, or the bytes are not a message of it.
    """
    return cdr[: _decode_message(cdr, type_name)[1]]


def _decode_message(cdr: bytes, type_name: str) -> tuple[Any, int]:
    # Typestore.deserialize_cdr does the same but refuses what ROS tolerates at the end.
    _require_type(type_name)
    header_size = 4  # bytes of the encapsulation
    if len(cdr) < header_size or cdr[0] != 0 or cdr[1] not in (0, 1):
        raise BagError(f'A {type_name} must begin with a CDR header; got {cdr[:4]!r}.')
    body = memoryview(cdr)[header_size:]
    try:
        coder = _load_typestore().get_msgdef(type_name)
        decode = coder.deserialize_cdr_le if cdr[1] else coder.deserialize_cdr_be
        message, size = decode(body, 0, coder.cls, _load_typestore())
    except Exception as error:  # whatever the generated code raises
        raise BagError(
            f'The {len(cdr)} bytes must be CDR of a {type_name}: '
            f'{make_printable(str(error), 200)}.'
        ) from error
    if size > len(body):
        raise BagError(f'A {type_name} of {size} bytes must be complete; got {len(body)}.')
    return message, header_size + size


def _require_type(type_name: str) -> None:
    if type_name not in _load_typestore().fielddefs:
        raise BagError(f'The type must be one of ROS 2 Jazzy; got {short_repr(type_name)}.')
