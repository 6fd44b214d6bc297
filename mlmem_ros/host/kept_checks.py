# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Findings of design checks, cached beside the compiled kernels for a faster next start.

Like a compiler's cache it may be deleted; a change to any file that a check depends on starts a
new one.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from functools import cache
from pathlib import Path

from ..analysis.checks import Finding, Report, Verdict
from ..device import Settings
from ..durable import read_text, write_atomically
from ..physics import NOH_BATHE, Design
from ..physics.jit import cache_folder

MOST = 64
"""Number of designs kept, the latest ones."""

RESTS_ON = ('physics', 'device', 'analysis')
"""Packages on whose source a check depends."""


def kept(design: Design, settings: Settings) -> Report | None:
    """Return the findings, without passes, of a design checked before; None if it was not."""
    found = _read().get(_key(design, settings))
    if found is None:
        return None
    return Report(
        tuple(Finding(name, {}, '', Verdict(verdict), text, '') for name, verdict, text in found)
    )


def keep(design: Design, settings: Settings, report: Report) -> None:
    """Keep the findings, without passes, if a place is writable."""
    found = [
        (each.name, each.verdict.value, each.text)
        for each in report.findings
        if each.verdict is not Verdict.PASS
    ]
    all_kept = {**_read(), _key(design, settings): found}
    if (path := _path()) is not None:
        with contextlib.suppress(OSError):
            write_atomically(path, json.dumps(dict(list(all_kept.items())[-MOST:])))


def _path() -> Path | None:
    folder = cache_folder(NOH_BATHE.advance)
    return folder / 'design_checks.json' if folder is not None and folder.is_dir() else None


def _read() -> dict[str, list[tuple[str, str, str]]]:
    if (path := _path()) is not None:
        with contextlib.suppress(OSError, ValueError):
            found: dict[str, list[tuple[str, str, str]]] = json.loads(read_text(path))
            return found
    return {}


def _key(design: Design, settings: Settings) -> str:
    return hashlib.sha256(f'{_source()} {design!r} {settings!r}'.encode()).hexdigest()


@cache
def _source() -> str:
    package = Path(__file__).parents[1]
    files = sorted(path for name in RESTS_ON for path in package.joinpath(name).rglob('*.py'))
    return hashlib.sha256(b''.join(path.read_bytes() for path in files)).hexdigest()
