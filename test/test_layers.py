# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Imports run one way, from the bottom of this list to its top: docs/reference/architecture.md."""

import re
import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

ROOT = Path(__file__).parent.parent
TOOL = SimpleNamespace(**runpy.run_path(str(ROOT / 'tools' / 'architecture.py')))

LAYERS = (
    'physics', 'device', 'rig', 'bag', 'contract', 'session', 'host', 'ros', 'testing',
    'tools.twin', 'tools.checks', 'tools.rig', 'tools.bank', 'tools.law', 'tools.view',
    'tools.cli',
)  # fmt: skip
"""A package imports from itself and from those before it, through the files beside them, too."""


def test_imports_run_one_way():
    packages, files = TOOL.graph()
    assert set(packages) == set(LAYERS)
    found = TOOL.reached({**packages, **files})
    upward = {
        name: above
        for number, name in enumerate(LAYERS)
        if (above := found[name].intersection(LAYERS[number + 1 :]))
    }
    assert upward == {}


def test_an_import_of_itself_is_found():
    with pytest.raises(ValueError, match='cycle'):
        TOOL.reached({'device': {'twin_file'}, 'twin_file': {'twin'}, 'twin': {'device'}})


def test_the_picture_is_drawn_from_the_imports():
    drawn = TOOL.FILE.read_text(encoding='utf-8')
    assert drawn == TOOL.picture(), 'run .venv/bin/python tools/architecture.py'


def test_the_words_of_the_picture_fit_into_their_boxes():
    """In DejaVu Sans, the widest font that a browser falls back to."""
    matplotlib = pytest.importorskip('matplotlib')
    fonts = pytest.importorskip('PIL.ImageFont')
    folder = Path(matplotlib.get_data_path()) / 'fonts' / 'ttf'
    kinds = {'name': ('DejaVuSans-Bold.ttf', 14), 'note': ('DejaVuSans.ttf', 11)}
    font = {kind: fonts.truetype(folder / file, size) for kind, (file, size) in kinds.items()}
    words = re.findall(r'<text class="(name|note)"[^>]*>([^<]*)<', TOOL.picture())
    assert len(words) > 3 * len(LAYERS)
    room = TOOL.WIDTH - 2 * TOOL.PADDING
    assert [line for kind, line in words if font[kind].getlength(line) > room] == []
