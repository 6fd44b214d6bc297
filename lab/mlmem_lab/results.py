# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Result files: numbers with the command, version, processor, seed and date they belong to.

A file also has a fingerprint of everything behind it: of what a memory does, to a millionth of a
cell, and what the rules of reading say, if it counted reads; of the code that measured, with all
that this reaches (`by`, `reach`); of files that it is drawn from. If these are no longer the same,
the file is older than the code. `PICTURES` has the same of every picture of the pages, and of its
bytes. What was measured with code that is not committed cannot be made again: such a file says so.

`run` is the command line of the modules that measure presets one by one.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import shlex
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_ros import __version__, outside
from mlmem_ros.device import Erase, MemoryElement, Read, Write, new_element, preset
from mlmem_ros.device.presets import PRESETS
from mlmem_ros.device.register import LEFT_OVER, NOISE, forecasts_of
from mlmem_ros.durable import write_atomically
from mlmem_ros.physics import Specimen
from mlmem_tools.cli.output import plain

from . import reach
from .bench.measure import processor
from .decisions import decisions

ROOT = reach.ROOT
FOLDER = ROOT / 'lab' / 'results'
"""The committed results, in a checkout."""

PICTURES = 'pictures.json'
"""The one of them that says of every picture of a page what made it."""

SHOWN = ('docs/figures', 'docs/images')
"""Where these are."""

BY = ' by '
"""Between what was measured and the code that did: the fingerprint is of the code."""

BEGAN = time.monotonic()

LATTICE = 'lattice'
"""What has a fingerprint beside the presets: the real lattice of `mlmem measured`."""

READ = ', read'
"""Behind the name of a preset: its fingerprint is of what the rules of reading make of echoes."""

