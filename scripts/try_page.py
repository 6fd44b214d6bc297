# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The page of the site that runs an element in the tab, drawn by the code of `mlmem view`.

scripts/try_page.py [FOLDER]: writes try.html, and session.html with a recorded session. Modules of
a page that is opened from a folder are not loaded by browsers, so scripts, style, and data become
part of it. Uses nothing but Python.
"""

import base64
import re
import sys
from pathlib import Path

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
PAGE_FOLDER = CHECKOUT_ROOT / 'docs' / 'try'
VIEW_FOLDER = CHECKOUT_ROOT / 'mlmem_tools' / 'view' / 'static'

IMPORT_LINE = re.compile(r"^import (\{[^}]*\}) from '\./(\S+)';\n", re.MULTILINE)
EXPORT_LINE = re.compile(r'^export ((?:class|const|async function|function) (\w+))', re.MULTILINE)


def write_pages(folder: Path) -> None:
    """Write the pages."""
    presets = (PAGE_FOLDER / 'presets.json').read_text(encoding='utf-8')
    session = base64.b64encode((PAGE_FOLDER / 'session.gz').read_bytes()).decode()
    live = f'window.mlmem_presets = {presets};'
    (folder / 'try.html').write_text(build_page('live', 'Try an element', live), encoding='utf-8')
    told = build_page('session', 'A recorded session', f"window.mlmem_session = '{session}';")
    (folder / 'session.html').write_text(told, encoding='utf-8')


def build_page(kind: str, title: str, data: str) -> str:
    """Return a page that has all that it needs."""
    viewed = (VIEW_FOLDER / 'index.html').read_text(encoding='utf-8')
    font = base64.b64encode((VIEW_FOLDER / 'vendor' / 'inter.woff2').read_bytes()).decode()
    style = '\n'.join(
        path.read_text(encoding='utf-8')
        for path in (
            VIEW_FOLDER / 'vendor' / 'uPlot.min.css',
            VIEW_FOLDER / 'style.css',
            PAGE_FOLDER / 'try.css',
        )
    )
    icon = base64.b64encode((VIEW_FOLDER / 'icon.svg').read_bytes()).decode()
    parts = {
        'title': title,
        'kind': kind,
        'icon': f'data:image/svg+xml;base64,{icon}',
        'style': style.replace('/static/vendor/inter.woff2', f'data:font/woff2;base64,{font}'),
        'early': (VIEW_FOLDER / 'js' / 'early.js').read_text(encoding='utf-8'),
        'uplot': (VIEW_FOLDER / 'vendor' / 'uPlot.iife.min.js').read_text(encoding='utf-8'),
        'panel': _cut_between(viewed, '<template id="panel">', '</template>'),
        'player': _cut_between(viewed, '<section id="player"', '</section>\n')
        + _cut_between(viewed, '<section id="story"', '</section>\n'),
        'data': data,
        'script': bundle_modules('try.js'),
    }
    told = (PAGE_FOLDER / 'try.html').read_text(encoding='utf-8')
    return re.sub(r'\{\{(\w+)\}\}', lambda found: parts[found[1]], told)


def _cut_between(text: str, begin: str, end: str) -> str:
    start = text.index(begin)
    return text[start : text.index(end, start) + len(end)]


def bundle_modules(entry: str) -> str:
    """Return modules as one script: each a function of its own, in the order of their imports.

    Our modules import names in braces from files beside them, and export classes, constants and
    functions where they are defined.
    """
    order: dict[str, str] = {}

    def add(name: str) -> None:
        if name in order:
            return
        file = PAGE_FOLDER / name if (PAGE_FOLDER / name).exists() else VIEW_FOLDER / 'js' / name
        text = file.read_text(encoding='utf-8')
        for found in IMPORT_LINE.finditer(text):
            add(found[2])
        names = ', '.join(found[2] for found in EXPORT_LINE.finditer(text))
        text = IMPORT_LINE.sub(lambda found: f"const {found[1]} = modules['{found[2]}'];\n", text)
        text = EXPORT_LINE.sub(r'\1', text)
        if re.search(r'^(import|export) ', text, re.MULTILINE):
            raise ValueError(f'{file} must import and export as the others do')
        order[name] = f"modules['{name}'] = (() => {{\n{text}\nreturn {{ {names} }};\n}})();\n"

    add(entry)
    return "'use strict';\nconst modules = {};\n" + ''.join(order.values())


if __name__ == '__main__':
    write_pages(Path(sys.argv[1]) if len(sys.argv) > 1 else CHECKOUT_ROOT / 'docs' / '_build')
