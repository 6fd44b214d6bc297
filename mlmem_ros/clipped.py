# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Values and texts from outside, made short and printable, on one line, for a message."""

from __future__ import annotations

import reprlib

_MOST = 80  # characters of a value in a message


def clipped(value: object, most: int = _MOST) -> str:
    """Return the `repr` of a value, without its middle if it is long.

    The whole `repr` is never built: for a joint name of 5 MB, deeply nested lists or YAML full of
    aliases it would cost more than the value.

    Args:
        value: Anything; text keeps its quotes, with control characters escaped.
        most: Greatest length in characters, at least 5.
    """
    short = reprlib.Repr()
    short.maxlevel = 3
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = short.maxarray = 6
    short.maxstring = short.maxlong = short.maxother = most
    return _cut(short.repr(value[:most] if isinstance(value, bytes) else value), most)


def printable(text: str, most: int = 1000) -> str:
    """Return a text, whatever it is, as one line of at most `most` characters that a terminal
    displays without interpreting it.
    """
    # Cut first: every character may take ten.
    shown = ''.join(c if c.isprintable() else repr(c)[1:-1] for c in _cut(text, most))
    return _cut(shown, most)


def _cut(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    head = (most - 3) * 2 // 3
    return f'{text[:head]}...{text[len(text) - (most - 3 - head) :]}'
