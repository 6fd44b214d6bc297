# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Tables of the pages that are more than entries and keys of a result: rows of texts and counts,
headings first.

A function has the name of its table, `tolerance words` with a line for the space. It begins with
the name of the result file.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import groupby, product
from typing import Any

Rows = list[Sequence[str | int]]


def kicks(result: Mapping[str, Any]) -> Rows:
    """Return what was counted of writes without strain, by preset."""
    rows: Rows = [[
        'preset', 'levels', 'writes', 'wrong', 'failed', 'tried again', 'with strain',
        'median', 'nine in ten', 'erase',
    ]]  # fmt: skip
    for name, preset in result['cases'].items():
        told = preset['written']
        keys = ('writes', 'wrong', 'failed', 'again', 'strained', 'median', 'ninth', 'erase')
        rows.append([f'`{name}`', str(len(preset['levels'])), *(f'{told[key]:g}' for key in keys)])
    return rows


def validity(result: Mapping[str, Any]) -> Rows:
    """Return the greatest amount of every way at which all was written and read, by preset."""
    trials = [one for one in _list_trials(result) if 'kick' not in one['preset']]
    labels = {
        'friction': 'dry friction of a cell, k_r cells',
        'relative damping': 'damping of v - V',
        'end mass': 'mass of the end cells',
        'softer': 'all cells softer',
    }
    cells = {}
    for way, name in product(labels, dict.fromkeys(one['preset'] for one in trials)):
        some = [one for one in trials if (one['preset'], one['way']) == (name, way)]
        passed = [one['amount'] for one in some if one['read'] == one['writes']]
        greatest = f'{max(passed):g}' if passed else 'none'
        written = 'writes' if way == 'relative damping' and passed else greatest
        cells[labels[way], f'`{name}`'] = written
    return _arrange_cells('', cells)


def validity_friction(result: Mapping[str, Any]) -> Rows:
    """Return how many writes by kicks came to their level where cells rub, and were verified."""
    some = [one for one in _list_trials(result) if one['way'] == 'friction']
    cells = {
        (f'{one["amount"]:g}', f'`{one["preset"]}`'): (
            f'{one["reached"]}; {one["read"]} of {one["writes"]}'
        )
        for one in sorted(some, key=lambda one: one['amount'])
        if 'kick' in one['preset']
    }
    return _arrange_cells('friction', cells)