APART = (
    'bits_3', 'bits_8', 'kick_2', 'kick_3', 'kick_4',
    'byte', 'register_4', 'register_5', 'register_8',
)  # fmt: skip
"""Presets that are measured only if named: the first is `case_2`, the second takes hours, and the
others are measured by `mlmem kicks`, `mlmem_lab.words` and `mlmem_lab.long_words`."""

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
        of: The presets that it measured, `with_reads` if it counted these, `LATTICE`; what
            measured them (`by`); files of the checkout, by path.
        kept: The file whose other entries the result has too: they keep their fingerprints.

    Raises:
        OSError: It cannot be written.
    """
    told = json.dumps(plain({**_origin(command, of, kept, seed), **result}), indent=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, told + '\n')
    return path


def keep_picture(picture: Path, command: str, of: Iterable[str] = ()) -> None:
    """Note what made a picture of a page; of one that is elsewhere, nothing."""
    name = _in_checkout(picture)
    if name.startswith(SHOWN):
        made = _origin(command, [name, *of])
        fingerprint.cache_clear()  # it may have had other bytes a moment ago
        made['fingerprints'] |= {name: fingerprint(name)}
        told = load_kept(FOLDER / PICTURES) | {name: made}
        text = json.dumps({key: told[key] for key in sorted(told)}, indent=1)
        write_atomically(FOLDER / PICTURES, text + '\n')


def _in_checkout(path: Path) -> str:
    path = path.resolve()
    return path.relative_to(ROOT).as_posix() if path.is_relative_to(ROOT) else ''


ORIGIN = (
    'command', 'version', 'processor', 'seed', 'date', 'seconds', 'fingerprints', 'uncommitted',
    'accepted',
)  # fmt: skip
"""What a file says of itself."""


def _origin(
    command: str, of: Iterable[str], kept: Mapping[str, Any] | None = None, seed: int | None = None
) -> dict[str, Any]:
    """Return what a file says of itself, but what it does not know."""
    kept, of = kept or {}, list(of)
    was = kept.get('fingerprints', {})
    origin = {
        'command': command,
        'version': __version__,
        'processor': processor(),
        'seed': seed,
        'date': date.today().isoformat(),
        'seconds': max(kept.get('seconds', 0), round(time.monotonic() - BEGAN)),
        'fingerprints': was | {name: fingerprint(name) for name in of},
    }
    told = {'uncommitted': uncommitted()}
    if not was.keys() <= set(of):  # a part of it was not made again
        told['accepted'] = kept.get('accepted', [])
    return origin | {key: value for key, value in told.items() if value}


def by(maker: Callable[..., Any], *entries: str) -> list[str]:
    """Return what a file has fingerprints of: the code of what measured each of these entries."""
    module = maker.__module__
    if module == '__main__':  # python3 -m
        module = str(getattr(sys.modules[module].__spec__, 'name', module))
    return [f'{entry}{BY}{module}:{maker.__qualname__}' for entry in entries]


def accept(path: Path, why: str, name: str | None = None) -> list[str]:
    """Take a result, or a picture by its name, for that of today's code; return what differed.

    It is not made again: the file says so until it is.
    """
    told = load(path)
    entry = told if name is None else told[name]
    if old := outdated(entry):
        entry['fingerprints'] |= {each: fingerprint(each) for each in old}
        entry['accepted'] = [*entry.get('accepted', ()), f'{date.today().isoformat()}: {why}']
        write_atomically(path, json.dumps(told, indent=1) + '\n')
    return old


def uncommitted() -> list[str]:
    """Return the files of code of this checkout that differ from its last commit."""
    git = shutil.which('git')
    if git is None or not (ROOT / '.git').exists():
        return []
    asked = [git, 'status', '--porcelain', '--', '*.py', '*.c', '*.csv']
    lines = subprocess.run(asked, cwd=ROOT, capture_output=True, text=True).stdout.splitlines()
    return [line[3:] for line in lines]


Measure = Callable[[str], Any]
"""What is found of an entry."""

Joined = Callable[[Mapping[str, Any], str, Any], dict[str, Any]]
"""A result: what a file has, in which what was found of an entry replaces what it had of it."""

Draw = Callable[[Mapping[str, Any]], Any]
"""Makes a Matplotlib figure of a result."""


def run(
    module: str,
    about: str | None,
    measure: Measure,
    seed: int | None = None,
    joined: Joined | None = None,
    entries: Mapping[str, Sequence[str]] | None = None,
    draw: Draw | None = None,
    arguments: Sequence[str] | None = None,
) -> int:
    """Measure entries by name, and keep each in the module's result file as soon as it is done.

    Args:
        module: Its name, such as `times`, whose last part is that of the file.
        measure: What it does with an entry.
        joined: Default: `presets` of the file holds each by name.
        entries: What can be measured, and which fingerprints that has beside the code's; default:
            every preset by itself.

    Returns:
        0; 1 if the file cannot be read or written; 2 if the code is not committed.
    """
    path = FOLDER / f'{module.rpartition(".")[2]}.json'
    parser = argparse.ArgumentParser(f'python3 -m mlmem_lab.{module}', description=about)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    known = entries or {name: [name] for name in PRESETS}
    parser.add_argument(
        'entries', nargs='*', metavar='ENTRY',
        help=f'of {", ".join(known)}; none: all that the file has. What it has of others is kept',
    )  # fmt: skip
    if draw is not None:
        parser.add_argument('--figure', type=Path, metavar='PNG', help='draw the file, no more')
    told = parser.parse_args(arguments)
    asked = told.entries
    if unknown := sorted(set(asked) - set(known)):
        parser.error(f'an entry must be one of {", ".join(known)}; got {unknown[0]}')
    if draw is not None and told.figure is not None:
        _draw(draw, path, told.figure, f'{parser.prog} --figure {told.figure}')
        return 0
    if changed := uncommitted():
        text = 'commit first: a result of code that is not committed cannot be made again'
        print(f'{parser.prog}: {text} ({", ".join(changed)})', file=sys.stderr)
        return 2
    again: list[str] = []
    try:
        for name in asked or _measured(load_kept(path), known):
            found = measure(name)
            print(name, found, flush=True)
            kept = load_kept(path)
            result = (joined or _by_name)(kept, name, found)
            names = shlex.join(dict.fromkeys([*_measured(kept, known), name]))
            again += [*known[name], *by(measure, name)]
            save(path, result, f'{parser.prog} {names}', seed, again, kept)
    except (OSError, ValueError) as error:
        print(f'{parser.prog}: {path} could not be made; {error}', file=sys.stderr)
        return 1
    return 0


def _measured(result: Mapping[str, Any], known: Iterable[str]) -> list[str]:
    """Return the entries of a result file."""
    there = [name.rpartition(BY)[0] for name in result.get('fingerprints', {}) if BY in name]
    return [name for name in dict.fromkeys(there) if name in known]


def _draw(draw: Draw, path: Path, picture: Path, command: str) -> None:
    from .studies.style import styled

    with styled():
        draw(load(path)).savefig(picture, metadata={'Software': None})
    keep_picture(picture, command, [*by(draw, 'picture'), _in_checkout(path)])


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
    """Return what a result measured and the code does otherwise by now.

    Code or a file that was not found when the result was made is among it.
    """
    made = result.get('fingerprints', {})
    lost = {name for name, found in made.items() if found is None and (BY in name or '/' in name)}
    return [name for name, found in made.items() if name in lost or found != fingerprint(name)]


@cache
def fingerprint(name: str) -> str | None:
    """Return a hash of what a preset, or `LATTICE`, does, or with `READ` behind it what it reads;
    of code, of a file; None for too large an element, and for what is gone.
    """
    if BY in name:
        return reach.code(name.rpartition(BY)[2])
    if '/' in name:
        return _content(ROOT / name)
    hashed = hashlib.blake2b(digest_size=8)
    if name == LATTICE:
        from .measured.runs import Case
        from .measured.wave import Losses, launch, shell

        wave = launch(Case(22.5, 7.0), shell(3.971), Losses(0.02, 0.01))
        hashed.update(np.round(wave.u, 6).tobytes())
        return hashed.hexdigest()
    name, reads, _ = name.partition(READ)
    if name not in PRESETS or preset(name).design.levels > MOST_LEVELS:
        return None
    if reads:
        hashed.update(repr(decisions(name)).encode())
        design, settings = preset(name)
        if settings.register.spacing:
            parts = forecasts_of(Specimen(design), settings).parts
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


def _content(file: Path) -> str | None:
    """Return a hash of a file; of a result file, of what was found."""
    if not file.exists():
        return None
    told = file.read_bytes()
    if file.parent == FOLDER:
        found = {key: value for key, value in load(file).items() if key not in ORIGIN}
        told = json.dumps(found, sort_keys=True).encode()
    return hashlib.blake2b(told, digest_size=8).hexdigest()


def _seen(element: MemoryElement) -> bytes:
    """Return ticks and configuration, without last bits."""
    rounded = np.round(element.chain.configuration, 6) + 0.0  # or 0 has two signs
    return element.ticks.to_bytes(8, 'little') + rounded.tobytes()
