# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The environment of the laboratory's tests, also where they run alone, and quick pictures."""

import os

import pytest

# Before numpy is loaded: our matrices are small, and BLAS threads wait for each other.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')


@pytest.fixture
def sketched(monkeypatch):
    """Draw what is saved as PNG and SVG once and coarsely; `style.save_figure` draws it four times
    (`test_figures.py` has that).
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    from mlmem_lab.paper import figure as figures
    from mlmem_lab.studies import style

    def save(figure, stem):
        png, svg = (stem.with_suffix(ending) for ending in ('.png', '.svg'))
        figure.set_dpi(60)
        figure.set_layout_engine('none')
        FigureCanvasAgg(figure).print_png(png)
        svg.write_text('<svg/>')
        return [png, svg]

    for module in (style, figures):
        monkeypatch.setattr(module, 'save_figure', save)