def _list_trials(result: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [trial for trials in result['cases'].values() for trial in trials]


def robust_losses(result: Mapping[str, Any]) -> Rows:
    """Return the writes and calibrations of elements with other losses than their design's."""
    names = {'eta': 'damping', 'friction': 'friction'}
    rows: Rows = [['element', 'what differs', 'acknowledged', 'wrong', 'failed calibrations']]
    for found in result['cases'].values():
        what = f'{names[found["loss"]]} {found["factor"]:g} times'
        counts = f'{found["right"]} of {found["writes"]}', str(found['wrong'])
        rows.append([f'`{found["element"]}`', what, *counts, str(found['failed calibrations'])])
    return rows


def robust_writes(result: Mapping[str, Any]) -> Rows:
    """Return failed and wrong writes by element and scatter of all parts."""
    cells = {
        (f'`{name}`', f'{float(scatter):.0%}'): _describe_failures(found, 'failed', 'writes')
        for name, by_scatter in result['cases'].items()
        for scatter, found in by_scatter.items()
    }
    return _arrange_cells('element', cells)


def robust_reads(result: Mapping[str, Any]) -> Rows:
    """Return undecodable and wrong reads by condition and element."""
    cells = {}
    for case, found in result['cases'].items():
        name, condition = case.split(', ', 1)
        cells[condition, f'`{name}`'] = _describe_failures(found, 'undecodable', 'reads')
    return _arrange_cells('', cells)


def _describe_failures(found: Mapping[str, int], failed: str, tried: str) -> str:
    wrong = f', {found["wrong"]} wrong' if found['wrong'] else ''
    return f'{found[failed]} of {found[tried]}{wrong}'


def _arrange_cells(heading: str, cells: Mapping[tuple[str, str], str]) -> Rows:
    """Return texts by row and column as a table, in the order in which both first occur."""
    columns = list(dict.fromkeys(column for _, column in cells))
    rows: Rows = [[heading, *columns]]
    for row in dict.fromkeys(row for row, _ in cells):
        rows.append([row, *(cells.get((row, column), '') for column in columns)])
    return rows


def node_missed(result: Mapping[str, Any]) -> Rows:
    """Return the figures of a node that miss their goal on some processor, in bold."""
    processors = list(dict.fromkeys(name for row in result['rows'] for name in list(row)[2:]))
    rows: Rows = [['figure', 'goal', *processors]]
    for row in result['rows']:
        cells = [_mark_missed(row.get(name, ''), row['goal']) for name in processors]
        if any(cell.startswith('**') for cell in cells):
            rows.append([row['figure'], row['goal'], *cells])
    return rows


def _mark_missed(value: str, goal: str) -> str:
    if not value or not goal:
        return value
    _, bound, limit = goal.split()
    excess = float(value.split()[0]) - float(limit)
    missed = excess > 0.0 if bound == 'most' else excess < 0.0
    return f'**{value}, missed**' if missed else value


def tolerance_steps(result: Mapping[str, Any]) -> Rows:
    """Return the disorder at which one step up, or one kick, in a thousand fails, by kind and
    design.
    """
    return _tolerance_rows(result, 'disorder of', {'step': ', step', 'kick': ', kick'})


def tolerance_words(result: Mapping[str, Any]) -> Rows:
    """Return the same for words that are written by kicks and read."""
    return _tolerance_rows(result, 'scatter of', {'word': ' written', 'hear': ' read'})


def _tolerance_rows(result: Mapping[str, Any], heading: str, labels: Mapping[str, str]) -> Rows:
    """Return a column for every design and what was tried of it, of those in `labels`."""
    cells = {}
    for case, found in result['cases'].items():
        name, kind, tried, _ = case.rsplit(' ', 3)
        if tried in labels:
            cells[kind, f'`{name}`{labels[tried]}'] = found['text'].partition(' (')[0]
    return _arrange_cells(heading, cells)


def words_reads(result: Mapping[str, Any]) -> Rows:
    """Return how many reads tell the word, of how many."""
    return _word_rows(result, 'reads', 'none', ('0.001', '0.003', '0.01'))


def words_writes(result: Mapping[str, Any]) -> Rows:
    """Return how many writes succeed, of how many, and their median time."""
    head, *rows = _word_rows(result, 'writes', 'as designed', ('0.0003', '0.001', '0.003'))
    ticks = (found['writes']['as designed']['median ticks'] for found in result['cases'].values())
    told = (f'{each:.0f}' for each in ticks)
    return [[*head, 'median ticks'], *([*row, each] for row, each in zip(rows, told, strict=True))]


def _word_rows(result: Mapping[str, Any], what: str, healthy: str, sizes: Sequence[str]) -> Rows:
    kinds = [healthy, *(f'alpha scattered by {size}' for size in sizes)]
    rows: Rows = [[f'{what} that succeed', *kinds[:2], *(f'by {size}' for size in sizes[1:])]]
    for name, found in result['cases'].items():
        counts = (found[what][kind] for kind in kinds)
        ended = (
            (each['right'], each['wrong'] + each.get('not written', each.get('undecodable')))
            for each in counts
        )
        rows.append([f'`{name}`', *(f'{right} of {right + other}' for right, other in ended)])
    return rows


def unseen_speeds(result: Mapping[str, Any]) -> Rows:
    """Return what other lattices and the force curves say of each."""
    rows: Rows = [['rail / spacing', 'measured', 'predicted without its data', 'no wave']]
    for name, case in result['cases'].items():
        found = case['unseen']
        measured = ', '.join(f'{speed:.2f}' for speed in case['measured'] or ()) or 'no wave'
        predicted = ''
        if found['median'] is not None:
            predicted = f'{found["median"]:.2f} ({found["low"]:.2f} to {found["high"]:.2f})'
        silent = f'{100.0 * found["silent"]:.0f} %'
        lattice = name.removeprefix('rail').replace('_spacing', '/')
        rows.append([lattice, measured, predicted, silent])
    return rows


def shaken(result: Mapping[str, Any]) -> Rows:
    """Return how reads of a shaken element ended, by end and kind of the shaking."""
    keys = ('reads', 'undecodable', 'wrong', 'moved')
    rows: Rows = [['end', 'shaking', 'reads', 'undecodable', 'wrong', 'wall moved']]
    named = ((name.split(', '), found) for name, found in result['cases'].items())
    for (end, way), group in groupby(named, lambda each: each[0][:2]):
        names, cases = zip(*group, strict=True)
        amounts = map(_join_amounts, zip(*(name[2:] for name in names), strict=True))
        counts = (sum(case[key] for case in cases) for key in keys)
        rows.append([end, ', '.join([way, *amounts]), *counts])
    return [*rows, ['all', 'all of these', *(result['all'][key] for key in keys)]]


def _join_amounts(told: Sequence[str]) -> str:
    """Return amounts with a unit as one: `1 g`, `3 to 50 g`."""
    amounts = sorted({one.split(maxsplit=1)[0] for one in told}, key=float)
    ends = amounts if len(amounts) < 2 else [amounts[0], amounts[-1]]
    return f'{" to ".join(ends)} {told[0].split(maxsplit=1)[1]}'
