# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Why a request to a memory node failed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any


class RequestError(Exception):
    """A request failed; the message says why."""


class NoAnswer(RequestError):
    """The node was not found or did not answer in time: the result of the request is unknown."""


class RequestFailed(RequestError):
    """The node tried and failed; the content may have changed.

    Attributes:
        answer: The node's JSON object, with `error`.
    """

    def __init__(self, answer: Mapping[str, Any]) -> None:
        super().__init__(answer.get('error', 'the node gave no reason'))
        self.answer = answer


class RequestRefused(RequestFailed):
    """The node refused the request (busy, inactive, out of range): nothing has changed."""


class BankFailed(RequestError):
    """Some elements of a bank failed; the others succeeded.

    Attributes:
        errors: What went wrong, by the full name of the element.
    """

    def __init__(self, errors: Mapping[str, RequestError], elements: int) -> None:
        reasons = '; '.join(f'{name}: {error}' for name, error in errors.items())
        super().__init__(f'{len(errors)} of {elements} elements failed: {reasons}')
        self.errors = errors
