# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Result files: numbers with the command, version, processor, seed and date they belong to.

A file also has a fingerprint of everything it measured: a hash of what that does, to a millionth
of a cell, and of what the rules of reading say, if it counted reads. A file whose fingerprints are
no longer those of the code is older than the code. New comments, names and a last bit change no
fingerprint.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros import __version__
from mlmem_ros.device import Erase, MemoryElement, Read, Write, new_element, preset
from mlmem_ros.durable import write_atomically
from mlmem_tools.cli.output import plain

from .bench.host import describe_host
from .decisions import decisions

FOLDER = Path(__file__).parent.parent / 'results'
"""The committed results, in a checkout."""

LATTICE = 'lattice'
"""What has a fingerprint beside the presets: the real lattice of `mlmem measured`."""

READ = ', read'
"""Behind the name of a preset: its fingerprint is of what the rules of reading make of echoes."""

APART = ('bits_3', 'bits_8')
"""Presets that are measured only if named: the first is `case_2`, the other takes hours."""

MOST_LEVELS = 64
"""An element of more has no fingerprint: its factory calibration takes too long."""


def save(
    path: Path,
    result: Mapping[str, Any],
    command: str,
    seed: int | None = None,
    of: Iterable[str] = (),
    kept: Mapping[str, Any] | None = None,
) -> Path:
    """Write a result file; return its path.

    Args:
        path: Of the file.
        result: Of mappings, sequences, dataclasses, arrays and plain values.
        command: That makes it again.
        seed: Of its random numbers.
        of: The presets that it measured, `with_reads` if it counted these, or `LATTICE`.
        kept: The file whose other entries the result has too: they keep their fingerprints.

    Raises:
        OSError: It cannot be written.
    """
    origin = {
        'command': command,
        'version': __version__,
        'processor': describe_host()['processor'],
        'seed': seed,
        'date': date.today().isoformat(),
        'fingerprints': (kept or {}).get('fingerprints', {})
        | {name: fingerprint(name) for name in of},
    }
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, json.dumps(plain({**origin, **result}), indent=1) + '\n')
    return path


def with_reads(presets: Iterable[str]) -> list[str]:
    """Return what a count of their reads measured: the presets, and how they are read."""
    return [each for name in presets for each in (name, name + READ)]


def load(path: Path) -> dict[str, Any]:
    """Return a result file."""
    result = json.loads(path.read_text(encoding='utf-8'))
    assert isinstance(result, dict), path
    return result


def load_kept(path: Path) -> dict[str, Any]:
    """Return a result file, whose other entries a new result keeps; nothing if there is none."""
    return load(path) if path.exists() else {}


def outdated(result: Mapping[str, Any]) -> list[str]:
    """Return what a result measured and the code does otherwise by now."""
    made = result.get('fingerprints', {})
    return [name for name, found in made.items() if found != fingerprint(name)]


@cache
def fingerprint(name: str) -> str | None:
    """Return a hash of what a preset, or `LATTICE`, does, or with `READ` behind it what it reads;
    None for too large an element.
    """
    hashed = hashlib.blake2b(digest_size=8)
    if name == LATTICE:
        from .measured.runs import Case
        from .measured.shell import shell
        from .measured.wave import Losses, launch

        wave = launch(Case(22.5, 7.0), shell(3.971), Losses(0.02, 0.01))
        hashed.update(np.round(wave.u, 6).tobytes())
        return hashed.hexdigest()
    name, reads, _ = name.partition(READ)
    if preset(name).design.levels > MOST_LEVELS:
        return None
    if reads:
        hashed.update(repr(decisions(name)).encode())
        return hashed.hexdigest()
    element = new_element(preset(name))
    few = min(2, element.design.levels - 1)
    for level in (*range(few + 1), 0):
        element.perform(Write(level))
        hashed.update(_seen(element))
    for command in (Read(), Erase()):
        element.perform(command)
        hashed.update(_seen(element))
    return hashed.hexdigest()


def _seen(element: MemoryElement) -> bytes:
    """Return ticks and configuration, without last bits."""
    rounded = np.round(element.chain.configuration, 6) + 0.0  # or 0 has two signs
    return element.ticks.to_bytes(8, 'little') + rounded.tobytes()
