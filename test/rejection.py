# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is rejected says why by a code, and where by a field; its sentence is for people."""

import contextlib

import pytest


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
