# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Count how reads of a shaken element end: the table of docs/reference/results.md.

.venv/bin/python lab/tools/shaken_reads.py --reads 1200 --output lab/results/shaken.json
.venv/bin/python lab/tools/shaken_reads.py --reads 400 --preset bits_4 \
    --end right --spectrum white --amplitude 2
"""

import argparse
from pathlib import Path
from typing import Any

import numpy as np

from mlmem_lab.results import save, with_reads
from mlmem_lab.studies.shaken import SPECTRA, Counts, Shaking, count
from mlmem_ros.device import Settings
from mlmem_ros.parameter_file import load
from mlmem_ros.physics import Design

BLOCK = 20
"""Reads in a row of one wall, during one course of the base."""

CASES = [
    *(('left', Shaking('white', g)) for g in (1.0, 1.5, 18.0, 22.0)),
    *(('left', Shaking('sine', g, hz)) for g, hz in (
        (30.0, 16.0), (22.0, 95.0), (11.0, 110.0), (2.5, 125.0), (12.0, 125.0), (12.0, 229.0),
    )),
    *(('left', Shaking('walk', g)) for g in (3.0, 50.0)),
    ('left', Shaking('slams', 40.0)),
    *(('left', Shaking('noise', cells)) for cells in (1.5e-5, 2.1e-5)),
    *(('right', Shaking('white', g)) for g in (1.5, 14.0)),
    *(('right', Shaking('sine', g, hz)) for g, hz in (
        (40.0, 16.0), (28.0, 125.0), (14.0, 190.0), (3.0, 229.0), (4.2, 247.0), (4.0, 250.0),
    )),
    *(('right', Shaking('walk', g)) for g in (3.0, 50.0)),
    ('right', Shaking('slams', 40.0)),
    *(('right', Shaking('noise', cells)) for cells in (1.5e-4, 2e-4)),
    ('both', Shaking('white', 10.0)),
    ('both', Shaking('walk', 20.0)),
]  # fmt: skip


def tried(
    design: Design, settings: Settings, end: str, shaking: Shaking, reads: int, seed: int
) -> Counts:
    """Return the counts of blocks of reads at random levels."""
    random = np.random.default_rng(seed)
    counts = Counts()
    while counts.reads + counts.moved < reads:
        level, chance = int(random.integers(design.levels)), int(random.integers(2**31))
        counts.add(count(design, settings, shaking, end, level, BLOCK, chance))
    return counts


def said(end: str, shaking: Shaking | str, counts: Counts) -> dict[str, Any]:
    """Return a line of the table."""
    reads = counts.reads
    return {
        'end': end,
        'shaking': str(shaking),
        'reads': reads,
        'moved': counts.moved,
        'undecodable': counts.undecodable,
        'wrong': counts.wrong,
        'blocks': counts.blocks,
        'wrong blocks, at most (95 %)': counts.lies.interval[1] if counts.blocks else None,
        'ticks': counts.ticks / reads if reads else None,
    }


def row(line: dict[str, Any]) -> str:
    """Return a line of the table as Markdown."""
    if not line['reads']:
        return f'| {line["end"]} | {line["shaking"]} | 0 | {line["moved"]} | | | |'
    spoiled = 100.0 * (line['undecodable'] + line['wrong']) / line['reads']
    most = line['wrong blocks, at most (95 %)']
    return (
        f'| {line["end"]} | {line["shaking"]} | {line["reads"]} | {line["moved"]} '
        f'| {spoiled:.2g} % | {line["wrong"]} ({most:.1e}) | {line["ticks"]:.0f} |'
    )


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--preset', default='case_2', help='a shipped element')
    parser.add_argument('--reads', type=int, default=100, help='of every case')
    parser.add_argument('--seed', type=int, default=1, help='of all chance')
    parser.add_argument('--end', choices=('left', 'right', 'both'), help='of a single case')
    parser.add_argument('--spectrum', choices=SPECTRA, default='white', help='of a single case')
    parser.add_argument('--amplitude', type=float, default=1.0, help='in g; of noise in cells')
    parser.add_argument('--frequency', type=float, default=125.0, help='of a sine, in Hz')
    parser.add_argument('--output', type=Path, help='result file to write')
    arguments = parser.parse_args()
    design, settings = load(arguments.preset)
    cases = CASES
    if arguments.end:
        one = Shaking(arguments.spectrum, arguments.amplitude, arguments.frequency)
        cases = [(arguments.end, one)]
    everything = Counts()
    print('| end | shaking | reads | wall moved | not right | wrong (bound) | ticks |', flush=True)
    print('|---|---|---|---|---|---|---|')
    lines = []
    for number, (end, shaking) in enumerate(cases):
        seed = arguments.seed + 1000 * number
        counts = tried(design, settings, end, shaking, arguments.reads, seed)
        everything.add(counts)
        lines.append(said(end, shaking, counts))
        print(row(lines[-1]), flush=True)
    lines.append(said('all', 'all of these', everything))
    print(row(lines[-1]))
    print('\n| confidence up to | right |\n|---|---|')
    for confidence, right in everything.calibrated():
        print(f'| {confidence:.1f} | {right:.5f} |')
    if arguments.output is not None:
        made = f'lab/tools/shaken_reads.py --preset {arguments.preset} --reads {arguments.reads}'
        of = with_reads([arguments.preset])
        save(arguments.output, {'cases': lines}, made, arguments.seed, of)


if __name__ == '__main__':
    main()
