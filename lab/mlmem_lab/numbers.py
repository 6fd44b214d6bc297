# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Place the numbers of lab/results in the pages: python3 -m mlmem_lab.numbers [--check | --stale].

A comment behind a number, or behind words in italics, names the value by file and keys; the
number keeps its decimals:

    A step makes 0.142<!-- energy/plain/level --> of heat. An *AMD EPYC*<!-- r/processor --> did.

A table between two comments is made as a whole:

    <!-- table: reads/elements: reads; right; wrong -->
    <!-- end -->

has a row for each entry and a column for each key (of a list of rows, for all keys);
tables that need more are made by the functions of `tables`, whose names begin with the file.

--check writes nothing: it fails if a number of a page differs from its result file, or if a
picture has other bytes than the one that its command drew. --stale lists the results and pictures
whose modules have changed since, with the command that makes each again and its time.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from . import tables
from .results import (
    CHECKOUT_ROOT,
    PICTURE_FOLDERS,
    PICTURES_FILE,
    RESULT_FOLDER,
    find_stale_entries,
    hash_bytes,
    load_kept,
    load_result,
)  # fmt: skip


def list_pages() -> list[Path]:
    """Return the README and all pages."""
    return [CHECKOUT_ROOT / 'README.md', *sorted((CHECKOUT_ROOT / 'docs').rglob('*.md'))]


def place_numbers(text: str, folder: Path) -> str:
    """Return a page with the numbers and tables of the results.

    Raises:
        ValueError: A comment names no number.
    """
    # a number, or words in italics, and the comment behind it
    placed_number = re.compile(
        r'(-?(?:\d{1,3}(?: \d{3})+|\d+(?:\.\d+)?(?:e[-+]?\d+)?)|\*[^*\n]+\*)<!-- ([^>]+?) -->'
    )
    placed_table = re.compile(r'<!-- table: ([^>]+?) -->\n.*?<!-- end -->', re.DOTALL)
    text = placed_number.sub(
        lambda found: f'{format_number(found[1], found[2], folder)}<!-- {found[2]} -->', text
    )
    return placed_table.sub(lambda found: make_table(found[1], folder), text)


def format_number(printed: str, path: str, folder: Path) -> str:
    """Return a number, or words, in the format of those on the page."""
    value = find_value(path, folder)
    if printed.startswith('*') and isinstance(value, str):
        return f'*{value}*'
    if printed.startswith('*') or isinstance(value, bool) or not isinstance(value, int | float):
        raise ValueError(f'{path} must be a number; got {value!r}')
    mantissa, power, _ = printed.partition('e')
    decimals = len(mantissa.partition('.')[2])
    if power:
        found, exponent = f'{value:.{decimals}e}'.split('e')
        return f'{found}e{int(exponent)}'
    grouped = abs(value) >= 10_000
    return f'{value:{"," if grouped else ""}.{decimals}f}'.replace(',', ' ')


def find_value(path: str, folder: Path) -> Any:
    """Return the value that a path names: a file, then keys."""
    name, *keys = path.split('/')
    try:
        value: Any = load_result(folder / f'{name}.json')
        for key in keys:
            value = value[key]
    except (OSError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f'{path} is in no result file: {error!r}') from None
    return value


def make_table(marker: str, folder: Path) -> str:
    """Return a table between its comments."""
    path, _, columns = (part.strip() for part in marker.partition(':'))
    if (make_rows := getattr(tables, path.replace(' ', '_'), None)) is not None:
        rows = make_rows(find_value(path.split()[0], folder))
    elif isinstance(entries := find_value(path, folder), list):
        names = list(dict.fromkeys(key for row in entries for key in row))
        rows = [names, *([row.get(name) for name in names] for row in entries)]
    else:
        names = [name.strip() for name in columns.split(';')]
        rows = [['', *names]]
        rows += ([key, *(row[name] for name in names)] for key, row in entries.items())
    head, *body = ('| ' + ' | '.join(map(_format_cell, row)) + ' |' for row in rows)
    lines = [head, '|' + '---|' * len(rows[0]), *body]
    return '\n'.join([f'<!-- table: {marker} -->', '', *lines, '', '<!-- end -->'])


def _format_cell(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:.3g}'
    return f'{value:,}'.replace(',', ' ') if isinstance(value, int) else str(value or '')


def list_stale() -> None:
    """Print the results and pictures whose modules changed, the command and time."""
    results: dict[str, Mapping[str, Any]] = {
        file.name: load_result(file)
        for file in sorted(RESULT_FOLDER.glob('*.json'))
        if file.name != PICTURES_FILE
    }
    for name, result in (results | load_kept(RESULT_FOLDER / PICTURES_FILE)).items():
        if stale := find_stale_entries(result):
            entries = '' if stale == [*result['hashes']] else f' ({", ".join(stale)})'
            seconds = result.get('seconds')
            time = f'{seconds} s' if seconds else 'not timed'
            print(f'{name}{entries}\n    {result["command"]} ({time})')


def find_wrong_pictures() -> Iterator[str]:
    """Yield what is wrong with the pictures of the pages."""
    known = load_kept(RESULT_FOLDER / PICTURES_FILE)
    files = (path for folder in PICTURE_FOLDERS for path in (CHECKOUT_ROOT / folder).glob('*.*'))
    for name in sorted(
        {path.relative_to(CHECKOUT_ROOT).as_posix() for path in files} | set(known)
    ):
        if name not in known:
            yield f'{name}: {PICTURES_FILE} names no command that draws it'
        elif known[name]['bytes'] != hash_bytes(CHECKOUT_ROOT / name):
            yield f'{name}: not the picture that "{known[name]["command"]}" drew'


def check_pages(write: bool) -> bool:
    """Compare the pages with the result files; return whether all numbers are right.

    Args:
        write: Place the numbers of pages that differ.
    """
    correct = True
    for page in list_pages():
        text = page.read_text(encoding='utf-8')
        try:
            expected = place_numbers(text, RESULT_FOLDER)
        except ValueError as error:
            print(f'{page.relative_to(CHECKOUT_ROOT)}: {error}')
            correct = False
            continue
        if expected != text and write:
            page.write_text(expected, encoding='utf-8')
        for old, new in zip(text.splitlines(), expected.splitlines(), strict=False):
            if old != new:
                print(
                    f'{page.relative_to(CHECKOUT_ROOT)}: {old}\n{"now" if write else "must be"}: '
                    f'{new}'
                )
                correct = correct and write
                break
    return correct


def main(arguments: list[str]) -> int:
    """Place the numbers, or check them; return 0, or 1 if something is wrong."""
    parser = argparse.ArgumentParser('python3 -m mlmem_lab.numbers', description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument('--check', action='store_true', help='write nothing, and compare')
    parser.add_argument('--stale', action='store_true', help='list what is to be made again')
    options = parser.parse_args(arguments)
    if options.stale:
        list_stale()
        return 0
    correct = check_pages(write=not options.check)
    wrong_pictures = [*find_wrong_pictures()]
    print(*wrong_pictures, sep='\n', end='\n' * bool(wrong_pictures))
    return int(not correct or bool(wrong_pictures))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
