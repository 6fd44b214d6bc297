# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why a request to a memory node came to nothing."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class RequestError(Exception):
    """A request came to nothing; the message says why."""


class NoAnswer(RequestError):
    """The node, or an answer of it, did not come in time: what became of the request is open."""


class RequestFailed(RequestError):
    """The node tried and did not reach what was asked for; the content may have changed.

    Attributes:
        answer: The node's JSON object, with `error`.
    """

    def __init__(self, answer: Mapping[str, Any]) -> None:
        super().__init__(answer.get('error', 'the node gave no reason'))
        self.answer = answer


class RequestRefused(RequestFailed):
    """The node did not take the request (busy, inactive, out of range): nothing has changed."""


class BankFailed(RequestError):
    """Some elements did not do what they were asked for; the others did.

    Attributes:
        errors: What went wrong, by the full name of the element.
    """

    def __init__(self, errors: Mapping[str, RequestError], elements: int) -> None:
        reasons = '; '.join(f'{name}: {error}' for name, error in errors.items())
        super().__init__(f'{len(errors)} of {elements} elements failed: {reasons}')
        self.errors = errors
