# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Frames sent to a page: a JSON header, then numbers in binary form.

A frame is the length of its header (uint32, little-endian), the header, and the body. Blanks pad
the header, so that the body begins at a multiple of four.
"""

from __future__ import annotations

import json
import math
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mlmem_ros.contract import calls
from mlmem_ros.procedures import EXACT, NARROW, as_text, fitting

COUNTS = 8000
"""The active phase in a picture of integers; the inactive phase is 0."""

SAMPLES = 1200
"""Most samples of an echo on a page; of several the largest is kept."""


def known(values: Mapping[str, str]) -> int | str | None:
    """Return the content in `~/content` for a page, if `~/level` cannot hold it, or None."""
    level = calls.level_of(values)
    if level == fitting(level, NARROW):
        return None
    return level if level <= EXACT else as_text(level)


def packed(head: dict[str, Any], body: NDArray[Any] | None = None) -> bytes:
    """Return a frame, in whose header numbers that are not finite become null; integers are sent
    as int16, reals as float32.
    """
    data = b''
    if body is not None:
        kind = '<i2' if body.dtype.kind == 'i' else '<f4'
        head = {**head, 'body': kind[1:]}
        data = np.ascontiguousarray(body, dtype=kind).tobytes()
    text = json.dumps(finite(head), separators=(',', ':')).encode()
    text += b' ' * (-len(text) % 4)
    return struct.pack('<I', len(text)) + text + data


def finite(value: Any) -> Any:
    """Return a JSON value in which None stands for every number that JSON cannot express."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, dict):
        return {str(key): finite(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [finite(item) for item in value]
    return value


def counts(field: NDArray[Any], phases: tuple[float, float]) -> NDArray[np.int16]:
    """Return a configuration Delta_j as integers: 0 inactive, `COUNTS` active; `phases` has that
    of either.
    """
    inactive, active = phases
    scaled = (np.asarray(field, dtype=np.float32) - inactive) * (COUNTS / (active - inactive))
    return np.asarray(np.clip(np.nan_to_num(scaled), -32768, 32767), dtype=np.int16)


def thinned(message: Any) -> NDArray[np.float32]:
    """Return times and v_c of an echo, thinned out, of shape (2, n).

    Raises:
        ValueError: It is not an echo.
    """
    t, _, v_c = calls.echo(message)
    group = math.ceil(len(t) / SAMPLES)
    whole = len(t) // group * group
    t, v_c = t[:whole].reshape(-1, group)[:, -1], v_c[:whole].reshape(-1, group).max(axis=1)
    return np.stack((t, v_c)).astype(np.float32)
