# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The data of figures, computed once per run: small, and at full size for slow tests."""

from functools import partial

import pytest
from computed import once

from mlmem_lab.paper.figure import Quality
from mlmem_lab.paper.figures import printed
from mlmem_lab.paper.gallery import FIGURES_BY_NAME


class Computed(dict):
    """The data of figures by name, computed when first asked for."""

    def __init__(self, quality, factory):
        super().__init__()
        self.quality, self.factory = quality, factory

    def __missing__(self, name):
        compute = partial(FIGURES_BY_NAME[name].compute, self.quality)
        with pytest.MonkeyPatch.context() as patch:
            if name == 'printed':  # which is made of the data of others
                for other in ('2a', '2b', 'launches'):
                    module = getattr(printed, f'fig_{other}', printed.launches)
                    patch.setattr(module, 'compute_data', lambda _, data=self[other]: data)
            self[name] = once(self.factory, f'figure-{name}-{self.quality.value}', compute)
        return self[name]


@pytest.fixture(scope='session')
def small(tmp_path_factory):
    return Computed(Quality.DRAFT, tmp_path_factory)


@pytest.fixture(scope='session')
def full(tmp_path_factory):
    return Computed(Quality.FULL, tmp_path_factory)
