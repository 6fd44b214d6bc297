# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: what more capacity costs in tolerance, and how words that are kicked in fail."""

from __future__ import annotations

from typing import Any

from ...results import RESULT_FOLDER, load_result
from ...studies import style
from ...studies.tolerance.element import ASTRAY_NAMES
from ..figure import Data, Figure, Quality

FIGURE = Figure(
    'tolerated', 'What more capacity costs in tolerance', seconds=1,
    modules=('lab/results/tolerance.json',),
)  # fmt: skip

BITS_BY_DESIGN = {
    ('case_2', 'step'): 3, ('case_2', 'kick'): 3, ('byte', 'word'): 8, ('register_4', 'word'): 11,
}  # fmt: skip
"""Designs, and how they are written, with what they hold."""

SCATTER_KINDS = ('alpha', 'k_r', 'offset')

SHOWN_PRESET = 'byte'


@FIGURE.data
def compute_data(quality: Quality) -> Data:
    """Take the counts of `mlmem tolerance`.

    Returns:
        `name` and `bits`; `amount` at which one write in a thousand fails, with its interval,
        shape (designs, kinds, 3); `alpha` and `tried`, and how many failed
        `how` (amount x `ASTRAY_NAMES`).
    """
    designs = load_result(RESULT_FOLDER / 'tolerance.json')['designs']
    counted = [each for each in BITS_BY_DESIGN if each[0] in designs]
    amounts = [
        [designs[name][kind][move]['amount'] for kind in SCATTER_KINDS] for name, move in counted
    ]
    rows = designs[SHOWN_PRESET]['alpha']['word']['how']
    return {
        'name': [' by '.join(each) for each in counted],
        'bits': [BITS_BY_DESIGN[each] for each in counted],
        'amount': amounts,
        'alpha': [row['amount'] for row in rows],
        'tried': [row['tried'] for row in rows],
        'how': [[row[name] for name in ASTRAY_NAMES.values()] for row in rows],
    }


@FIGURE.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw tolerance over bits, and shares of words over scatter of alpha."""
    figure = style.new_figure(3.6)
    cost, ways = style.axes_grid(figure, 1, 2)[0]
    for number, (kind, color) in enumerate(
        zip(
            SCATTER_KINDS,
            (style.ACTIVE_COLOUR, style.INK_COLOUR, style.INACTIVE_COLOUR),
            strict=True,
        )
    ):
        middle, low, high = data['amount'][:, number].T
        bits = data['bits'] + 0.15 * (number - 1)
        cost.errorbar(bits, middle, (middle - low, high - middle), fmt='none', color=color)
        cost.plot(bits[1:], middle[1:], 'o-', color=color, label=kind)
        cost.plot(bits[0], middle[0], 's', color=color)
    for name, bits, (amount, *_) in zip(data['name'], data['bits'], data['amount'], strict=True):
        style.annotate_place(cost, name, (bits, amount[0]), (6, 3))
    cost.set(
        yscale='log', xlabel='bits', ylabel='scatter at which 1 write in 1000 fails', xlim=(2, 14)
    )
    cost.legend(loc='lower right')
    style.label_panel(cost, 'a', 'squares: written by strain; dots: by kicks')
    colors = (style.FAINT_COLOUR, style.ACTIVE_COLOUR, style.INACTIVE_COLOUR, style.INK_COLOUR)
    for share, name, color in zip(
        data['how'].T / data['tried'], ASTRAY_NAMES.values(), colors, strict=True
    ):
        seen = share > 0.0
        ways.loglog(data['alpha'][seen], share[seen], 'o-', ms=4, color=color, label=name)
    ways.set(
        xlabel='scatter of alpha',
        ylabel=f'share of the words of `{SHOWN_PRESET}`'.replace('`', ''),
    )
    ways.legend(loc='upper left')
    ways.xaxis.set_minor_formatter('')
    style.label_panel(ways, 'b', 'how words fail')
    return figure
