# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The error that bags raise."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from mlmem.schema import make_printable


class BagError(Exception):
    """A bag could not be written or read; the text, as short as that of a
    `DecodeError`, says why and what to do.

    Attributes:
        code: The reason in one word for programs, such as `other_format`.
    """

    def __init__(self, message: str, code: str = 'invalid') -> None:
        super().__init__(make_printable(message))
        self.code = code


@contextmanager
def storage_errors(action: str) -> Iterator[None]:
    """Turn file system errors of an action, such as ``'create PATH'``, into a `BagError`.

    Raises:
        BagError: The body raised an OSError, for instance because the disk is full, or a
            ValueError because a path has a NUL character.
    """
    try:
        yield
    except (OSError, ValueError) as error:
        reason = getattr(error, 'strerror', None) or error
        raise BagError(f'Cannot {action}: {reason}.') from error
