# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Result files: numbers with the command, version, processor, seed and date they belong to.

A file also has a fingerprint of everything it measured: a hash of what that does, to a millionth
of a cell, and of what the rules of reading say, if it counted reads. A file whose fingerprints are
no longer those of the code is older than the code. New comments, names and a last bit change no
fingerprint. What was measured with code that is not committed cannot be made again: such a file
says so.

`run` is the command line of the modules that measure presets one by one.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros import __version__, outside
from mlmem_ros.device import Erase, MemoryElement, Read, Settings, Write, new_element, preset
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.register import LEFT_OVER, NOISE, forecasts
from mlmem_ros.durable import write_atomically
from mlmem_ros.physics import CASE_II
from mlmem_tools.cli.output import plain

from .bench.host import describe_host
from .decisions import decisions

FOLDER = Path(__file__).parent.parent / 'results'
"""The committed results, in a checkout."""

LATTICE = 'lattice'
"""What has a fingerprint beside the presets: the real lattice of `mlmem measured`."""

DESIGNS = 'designs'
"""Also: the designer, whose designs `mlmem reads` counts. Its fingerprint is of one design."""

READ = ', read'
"""Behind the name of a preset: its fingerprint is of what the rules of reading make of echoes."""

APART = ('bits_3', 'bits_8', 'kick_2', 'kick_3', 'kick_4', 'byte')
"""Presets that are measured only if named: the first is `case_2`, the second takes hours, and the
others are measured by `mlmem kicks`."""

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
        of: The presets that it measured, `with_reads` if it counted these, `LATTICE`, `DESIGNS`.
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
    if changed := uncommitted():
        origin['uncommitted'] = changed
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, json.dumps(plain({**origin, **result}), indent=1) + '\n')
    return path


def uncommitted() -> list[str]:
    """Return the files of code of this checkout that differ from its last commit."""
    root, git = FOLDER.parent.parent, shutil.which('git')
    if git is None or not (root / '.git').exists():
        return []
    asked = [git, 'status', '--porcelain', '--', '*.py', '*.c', '*.csv']
    lines = subprocess.run(asked, cwd=root, capture_output=True, text=True).stdout.splitlines()
    return [line[3:] for line in lines]


Measure = Callable[[str], Any]
"""What is found of a preset."""

Joined = Callable[[Mapping[str, Any], str, Any], dict[str, Any]]
"""A result: what a file has, in which what was found of a preset replaces what it had of it."""


def run(
    module: str,
    about: str | None,
    measure: Measure,
    seed: int | None = None,
    joined: Joined | None = None,
    arguments: Sequence[str] | None = None,
) -> int:
    """Measure presets by name, and keep each in the module's result file as soon as it is done.

    Args:
        module: Its name, such as `times`, and that of the file.
        about: Its docstring.
        measure: What it does with a preset.
        seed: Of its random numbers.
        joined: Default: `presets` of the file holds each by name.
        arguments: Of the command line; default: those of the program.

    Returns:
        0; 1 if the file cannot be read or written; 2 if the code is not committed.
    """
    path = FOLDER / f'{module}.json'
    parser = argparse.ArgumentParser(f'python3 -m mlmem_lab.{module}', description=about)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument(
        'presets', nargs='*', metavar='PRESET',
        help='elements; none: all that the file has. What it has of others is kept',
    )  # fmt: skip
    asked = parser.parse_args(arguments).presets
    if unknown := sorted(set(asked) - set(PRESETS)):
        parser.error(f'a preset must be one of {", ".join(PRESETS)}; got {unknown[0]}')
    if changed := uncommitted():
        text = 'commit first: a result of code that is not committed cannot be made again'
        print(f'{parser.prog}: {text} ({", ".join(changed)})', file=sys.stderr)
        return 2
    try:
        for name in asked or _measured(load_kept(path)):
            found = measure(name)
            print(name, found, flush=True)
            kept = load_kept(path)
            result = (joined or _by_name)(kept, name, found)
            names = dict.fromkeys([*_measured(kept), name])
            save(path, result, f'{parser.prog} {" ".join(names)}', seed, of=[name], kept=kept)
    except (OSError, ValueError) as error:
        print(f'{parser.prog}: {path} could not be made; {error}', file=sys.stderr)
        return 1
    return 0


def _measured(result: Mapping[str, Any]) -> list[str]:
    """Return the presets of a result file."""
    return [name for name in result.get('fingerprints', {}) if name in PRESETS]


def _by_name(kept: Mapping[str, Any], name: str, found: Any) -> dict[str, Any]:
    return {'presets': kept.get('presets', {}) | {name: found}}


def with_reads(presets: Iterable[str]) -> list[str]:
    """Return what a count of their reads measured: the presets, and how they are read."""
    return [each for name in presets for each in (name, name + READ)]


def load(path: Path) -> dict[str, Any]:
    """Return a result file."""
    result = json.loads(outside.read(path))
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
    """Return a hash of what a preset, or `LATTICE`, does, or with `READ` behind it what it reads,
    or of what the designer chooses; None for too large an element.
    """
    hashed = hashlib.blake2b(digest_size=8)
    if name == LATTICE:
        from .measured.runs import Case
        from .measured.shell import shell
        from .measured.wave import Losses, launch

        wave = launch(Case(22.5, 7.0), shell(3.971), Losses(0.02, 0.01))
        hashed.update(np.round(wave.u, 6).tobytes())
        return hashed.hexdigest()
    if name == DESIGNS:
        hashed.update(repr(_chosen(2)).encode())
        return hashed.hexdigest()
    name, reads, _ = name.partition(READ)
    if preset(name).design.levels > MOST_LEVELS:
        return None
    if reads:
        hashed.update(repr(decisions(name)).encode())
        design, settings = preset(name)
        if settings.register.spacing:
            parts = forecasts(design, settings).parts
            rules = LEFT_OVER, NOISE, settings.register.min_margin
            hashed.update(repr((np.round(parts / parts.max(), 4).tolist(), rules)).encode())
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


def _chosen(levels: int) -> list[tuple[str, str, str]]:
    """Return what the designer chooses other than the defaults, for the moves that are counted."""
    from .designer import propose

    found = propose(levels)
    given: dict[str, tuple[Any, Any]] = {'design': (found.design, CASE_II)}
    for group in ('write', 'erase', 'probe', 'probe_right', 'throw', 'down_odd', 'down_even'):
        given[group] = getattr(found.settings, group), getattr(Settings(), group)
    return [
        (group, field.name, f'{value:.6g}' if isinstance(value, float) else str(value))
        for group, (own, default) in given.items()
        for field in fields(own)
        if (value := getattr(own, field.name)) != getattr(default, field.name)
    ]


def _seen(element: MemoryElement) -> bytes:
    """Return ticks and configuration, without last bits."""
    rounded = np.round(element.chain.configuration, 6) + 0.0  # or 0 has two signs
    return element.ticks.to_bytes(8, 'little') + rounded.tobytes()
