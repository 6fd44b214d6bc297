# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The text of a message definition with all it depends on, as a bag holds it."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from rosbags.typesys import get_types_from_idl, get_types_from_msg
from rosbags.typesys.store import Typestore

from .schema_limits import check_types, condensed

_RULE = '=' * 80


def schema_text(store: Typestore, type_name: str) -> str:
    """Write the definition of a type in the layout of rosbag2.

    It lacks the comments of the ``.msg`` files, which are not always available, so it is the same
    with or without a ROS installation.

    Args:
        store: Holds the type.
        type_name: Name of the type.

    Returns:
        The text in the language ``ros2msg``.
    """
    return _full_text(store, type_name, set())


def parse_schema(type_name: str, text: str, encoding: str) -> dict[str, Any]:
    """Read the definition of a type.

    Args:
        type_name: Name of the type.
        text: Its definition with all it depends on.
        encoding: Language of the text, ros2msg or ros2idl.

    Returns:
        Types to be registered in a rosbags store. On text in another language the parsers raise
        various errors.

    Raises:
        LimitError: It asks for more than a message type needs.
    """
    text = condensed(text, encoding)
    is_msg = encoding == 'ros2msg'
    types = dict(get_types_from_msg(text, type_name) if is_msg else _parse_idl(text))
    check_types(types)
    return types


def _parse_idl(text: str) -> dict[str, Any]:
    # rosbag2 puts a rule and a line "IDL: pkg/msg/Type" above each IDL file; others may not.
    header, *sections = text.split(f'{_RULE}\nIDL: ')
    files = [section.partition('\n')[2] for section in sections] or [header]
    types: dict[str, Any] = {}
    for file in files:
        types.update(get_types_from_idl(file))
    return types


def dependencies(store: Typestore, type_name: str) -> Iterator[str]:
    """Name the types of the fields of a type, each as often as it occurs.

    Args:
        store: Holds the type.
        type_name: Name of the type.

    Yields:
        Names of nested types; none for numbers and strings.
    """
    for _, (_, detail) in store.fielddefs[type_name][1]:
        # A nested type appears by name, alone or as the item of an array.
        nested = detail[0][1] if isinstance(detail[0], tuple) else detail
        if isinstance(nested, str):
            yield nested


def _full_text(store: Typestore, type_name: str, seen: set[str]) -> str:
    # Depth first, siblings sorted, each type once: rosbag2's order.
    text = store.generate_msgdef(type_name, ros_version=2)[0].split(_RULE, 1)[0]
    for dependency in sorted(set(dependencies(store, type_name))):
        if dependency not in seen:
            seen.add(dependency)
            name = dependency.replace('/msg/', '/')
            text += f'\n{_RULE}\nMSG: {name}\n{_full_text(store, dependency, seen)}'
    return text
