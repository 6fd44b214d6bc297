# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the two chains of the element: docs/images/chains.svg. Run: scripts/schematic.py."""

import itertools
from pathlib import Path

from mlmem_lab.results import keep_picture

FILE = Path(__file__).resolve().parent.parent / 'docs' / 'images' / 'chains.svg'

CELLS, WALL, SOFT = 9, 4, (2, 6)
PITCH, LEFT = 72, 76
TOP, BOTTOM = 70, 160
SHIFT = 14  # of an active mass against the cell of the substrate below it

HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 760 250" role="img"
 aria-label="Two chains of masses and springs, tied cell by cell">
<style>
 text {font: 14px system-ui, sans-serif; fill: #222}
 .spring {fill: none; stroke: #666; stroke-width: 1.5}
 .tie {fill: none; stroke: #222; stroke-width: 2}
 .soft {stroke-dasharray: 3 3}
 .active {fill: #2c6fbb} .inactive {fill: #d9c7a0} .base {fill: #999}
 .wall {stroke: #c0392b; stroke-width: 2; stroke-dasharray: 6 4}
 .paper {fill: #fff}
 @media (prefers-color-scheme: dark) {
  .paper {fill: #1a1c1e}
  text {fill: #ddd} .spring {stroke: #aaa} .tie {stroke: #ddd}
 }
</style>
<rect class="paper" width="760" height="250" rx="6"/>
"""


def spring(x0: float, x1: float, y: float) -> str:
    """Return a zigzag between two masses."""
    turns = [x0 + (x1 - x0) * (0.2 + 0.1 * k) for k in range(7)]
    inner = ' '.join(f'{x:.1f},{y + (5 if k % 2 else -5)}' for k, x in enumerate(turns))
    return f'<polyline class="spring" points="{x0:.1f},{y} {inner} {x1:.1f},{y}"/>'


def picture() -> str:
    """Return the drawing as SVG."""
    place = [LEFT + PITCH * j for j in range(CELLS)]
    upper = [x + (SHIFT if j <= WALL else -SHIFT) for j, x in enumerate(place)]
    parts = [spring(a + 9, b - 9, TOP) for a, b in itertools.pairwise(upper)]
    parts += [spring(a + 9, b - 9, BOTTOM) for a, b in itertools.pairwise(place)]
    for j, (v, V) in enumerate(zip(upper, place, strict=True)):
        soft = ' soft' if j in SOFT else ''
        parts += [
            f'<path class="tie{soft}" d="M{v} {TOP + 9} Q{2 * v - V} 115 {V} {BOTTOM - 9}"/>',
            f'<circle class="{"active" if j <= WALL else "inactive"}" cx="{v}" cy="{TOP}" r="9"/>',
            f'<rect class="base" x="{V - 9}" y="{BOTTOM - 9}" width="18" height="18"/>',
        ]
    wall = (upper[WALL] + upper[WALL + 1]) / 2
    parts += [
        f'<line class="wall" x1="{wall}" y1="34" x2="{wall}" y2="190"/>',
        f'<text x="{wall}" y="26" text-anchor="middle">domain wall</text>',
        f'<text x="{LEFT}" y="44">active phase s2</text>',
        f'<text x="{place[-1] + 9}" y="44" text-anchor="end">inactive phase s1</text>',
        f'<line class="tie" x1="40" y1="{BOTTOM - 22}" x2="40" y2="{BOTTOM + 22}"/>',
        f'<line class="spring" x1="40" y1="{BOTTOM}" x2="{LEFT - 9}" y2="{BOTTOM}"/>',
        f'<text x="{place[-1] + 20}" y="{BOTTOM + 5}">⇄ strain</text>',
        f'<text x="{place[-1] + 12}" y="{TOP + 5}">⇠ pulse</text>',
        f'<text x="8" y="{TOP + 5}">pulse ⇢</text>',
        f'<text x="{place[SOFT[0]]}" y="215" text-anchor="middle">defect: level k</text>',
        f'<text x="{place[SOFT[1]]}" y="215" text-anchor="middle">defect: level k + 1</text>',
        f'<text x="{LEFT - 9}" y="240">above: metamaterial v_j, soft;  below: substrate V_j, '
        'stiff;  between them: bistable springs</text>',
    ]
    return HEAD + '\n'.join(parts) + '\n</svg>\n'


if __name__ == '__main__':
    FILE.write_text(picture(), encoding='utf-8')
    keep_picture(FILE, 'scripts/schematic.py', ['scripts/schematic.py'])
