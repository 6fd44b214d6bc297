# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Settings of Sphinx for this site; `make docs` builds it."""

import dataclasses
import os
import sys
from pathlib import Path

from docutils.nodes import SkipNode
from docutils.utils.math.latex2mathml import tex2mathml

from mlmem.schema import find_descriptions
from mlmem_ros import __version__

sys.path.append(str(Path(__file__).parents[1] / 'scripts'))

import notebooks
import try_page

project = 'mlmem_ros'
author = copyright = 'The mlmem_ros authors'
version = release = __version__

extensions = [
    'myst_parser',
    'sphinx.ext.autodoc',
    'sphinx.ext.napoleon',
    'sphinx.ext.viewcode',
]
source_suffix = {'.md': 'markdown', '.rst': 'restructuredtext'}
root_doc = 'index'
exclude_patterns = ['_build', 'paper']  # what JOSS prints; it looks for paper.md in every folder

html_theme = 'furo'
html_theme_options = {  # pages can be edited there with REPOSITORY=https://github.com/OWNER/NAME
    'source_repository': os.environ.get('REPOSITORY', ''),
    'source_branch': 'main',
    'source_directory': 'docs/',
}
html_title = f'mlmem_ros {__version__}'
html_favicon = '../mlmem_tools/view/static/icon.svg'
html_static_path = ['_static']
html_css_files = ['site.css']
html_js_files = [('site.js', {'defer': 'defer'})]

myst_heading_anchors = 4
myst_enable_extensions = ['deflist', 'html_image']
myst_fence_as_directive = ['math']  # so they are typeset on GitHub, too
html_math_renderer = 'mathml'

default_role = 'code'
smartquotes = False  # or `--option` in a text becomes a dash
autodoc_member_order = 'bysource'
autodoc_typehints = 'description'
autodoc_typehints_format = 'short'
autodoc_class_signature = 'separated'
autodoc_default_options = {'members': True, 'undoc-members': False, 'exclude-members': '__new__'}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True


def setup(app):
    """Describe the fields of classes, and add the element in the tab and the notebooks."""
    app.connect('autodoc-process-docstring', _with_fields)
    app.connect('build-finished', _with_pages_of_its_own)
    app.add_html_math_renderer('mathml', (_inline, None), (_displayed, None))


def _with_fields(app, what, name, obj, options, lines):
    if isinstance(obj, type) and dataclasses.is_dataclass(obj):
        for field, row in find_descriptions(obj):
            unit = f' [{row.unit}]' if row.unit else ''
            lines.append(f':ivar {field.name}: {row.text}{unit}')
        lines.append('')


def _with_pages_of_its_own(app, error):
    if error is None and app.builder.format == 'html':
        try_page.write_pages(Path(app.outdir))
        notebooks.write_notebooks(Path(app.outdir, 'tutorials'))


def _inline(writer, node):
    writer.body.append(tex2mathml(node.astext()))
    raise SkipNode


def _displayed(writer, node):
    """Write MathML, which browsers set by themselves: no script, nothing from the network."""
    writer.body.append(f'<div class="math">{tex2mathml(node.astext(), as_block=True)}</div>')
    raise SkipNode
