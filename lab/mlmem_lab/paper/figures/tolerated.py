# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: what more capacity costs in tolerance, and how words that are kicked in fail."""

from __future__ import annotations

from typing import Any

from ...results import FOLDER, load
from ...studies import style
from ...studies.tolerance.element import ASTRAY
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'tolerated', 'What more capacity costs in tolerance', seconds=1,
    modules=('lab/results/tolerance.json',),
)  # fmt: skip

BITS = {
    ('case_2', 'step'): 3, ('case_2', 'kick'): 3, ('byte', 'word'): 8, ('register_4', 'word'): 11,
}  # fmt: skip
"""Designs, and how they are written, with what they hold."""

KINDS = ('alpha', 'k_r', 'offset')

SHOWN = 'byte'


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Take the counts of `mlmem tolerance`.

    Returns:
        `name` and `bits`; `amount` at which one write in a thousand fails, with its interval,
        shape (designs, kinds, 3); `alpha` and `tried`, and how many failed
        `how` (amount x `ASTRAY`).
    """
    designs = load(FOLDER / 'tolerance.json')['designs']
    counted = [each for each in BITS if each[0] in designs]
    amounts = [[designs[name][kind][move]['amount'] for kind in KINDS] for name, move in counted]
    rows = designs[SHOWN]['alpha']['word']['how']
    return {
        'name': [' by '.join(each) for each in counted],
        'bits': [BITS[each] for each in counted],
        'amount': amounts,
        'alpha': [row['amount'] for row in rows],
        'tried': [row['tried'] for row in rows],
        'how': [[row[name] for name in ASTRAY.values()] for row in rows],
    }


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw tolerance over bits, and shares of words over scatter of alpha."""
    figure = style.new_figure(3.6)
    cost, ways = style.axes_grid(figure, 1, 2)[0]
    for number, (kind, color) in enumerate(
        zip(KINDS, (style.S2, style.INK, style.S1), strict=True)
    ):
        middle, low, high = data['amount'][:, number].T
        bits = data['bits'] + 0.15 * (number - 1)
        cost.errorbar(bits, middle, (middle - low, high - middle), fmt='none', color=color)
        cost.plot(bits[1:], middle[1:], 'o-', color=color, label=kind)
        cost.plot(bits[0], middle[0], 's', color=color)
    for name, bits, (amount, *_) in zip(data['name'], data['bits'], data['amount'], strict=True):
        style.note(cost, name, (bits, amount[0]), (6, 3))
    cost.set(
        yscale='log', xlabel='bits', ylabel='scatter at which 1 write in 1000 fails', xlim=(2, 14)
    )
    cost.legend(loc='lower right')
    style.label(cost, 'a', 'squares: written by strain; dots: by kicks')
    colors = (style.FAINT, style.S2, style.S1, style.INK)
    for share, name, color in zip(
        data['how'].T / data['tried'], ASTRAY.values(), colors, strict=True
    ):
        seen = share > 0.0
        ways.loglog(data['alpha'][seen], share[seen], 'o-', ms=4, color=color, label=name)
    ways.set(xlabel='scatter of alpha', ylabel=f'share of the words of `{SHOWN}`'.replace('`', ''))
    ways.legend(loc='upper left')
    ways.xaxis.set_minor_formatter('')
    style.label(ways, 'b', 'how words fail')
    return figure
