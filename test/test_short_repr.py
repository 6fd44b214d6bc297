# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Input is quoted in messages short, in one line, printable."""

import pytest

from mlmem.schema import make_printable, short_repr


def deep(levels):
    value = []
    for _ in range(levels):
        value = [value]
    return value


def aliases(doublings):
    """A list as a short YAML document with aliases makes it: 2^n words when written out."""
    value = ['lol']
    for _ in range(doublings):
        value = [value, value]
    return value


HUGE = {
    'text': lambda: 'x' * 5_000_000,
    'bytes': lambda: b'x' * 5_000_000,
    'list': lambda: list(range(10**6)),
    'dict': lambda: {str(n): n for n in range(10**5)},
    'number': lambda: 10**4000,
    'deep': lambda: deep(100_000),
    'aliases': lambda: aliases(40),
}


@pytest.mark.parametrize('kind', HUGE)
def test_huge_value_is_clipped(kind):
    assert 3 <= len(short_repr(HUGE[kind]())) <= 80


def test_long_text_keeps_its_start_and_end():
    assert short_repr('a' * 50 + 'z' * 50, 20).startswith("'aaa")
    assert short_repr('a' * 50 + 'z' * 50, 20).endswith("zzz'")


def test_no_text_controls_the_terminal():
    shown = make_printable('\x1b[2Jgone\nnext \ud800 größe [/red]')
    assert shown == '\\x1b[2Jgone\\nnext \\ud800 größe [/red]'
    assert shown.encode()
    assert len(make_printable('\n' * 5_000_000)) <= 1000
