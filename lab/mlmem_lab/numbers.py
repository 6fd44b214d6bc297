# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Place the numbers of lab/results in the pages: python3 -m mlmem_lab.numbers [--check | --stale].

A comment behind a number, or behind words in italics, says which it is, by file and keys; the
number keeps its decimals:

    A step makes 0.142<!-- energy/plain/level --> of heat. An *AMD EPYC*<!-- r/processor --> did.

`key=value` picks an entry of a list. A table between two comments is made as a whole:

    <!-- table: reads/elements: reads; right; wrong -->
    <!-- end -->

has a row for each entry and a column for each key (of a list of rows, all keys by default);
tables that need more are made by the functions of `tables`, whose names begin with the file. With
--check nothing is written: it fails if a page's number is not that of its file, if what a memory
does has changed since, if a picture is not the one that was made, or if code was not committed.
With --code it also fails if the code of a study has changed (`make figures-check`). --stale lists
what is to be made again, by which command and in what time, also what --accept took for that of
today's code.
"""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from . import tables
from .results import BY, FOLDER, PICTURES, ROOT, SHOWN, accept, load, load_kept, outdated

ACCEPT = 'python3 -m mlmem_lab.numbers --accept'

PLACED = re.compile(
    r'(-?(?:\d{1,3}(?: \d{3})+|\d+(?:\.\d+)?(?:e[-+]?\d+)?)|\*[^*\n]+\*)<!-- ([^>]+?) -->'
)
"""A number, or words in italics, and the comment behind it."""

TABLE = re.compile(r'<!-- table: ([^>]+?) -->\n.*?<!-- end -->', re.DOTALL)
"""A table and the comments around it."""


def pages() -> list[Path]:
    """Return the README and all pages."""
    return [ROOT / 'README.md', *sorted((ROOT / 'docs').rglob('*.md'))]


def placed(text: str, folder: Path) -> str:
    """Return a page with the numbers and tables of the results.

    Raises:
        ValueError: A comment names no number.
    """
    text = PLACED.sub(lambda found: _number(found[1], found[2], folder) + _comment(found), text)
    return TABLE.sub(lambda found: _table(found[1], folder), text)


def _comment(found: re.Match[str]) -> str:
    return f'<!-- {found[2]} -->'


def _number(printed: str, path: str, folder: Path) -> str:
    """Return a number, or words, written like those that are there."""
    value = _value(path, folder)
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


def _value(path: str, folder: Path) -> Any:
    """Return what a path names: file, then keys."""
    name, *keys = path.split('/')
    try:
        value: Any = load(folder / f'{name}.json')
        for key in keys:
            value = value[key] if isinstance(value, dict) else _entry(value, key)
    except (OSError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f'{path} is in no result file: {error!r}') from None
    return value


def _entry(values: Sequence[Any], key: str) -> Any:
    """Return an entry of a list by its place, or by `key=value`, several with a comma between."""
    if '=' not in key:
        return values[int(key)]
    wanted = [pair.split('=') for pair in key.split(',')]
    [found] = [one for one in values if all(str(one[name]) == value for name, value in wanted)]
    return found


def _table(marker: str, folder: Path) -> str:
    """Return a table between its comments."""
    path, _, columns = (part.strip() for part in marker.partition(':'))
    if (makes := getattr(tables, path.replace(' ', '_'), None)) is not None:
        rows = [list(row) for row in makes(_value(path.split()[0], folder))]
    else:
        entries, names = _value(path, folder), [name.strip() for name in columns.split(';')]
        if isinstance(entries, list):
            names = (
                names if columns else list(dict.fromkeys(key for row in entries for key in row))
            )
            rows = [names, *([_cell(row.get(name)) for name in names] for row in entries)]
        else:
            rows = [['', *names]]
            rows += [[key, *(_cell(row[name]) for name in names)] for key, row in entries.items()]
    head, *body = ('| ' + ' | '.join(row) + ' |' for row in rows)
    lines = [head, '|' + '---|' * len(rows[0]), *body]
    return '\n'.join([f'<!-- table: {marker} -->', '', *lines, '', '<!-- end -->'])


def _cell(value: Any) -> str:
    if isinstance(value, float):
        return f'{value:.3g}'
    return f'{value:,}'.replace(',', ' ') if isinstance(value, int) else str(value or '')


class Made(NamedTuple):
    """A result file, or a picture of a page, and what it says of itself."""

    path: Path
    name: str | None
    says: Mapping[str, Any]

    @property
    def told(self) -> str:
        """Which it is."""
        return self.name or str(self.path.relative_to(ROOT))


def everything() -> Iterator[Made]:
    """Yield all results, and all pictures of the pages."""
    for file in sorted(FOLDER.glob('*.json')):
        if file.name != PICTURES:
            yield Made(file, None, load(file))
    told = load_kept(FOLDER / PICTURES)
    there = {
        path.relative_to(ROOT).as_posix()
        for folder in SHOWN
        for path in (ROOT / folder).glob('*.*')
    }
    for name in sorted(there | set(told)):
        yield Made(FOLDER / PICTURES, name, told.get(name, {}))


def reasons(made: Made, code: bool = True) -> Iterator[str]:
    """Yield why something is to be made again; without `code`, not that its code has changed."""
    if not made.says:
        yield 'no command is known that makes it'
    old: dict[str, list[str]] = {}
    for name in outdated(made.says):
        entry, _, maker = name.rpartition(BY)
        if entry and not code:
            continue
        if entry:
            why = f'older than the code: {maker} or what that reaches has changed'
        elif '/' in name:
            why = 'with another file than the one that was made, or drawn from'
        else:
            why = 'older than the code: what a memory does has changed'
        old.setdefault(why, []).append(entry or name)
    for why, entries in old.items():
        yield f'it is {why} ({", ".join(entries)})'
    if changed := made.says.get('uncommitted'):
        yield f'it was made with code that was not committed ({", ".join(changed)})'


def stale() -> None:
    """Print what is to be made again."""
    for made in everything():
        accepted = (f'not made again, {why}' for why in made.says.get('accepted', ()))
        if why := [*reasons(made), *accepted]:
            seconds = made.says.get('seconds')
            took = f'{seconds} s' if seconds else 'not timed'
            print(f'{made.told}: {"; ".join(why)}\n    {made.says.get("command")} ({took})')


def check(write: bool, code: bool) -> bool:
    """Compare the pages, the results and the pictures; return whether all is well.

    Args:
        write: Place the numbers of pages that differ.
        code: Compare the code that made them, too.
    """
    well = True
    for page in pages():
        text = page.read_text(encoding='utf-8')
        try:
            made = placed(text, FOLDER)
        except ValueError as error:
            print(f'{page.relative_to(ROOT)}: {error}')
            well = False
            continue
        if made != text and write:
            page.write_text(made, encoding='utf-8')
        for old, new in zip(text.splitlines(), made.splitlines(), strict=False):
            if old != new:
                print(f'{page.relative_to(ROOT)}: {old}\n{"now" if write else "must be"}: {new}')
                well = well and write
                break
    for each in everything():
        for why in reasons(each, code):
            print(f'{each.told}: {why}; make it again by "{each.says.get("command")}"')
            print(f'{ACCEPT} {each.told} WHY takes it as it is, until then')
            well = False
    return well


def main(arguments: list[str]) -> int:
    """Place the numbers, or check them; return 0, or 1 if something is wrong."""
    parser = argparse.ArgumentParser('python3 -m mlmem_lab.numbers', description=__doc__)
    parser.formatter_class = argparse.RawDescriptionHelpFormatter
    parser.add_argument('--check', action='store_true', help='write nothing, and compare')
    parser.add_argument('--code', action='store_true', help='compare their code, too: a release')
    parser.add_argument('--stale', action='store_true', help='list what is to be made again')
    parser.add_argument('--accept', nargs=2, metavar=('FILE', 'WHY'), help='take it as it is')
    asked = parser.parse_args(arguments)
    if asked.stale:
        stale()
        return 0
    if asked.accept:
        file, why = asked.accept
        meant = [made for made in everything() if file == made.told]
        if not meant:
            parser.error(f'there is no result or picture {file!r}; --stale lists the old')
        for made in meant:
            print(*accept(made.path, why, made.name), sep='\n')
        return 0
    return int(not check(write=not asked.check and not asked.code, code=asked.code))


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
