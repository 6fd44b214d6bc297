# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""YAML text as yaml-cpp 0.8 writes it, so that our files equal rosbag2's byte for byte.

PyYAML and ruamel.yaml quote, indent and order differently, hence the few rules that rosbag2's
documents need are spelled out here. Reading is left to PyYAML.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import TypeAlias, TypeGuard

import yaml  # type: ignore[import-untyped]

from ..clipped import clipped
from .errors import BagError

Node: TypeAlias = 'str | int | bool | Mapping[str, Node] | Sequence[Node] | None'

# Characters that yaml-cpp escapes in double quotes, and those it writes raw although other
# YAML readers refuse them or fold them as line breaks.
_ESCAPED = re.compile('[\x00-\x1f"\\\\\x7f-\xa0\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]')
_SHORT_ESCAPES = {
    '"': '\\"',
    '\\': '\\\\',
    '\n': '\\n',
    '\t': '\\t',
    '\r': '\\r',
    '\b': '\\b',
    '\f': '\\f',
}
_NOT_PLAIN = re.compile(
    '^(?:~|null|Null|NULL)?$'  # would be read as null
    '|^[ \t\r\n,\\[\\]{}#&*!|>\'"%@`]'  # an indicator or blank at the start
    '|^[-?:](?:[ \t\r\n]|$)'
    '| $'
    '|:(?:[ \t\r\n]|$)'  # would end a key
    '|[ \t\r\n]#'  # would start a comment
    '|&'
    '|[\x00-\x1f\x7f-\x9f\u2028\u2029\ud800-\udfff\ufeff\ufffe\uffff]'
)
_LONGEST_TEXT = 2**18  # characters: metadata of 400 topics, which take a second to read
_LONGEST_KEY = 1024  # characters; YAML allows no longer simple key


def dump(node: Node) -> str:
    """Write a document in yaml-cpp's block style, with no final newline.

    Args:
        node: Mappings (in their own order), sequences, strings, integers, booleans and None.

    Returns:
        The text, byte for byte what ``YAML::Dump`` gives for the same node.

    Raises:
        BagError: A key is not a string or is too long for YAML, or a value has no YAML form.
    """
    return '\n'.join(_lines(node))


def load(text: str) -> object:
    """Read a document, leaving every scalar the string it is.

    yaml-cpp leaves ``seed: 42`` unquoted although it is a string, so types are for the caller
    to decide.

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
        return yaml.load(text, yaml.BaseLoader)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        # ValueError: an escape beyond Unicode.
        raise BagError(f'The text must be YAML; got {clipped(text)}.') from error


def _lines(node: Node) -> Iterator[str]:
    if isinstance(node, Mapping) and node:
        for key, value in node.items():
            yield from _entry(f'{_key(key)}:', value, own_line=isinstance(value, Mapping))
    elif _is_sequence(node) and node:
        for item in node:
            yield from _entry('-', item, own_line=False)
    else:
        yield _scalar(node)


def _entry(head: str, value: Node, own_line: bool) -> Iterator[str]:
    # A sequence, even an empty one, begins below its head; so does a mapping below its key.
    first, *rest = _lines(value)
    if own_line or _is_sequence(value):
        yield head
        yield f'  {first}'
    else:
        yield f'{head} {first}'
    yield from (f'  {line}' for line in rest)


def _is_sequence(node: Node) -> TypeGuard[Sequence[Node]]:
    return isinstance(node, Sequence) and not isinstance(node, str)


def _key(key: object) -> str:
    if not isinstance(key, str) or len(key) > _LONGEST_KEY:
        raise BagError(
            f'A key must be a string of at most {_LONGEST_KEY} characters; got {clipped(key)}.'
        )
    return _string(key)


def _scalar(node: Node) -> str:
    if node is None:
        return '~'
    if isinstance(node, bool):
        return 'true' if node else 'false'
    if isinstance(node, int):
        return str(node)
    if isinstance(node, str):
        return _string(node)
    if isinstance(node, Sequence):
        return '[]'
    if isinstance(node, Mapping):
        return '{}'
    raise BagError(f'A value must be a string, an integer or a boolean; got {clipped(node)}.')


def _string(text: str) -> str:
    if not _NOT_PLAIN.search(text):
        return text
    return f'"{_ESCAPED.sub(_escape, text)}"'


def _escape(match: re.Match[str]) -> str:
    character = match[0]
    if character in _SHORT_ESCAPES:
        return _SHORT_ESCAPES[character]
    code = ord(character)
    return f'\\x{code:02x}' if code < 0xFF else f'\\u{code:04x}'
