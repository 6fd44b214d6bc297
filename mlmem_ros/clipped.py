# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Values and texts from outside, made fit for a message: short, of one line, printable."""

from __future__ import annotations

import reprlib

_MOST = 80  # characters of a value in a message


def clipped(value: object, most: int = _MOST) -> str:
    """Return the `repr` of a value, its middle left out where it is long.

    It never makes the whole `repr`: that of a joint name of 5 MB, of lists deep in lists or of a
    YAML document full of aliases would cost more than the value.

    Args:
        value: Anything; a text comes with its quotes, and its control characters escaped.
        most: Greatest length in characters, at least 5.
    """
    short = reprlib.Repr()
    short.maxlevel = 3
    short.maxlist = short.maxtuple = short.maxdict = short.maxset = short.maxarray = 6
    short.maxstring = short.maxlong = short.maxother = most
    return _cut(short.repr(value[:most] if isinstance(value, bytes) else value), most)


def printable(text: str, most: int = 1000) -> str:
    """Return a text as one line that a terminal shows and does not obey.

    Args:
        text: Any text, lone surrogates and escape sequences among it.
        most: Greatest length in characters.
    """
    # Cut first: every character may take ten.
    shown = ''.join(c if c.isprintable() else repr(c)[1:-1] for c in _cut(text, most))
    return _cut(shown, most)


def _cut(text: str, most: int) -> str:
    if len(text) <= most:
        return text
    head = (most - 3) * 2 // 3
    return f'{text[:head]}...{text[len(text) - (most - 3 - head) :]}'
