# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the tutorials in Python as Jupyter notebooks: scripts/notebooks.py FOLDER."""

import json
import re
import sys
from pathlib import Path

TUTORIAL_FOLDER = Path(__file__).resolve().parent.parent / 'docs' / 'tutorials'
NOTEBOOK_NAMES = ('simulate', 'reservoir')


def convert_page(text: str) -> dict:
    """Return the notebook of a page: its Python blocks are the code, the rest is text."""
    parts = re.split(r'^```python\n(.*?)^```\n', text, flags=re.MULTILINE | re.DOTALL)
    cells = []
    for k, part in enumerate(parts):
        kind = ('markdown', 'code')[k % 2]
        if part.strip():
            cell = {'cell_type': kind, 'metadata': {}, 'source': part.strip(), 'id': f'cell-{k}'}
            cells.append(cell | ({'execution_count': None, 'outputs': []} if k % 2 else {}))
    kernel = {'name': 'python3', 'display_name': 'Python 3', 'language': 'python'}
    return {'nbformat': 4, 'nbformat_minor': 5, 'metadata': {'kernelspec': kernel}, 'cells': cells}


def write_notebooks(folder: Path) -> None:
    """Write the notebooks into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in NOTEBOOK_NAMES:
        page = (TUTORIAL_FOLDER / f'{name}.md').read_text(encoding='utf-8')
        text = json.dumps(convert_page(page), indent=1)
        (folder / f'{name}.ipynb').write_text(text + '\n', encoding='utf-8')


if __name__ == '__main__':
    write_notebooks(Path(sys.argv[1]))
