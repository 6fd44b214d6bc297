# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Limits that the definition of a message type must keep before it is parsed.

The parsers and code generators of rosbags trust a definition: they compute its constants, try
every parse of nested brackets, and write code for every item of an array. That suits one's own
definitions; one from a file is checked here first.
"""

from __future__ import annotations

import re
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.serde.utils import SIZEMAP

MOST_TEXT = {'ros2msg': 2**16, 'ros2idl': 2**14}
"""Characters of a definition with all it depends on, without comments or blanks: parsed in 1 s."""

MOST_RAW_TEXT = 2**20
"""Characters of it including them."""

MOST_ITEMS = 2000
"""Fields of a definition, counting every item of an array of strings or messages."""

MOST_NUMBERS = 2**22
"""Numbers in an array of fixed length."""

MOST_CONSTANTS = 400
"""Constants, lengths of arrays and sequences in IDL, each of which takes long to parse."""

_DEPTHS = {'[': 1, '<': 1, '{': 4}  # nesting depth of brackets in IDL; constants need none
_CLOSING = dict(zip(']>}', '[<{', strict=True))
# Comments, and adjacent strings; an unterminated one runs to the end of the definition.
_IDL_COMMENT = r'//[^\n]*|/[*](?:[^*]|[*](?!/))*(?:[*]/|\Z)'
_IDL_TEXTS = r'"(?:\\"|[^"])*(?:"|\Z)(?:\s*"(?:\\"|[^"])*(?:"|\Z))*'
_IDL_ASIDE = re.compile(f'{_IDL_COMMENT}|(?P<texts>{_IDL_TEXTS})')
_IDL_ANNOTATION = re.compile(r'@\s*\w+\s*\(')
_MSG_COMMENT = re.compile(r'^[ \t]*#[^\n]*', re.MULTILINE)
_BLANKS = re.compile(r'\s+')


class LimitError(ValueError):
    """A definition asks for more than a message type needs; the text says what."""


def condensed(text: str, encoding: str) -> str:
    """Return a definition that is safe to parse, without what decoding does not need.

    That is comments, blank lines, and in IDL the content of strings.

    Args:
        text: The definition with all it depends on.
        encoding: Its language, ``ros2msg`` or ``ros2idl``.

    Raises:
        LimitError: It is too long, or its brackets are nested too deeply.
    """
    _limit('its length', len(text), MOST_RAW_TEXT)
    if encoding == 'ros2msg':
        text = _MSG_COMMENT.sub('', text)
    else:
        text = _IDL_ASIDE.sub(lambda match: '""' if match['texts'] else ' ', text)
    text = _BLANKS.sub(lambda match: '\n' if '\n' in match[0] else ' ', text)
    _limit('its length', len(text), MOST_TEXT[encoding])
    if encoding == 'ros2idl':
        _check_brackets(text)
    return text


def check_types(types: dict[str, Any]) -> None:
    """Raise `LimitError` for parsed types that would cost too much.

    Args:
        types: Constants and fields by the name of the type, as rosbags parses them.
    """
    items = 0
    for _, fields in types.values():
        items += len(fields)
        for _, (kind, detail) in fields:
            if kind == Nodetype.ARRAY:
                (item, what), length = detail
                if length < 1:
                    raise LimitError('an array must have at least one item; got none')
                number = item == Nodetype.BASE and what[0] in SIZEMAP
                _limit('an array', length, MOST_NUMBERS if number else MOST_ITEMS)
                items += 0 if number else length
    _limit('the number of its fields', items, MOST_ITEMS)
    for name in types:
        objects, size = _least(types, name, {})
        # Otherwise a megabyte of nested messages would become a gigabyte of objects.
        _limit(f'the number of objects nested in {name}', objects, 2 * size)


def _check_brackets(text: str) -> None:
    if text.count('(') > len(_IDL_ANNOTATION.findall(text)):
        raise LimitError('a constant must have no brackets')
    if re.search(r'\]\s*\[', text):
        raise LimitError('an array must have one dimension')
    _limit('the number of its constants', sum(map(text.count, '=[<')), MOST_CONSTANTS)
    depth = dict.fromkeys(_DEPTHS, 0)
    for character in text:
        if character in _DEPTHS:
            depth[character] += 1
            deepest = _DEPTHS[character]
            _limit(f'the depth of its brackets {character}', depth[character], deepest)
        elif character in _CLOSING:
            depth[_CLOSING[character]] -= 1


def _least(types: dict[str, Any], name: str, known: dict[str, tuple[int, int]]) -> tuple[int, int]:
    """Return the number of objects in the smallest message of a type, and its size in bytes."""
    if name not in known:
        if name not in types:
            return 1, 1  # one that ships with ROS
        known[name] = 1, 1  # in case it holds itself, which no message can
        objects, size = 1, 0
        for _, (kind, detail) in types[name][1]:
            what, length = (
                (detail[0], detail[1]) if kind == Nodetype.ARRAY else ((kind, detail), 1)
            )
            if kind == Nodetype.SEQUENCE:
                size += 4
            elif what[0] == Nodetype.NAME:
                inner = _least(types, what[1], known)
                objects, size = objects + length * inner[0], size + length * inner[1]
            else:
                size += length * SIZEMAP.get(what[1][0], 5)  # a string: its length and end
        known[name] = objects, max(1, size)
    return known[name]


def _limit(what: str, value: int, most: int) -> None:
    if value > most:
        raise LimitError(f'{what} must be at most {most}; got {value}')
