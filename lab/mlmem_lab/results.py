# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Result files: numbers with the command, version, processor, seed and date that they belong to.

A result also names the modules that it measured: files and folders of the checkout, which the
study lists, and for each entry one hash of their contents, of code without comments, docstrings
and imports. If the contents have changed, the entry is stale: `make figures-stale` lists it.
`PICTURES_FILE` has the same for every picture of the pages, and a hash of its bytes.
"""

from __future__ import annotations

import ast
import hashlib
import json
import time
from collections.abc import Iterable, Mapping, Sequence
from datetime import date
from functools import cache
from pathlib import Path
from typing import Any

from mlmem import ELEMENT_NAMES, load_element, parsing
from mlmem.atomic_files import write_atomically
from mlmem_ros import __version__
from mlmem_tools.json_values import to_json_value

from .bench.measure import describe_processor

CHECKOUT_ROOT = Path(__file__).parents[2]
"""The root of the checkout."""

RESULT_FOLDER = CHECKOUT_ROOT / 'lab' / 'results'
"""The folder of the committed results."""

PICTURES_FILE = 'pictures.json'
"""The file in `RESULT_FOLDER` that says of every picture of a page which command drew it."""

PICTURE_FOLDERS = ('docs/figures', 'docs/images')
"""The folders of the pictures of the pages."""

DEVICE_MODULES = ('lab/results/behaviour.json',)
"""What every study of a simulated element measures: what the device does, whatever its code (see
`behaviour`).
"""

START_TIME_S = time.monotonic()


def list_strained_presets() -> tuple[str, ...]:
    """Return the presets that are written by strain; `kicks` and `words` measure the others."""
    return tuple(
        name for name in ELEMENT_NAMES if load_element(name).settings.write.method == 'strain'
    )


def save_result(
    path: Path,
    result: Mapping[str, Any],
    command: str,
    modules: Sequence[str],
    entries: Iterable[str] = ('all',),
    seed: int | None = None,
    kept: Mapping[str, Any] | None = None,
) -> Path:
    """Write a result file and return its path.

    Args:
        modules: The files and folders of the checkout that the study measured.
        entries: The parts of the result that were measured now.
        kept: The former content of the file, if the result keeps some of its entries: these keep
            their hashes.

    Raises:
        OSError: The file cannot be written.
    """
    origin = describe_origin(command, modules, entries, seed, kept or {})
    text = json.dumps(to_json_value({**origin, **result}), indent=1)
    path.parent.mkdir(parents=True, exist_ok=True)
    write_atomically(path, text + '\n')
    return path


def keep_picture(picture: Path, command: str, modules: Sequence[str]) -> None:
    """Note which command drew a picture; a picture that is on no page is not noted."""
    name = find_in_checkout(picture)
    if name.startswith(PICTURE_FOLDERS):
        origin = describe_origin(command, modules, ['all'], None, {})
        pictures = load_kept(RESULT_FOLDER / PICTURES_FILE)
        pictures[name] = origin | {'bytes': hash_bytes(picture)}
        text = json.dumps({key: pictures[key] for key in sorted(pictures)}, indent=1)
        write_atomically(RESULT_FOLDER / PICTURES_FILE, text + '\n')


def find_in_checkout(path: Path) -> str:
    """Return the path of a file within the checkout; empty if the file is elsewhere."""
    path = path.resolve()
    return path.relative_to(CHECKOUT_ROOT).as_posix() if path.is_relative_to(CHECKOUT_ROOT) else ''


def describe_origin(
    command: str,
    modules: Sequence[str],
    entries: Iterable[str],
    seed: int | None,
    kept: Mapping[str, Any],
) -> dict[str, Any]:
    """Return where a result comes from, and when and from what code."""
    current = hash_modules(modules)
    return {
        'command': command,
        'version': __version__,
        'processor': describe_processor(),
        'seed': seed,
        'date': date.today().isoformat(),
        'seconds': max(kept.get('seconds', 0), round(time.monotonic() - START_TIME_S)),
        'modules': list(modules),
        'hashes': kept.get('hashes', {}) | dict.fromkeys(entries, current),
    }


def find_stale_entries(result: Mapping[str, Any]) -> list[str]:
    """Return the entries of a result whose modules have changed, or are gone."""
    current = hash_modules(result['modules'])
    return [name for name, found in result['hashes'].items() if not current or found != current]


def hash_modules(modules: Iterable[str]) -> str:
    """Return one hash of the contents of files and folders; empty if one of them is missing."""
    contents = hashlib.blake2b(digest_size=8)
    for path in (CHECKOUT_ROOT / module for module in modules):
        if not path.exists():
            return ''
        for file in sorted(path.rglob('*.py')) if path.is_dir() else [path]:
            contents.update(_read_content(file))
    return contents.hexdigest()


def hash_bytes(file: Path) -> str:
    """Return a hash of the bytes of a file; empty if the file is missing."""
    if not file.exists():
        return ''
    return hashlib.blake2b(file.read_bytes(), digest_size=8).hexdigest()


def _read_content(file: Path) -> bytes:
    """Return what of a file matters: of Python the code, of a result file the numbers."""
    if file.suffix == '.py':
        return _parse_code(file, file.stat().st_mtime_ns).encode()
    if file.parent != RESULT_FOLDER:
        return file.read_bytes()
    origin = 'command', 'version', 'processor', 'seed', 'date', 'seconds', 'modules', 'hashes'
    numbers = {key: value for key, value in load_result(file).items() if key not in origin}
    return json.dumps(numbers, sort_keys=True).encode()


@cache
def _parse_code(file: Path, changed_ns: int) -> str:
    """Return the syntax tree of a module without its docstrings and imports, as text."""
    tree = ast.parse(file.read_bytes())
    for node in ast.walk(tree):
        if isinstance(body := getattr(node, 'body', None), list):
            node.body = [each for each in body if not _is_left_out(each)]  # type: ignore[attr-defined]
    return ast.dump(tree)


def _is_left_out(node: ast.AST) -> bool:
    """Return whether a statement is an import, or only a string, as a docstring is."""
    match node:
        case ast.Import() | ast.ImportFrom() | ast.Expr(ast.Constant(str())):
            return True
    return False


def load_result(path: Path) -> dict[str, Any]:
    """Return the content of a result file."""
    result = json.loads(parsing.read_file(path))
    assert isinstance(result, dict), path
    return result


def load_kept(path: Path) -> dict[str, Any]:
    """Return the content of a result file that a new result keeps; empty if there is no file."""
    return load_result(path) if path.exists() else {}
