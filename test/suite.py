# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What all tests share: how long they wait, which cases of a sweep they take, and what they expect
of a rejection: it says why by a code and where by a field, and its sentence is for people.
"""

import contextlib

import pytest

TIMEOUT_S = 90.0
"""Seconds to wait for any event: on a loaded machine a node takes long to start. No test asserts
that anything is fast."""


def sampled(values, kept):
    """Return the parameters of a sweep; those for which `kept` is false are slow, and only
    `make test-slow` takes them.
    """
    rows = [(value, value if isinstance(value, tuple) else (value,)) for value in values]
    return [
        value if kept(value) else pytest.param(*row, marks=pytest.mark.slow) for value, row in rows
    ]


@contextlib.contextmanager
def expect_rejection(kind, code, field=''):
    """Expect an error of a kind, with a code and the name of a field; it is what is caught."""
    with pytest.raises(kind) as caught:
        yield caught
    found = caught.value.code.value, caught.value.field
    assert found == (code, field), f'{found}: {caught.value}'


def replace_value(values, path, value):
    """Return a copy of nested values with one of them replaced."""
    if not path:
        return value
    made = values.copy()
    made[path[0]] = replace_value(values[path[0]], path[1:], value)
    return made
