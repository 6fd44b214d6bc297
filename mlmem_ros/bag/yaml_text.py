# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""YAML by PyYAML in rosbag2's style: keys in their own order, no folded lines."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import yaml  # type: ignore[import-untyped]

try:  # ten times as fast
    from yaml import CBaseLoader as BaseLoader
    from yaml import CSafeDumper as SafeDumper
except ImportError:  # PyYAML was built without libyaml
    from yaml import BaseLoader, SafeDumper

from ..clipped import clipped
from .errors import BagError

Node: TypeAlias = 'str | int | bool | Mapping[str, Node] | Sequence[Node] | None'

_NO_WIDTH = 2**31 - 1
_LONGEST_TEXT = 2**18  # characters: metadata of 400 topics
_DEEPEST = 50  # levels (rosbag2 has six): libyaml's composer can overflow the stack


class _Dumper(SafeDumper):  # type: ignore[misc]
    def ignore_aliases(self, data: Any) -> bool:
        return True


_Dumper.add_representer(tuple, _Dumper.represent_list)


def dump(node: Node) -> str:
    """Write a document in block style, with no final newline.

    Args:
        node: Mappings (in their own order), sequences, strings, integers, booleans and None.

    Raises:
        BagError: A value has no YAML form.
    """
    try:
        text: str = yaml.dump(
            node, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=_NO_WIDTH
        )
    except (yaml.YAMLError, ValueError) as error:  # ValueError: a lone surrogate
        raise BagError(f'YAML must hold only strings and numbers; got {clipped(node)}.') from error
    return text.rstrip('\n')


def load(text: str) -> object:
    """Read a document, leaving every scalar a string.

    rosbag2 leaves ``seed: 42`` unquoted although it is a string, so the caller decides on types.

    Args:
        text: One YAML document.

    Returns:
        Dictionaries, lists and strings.

    Raises:
        BagError: The text is not YAML.
    """
    if len(text) > _LONGEST_TEXT:
        raise BagError(f'YAML must have at most {_LONGEST_TEXT} characters; got {len(text)}.')
    try:
        depth = 0
        for event in yaml.parse(text, BaseLoader):
            depth += isinstance(event, yaml.CollectionStartEvent)
            depth -= isinstance(event, yaml.CollectionEndEvent)
            if depth > _DEEPEST:
                raise ValueError('it is nested too deeply')
        return yaml.load(text, BaseLoader)
    except (yaml.YAMLError, ValueError, OverflowError, RecursionError) as error:
        # ValueError and OverflowError: an escape beyond Unicode.
        raise BagError(f'The text must be YAML; got {clipped(text)}.') from error
