# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Draw the packages and their imports: docs/images/architecture.svg. Run: tools/architecture.py.

A package stands above all that it imports. An import is an arrow unless others imply it.
"""

import ast
import textwrap
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path
from xml.sax.saxutils import escape

from mlmem_lab.results import keep_picture

ROOT = Path(__file__).resolve().parent.parent
FILE = ROOT / 'docs' / 'images' / 'architecture.svg'
SOURCES = {'': ROOT / 'mlmem_ros', 'tools.': ROOT / 'mlmem_tools'}
"""Our two packages; what the second is made of is named with the word in front."""

WIDTH, GAP, BETWEEN, EDGE = 196, 20, 38, 16
LINE, LETTER, PADDING = 15, 7.0, 10  # a note of 11 px in the widest of common fonts

HEAD = """\
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" font-family="sans-serif">
<title>The packages of mlmem_ros and mlmem_tools; an arrow points to what is imported</title>
<defs>
<marker id="tip" viewBox="0 0 8 8" refX="7" refY="4" markerWidth="7" markerHeight="7"
 orient="auto"><path d="M0 0 L8 4 L0 8 z" fill="#1f67ad"/></marker>
<style>
.box {{ fill: #fff; stroke: #667; }}
.name {{ font-size: 14px; font-weight: bold; }}
.note {{ font-size: 11px; fill: #445; }}
.import {{ fill: none; stroke: #1f67ad; stroke-width: 1.5; marker-end: url(#tip); }}
</style>
</defs>
<rect width="{width}" height="{height}" fill="#fafafa"/>"""

Graph = dict[str, set[str]]


def imported(path: Path) -> set[str]:
    """Return what a file imports of both packages, by the names in the graph."""
    here = path.relative_to(ROOT).parts[:-1]
    found: set[tuple[str, ...]] = set()
    for node in ast.walk(ast.parse(path.read_text(encoding='utf-8'))):
        if isinstance(node, ast.Import):
            found |= {tuple(alias.name.split('.')) for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            above = here[: len(here) - node.level + 1] if node.level else ()
            parts = (*above, *(node.module or '').split('.'))
            found |= {(*filter(None, parts), alias.name) for alias in node.names}
    heads = {source.name: prefix for prefix, source in SOURCES.items()}
    return {heads[parts[0]] + parts[1] for parts in found if parts[0] in heads and parts[1:]}


@cache
def graph() -> tuple[Graph, Graph]:
    """Return what each package, and each file beside them, imports of one another."""
    packages = {
        prefix + path.parent.name: list(path.parent.rglob('*.py'))
        for prefix, source in SOURCES.items()
        for path in source.glob('*/__init__.py')
    }
    files = {
        prefix + path.stem: [path]
        for prefix, source in SOURCES.items()
        for path in source.glob('*.py')
        if path.stem != '__init__'
    } | packages
    every = {
        name: {other for path in paths for other in imported(path)} & set(files) - {name}
        for name, paths in files.items()
    }
    return {k: every[k] for k in packages}, {k: every[k] for k in set(files) - set(packages)}


def reached(imports: Graph) -> Graph:
    """Return what each imports, directly or not; raise `CycleError` if one imports itself."""
    found: Graph = {}
    for name in TopologicalSorter(imports).static_order():
        found[name] = imports[name].union(*(found[other] for other in imports[name]))
    return found


def rows(imports: Graph) -> list[list[str]]:
    """Return the packages by height, each row with what the next one imports in its middle."""
    rank: dict[str, int] = {}
    for name in TopologicalSorter(imports).static_order():
        rank[name] = max((rank[other] + 1 for other in imports[name]), default=0)
    users = {name: [rank[k] for k in imports if name in imports[k]] for name in imports}
    for name in imports:  # what imports nothing is just below those who need it
        if not imports[name]:
            rank[name] = min(users[name]) - 1
    made = []
    for height in range(max(rank.values()) + 1):
        row: list[str] = []
        inward = sorted(
            (name for name in rank if rank[name] == height),
            key=lambda name: (min(users[name], default=0), name),
        )
        for number, name in enumerate(inward):
            row.insert(len(row) if number % 2 else 0, name)
        made.append(row)
    return made


def note(name: str) -> list[str]:
    """Return the first sentence of a package's docstring, in lines that fit."""
    prefix, _, folder = name.rpartition('.')
    file = SOURCES[f'{prefix}.' if prefix else ''] / folder / '__init__.py'
    text = ast.get_docstring(ast.parse(file.read_text('utf-8'))) or ''
    sentence = text.partition('\n')[0].partition('. ')[0].rstrip('.')
    return textwrap.wrap(sentence.replace('`', ''), int((WIDTH - 2 * PADDING) / LETTER))


def picture() -> str:
    """Return the drawing as SVG."""
    packages, _ = graph()
    imports = {name: found & set(packages) for name, found in packages.items()}
    indirect = reached(imports)
    floors = rows(imports)[::-1]
    columns = max(map(len, floors))
    width = 2 * EDGE + columns * WIDTH + (columns - 1) * GAP
    boxes, y = {}, EDGE
    for row in floors:
        height = 24 + LINE * max(len(note(name)) for name in row) + PADDING
        x = (width - len(row) * WIDTH - (len(row) - 1) * GAP) // 2
        for number, name in enumerate(row):
            boxes[name] = (x + number * (WIDTH + GAP), y, height)
        y += height + BETWEEN
    parts = [HEAD.format(width=width, height=y - BETWEEN + EDGE)]
    level = {name: number for number, row in enumerate(floors) for name in row}
    for name in sorted(imports):
        implied = set().union(*(indirect[other] for other in imports[name]))
        x, y, height = boxes[name]
        for other in sorted(imports[name] - implied):
            end, top, _ = boxes[other]
            middle = end + WIDTH // 2
            if level[other] == level[name] + 1 or x <= middle <= x + WIDTH:
                way = f'M{x + WIDTH // 2} {y + height} L{middle} {top}'
            else:  # beside the floors between
                way = f'M{x if middle < x else x + WIDTH} {y + height // 2} H{middle} V{top}'
            parts.append(f'<path class="import" d="{way}"/>')
    for name, (x, y, height) in sorted(boxes.items()):
        at = f'x="{x + PADDING}" y'
        parts += [
            f'<rect class="box" x="{x}" y="{y}" width="{WIDTH}" height="{height}" rx="6"/>',
            f'<text class="name" {at}="{y + 20}">{name}</text>',
            *(
                f'<text class="note" {at}="{y + 38 + LINE * k}">{escape(line)}</text>'
                for k, line in enumerate(note(name))
            ),
        ]
    return '\n'.join([*parts, '</svg>']) + '\n'


if __name__ == '__main__':
    FILE.write_text(picture(), encoding='utf-8')
    keep_picture(FILE, 'tools/architecture.py', ['tools/architecture.py'])
