# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The design check of a node that is being configured: warnings in its log, or a refusal.

Findings are cached beside the compiled kernels, for a faster next start. The cache may be deleted;
a change to any file that a check depends on makes it start anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
from functools import cache, lru_cache
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from mlmem import Design, DesignError, End, Settings, find_cache_folder
from mlmem.atomic_files import write_atomically

from ..packages import find_tool

if TYPE_CHECKING:
    from .worker import ThrottledLog


Found = tuple[str, str, str, dict[str, float]]
"""A finding: its name, verdict, text and values."""


def check_design(
    design: Design, settings: Settings, mode: str, log: ThrottledLog
) -> dict[End, float]:
    """Check a design, and log every finding that is not a pass.

    Args:
        mode: Whether to `refuse` a design that fails, to `warn`, or to `skip` the check.

    Returns:
        The loudest pulse that moves nothing, in cells, by end; nothing if that is not known.

    Raises:
        DesignError: The design fails, and the mode is 'refuse'.
    """
    if mode == 'skip':
        return {}
    found = load_findings(design, settings)
    failed = [f'{name}: {text}' for name, verdict, text, _ in found if verdict == 'fail']
    if failed and mode == 'refuse':
        why = (
            f'the design fails its check ({"; ".join(failed)}). `mlmem design check` shows '
            'all findings; with design.check: warn it starts anyway'
        )
        raise DesignError(reason=why)
    for text in failed:
        log.error(f'design check: {text}')
    for name, verdict, text, _ in found:
        if verdict == 'warn':
            log.warning(f'design check: {name}: {text}')
    return {
        End(end): amplitude
        for name, *_, values in found
        if name == 'read_disturb'
        for end, amplitude in values.items()
    }


@lru_cache(maxsize=16)  # nodes are mostly configured again without changes
def load_findings(design: Design, settings: Settings) -> list[Found]:
    """Return the findings that are not a pass, and that on read disturb, new or from the disk."""
    path = _cache_path(design, settings)
    if path is not None:
        with contextlib.suppress(OSError, ValueError, TypeError):  # none yet, or damaged
            rows = json.loads(path.read_text(encoding='utf-8'))
            return [(name, verdict, text, values) for name, verdict, text, values in rows]
    check = find_tool('design_check').load()
    found = [
        (each.name, each.verdict.value, each.text, dict(each.values))
        for each in check(design, settings).findings
        if each.verdict.value != 'pass' or each.name == 'read_disturb'
    ]
    if path is not None:
        with contextlib.suppress(OSError):
            write_atomically(path, json.dumps(found))
    return found


def _cache_path(design: Design, settings: Settings) -> Path | None:
    """Return the file of a design's findings; None where no kernels are cached."""
    folder = find_cache_folder()
    if folder is None or not folder.is_dir():
        return None
    key = hashlib.sha256(f'{_hash_source()} {design!r} {settings!r}'.encode()).hexdigest()
    return folder / f'design_check_{key}.json'


@cache
def _hash_source() -> str:
    files: list[Path] = []
    for module in ('mlmem', find_tool('design_check').module):
        found = find_spec(module)
        if found is not None and found.origin is not None:
            files += Path(found.origin).parent.rglob('*.py')
    files.sort()
    return hashlib.sha256(b''.join(path.read_bytes() for path in files)).hexdigest()
