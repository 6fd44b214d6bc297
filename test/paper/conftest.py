# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The data of figures, computed once per session: small, and at full size for slow tests."""

import pytest

from mlmem_ros.paper.figure import Quality
from mlmem_ros.paper.gallery import BY_NAME


class Computed(dict):
    """The data of figures by name, computed when first asked for."""

    def __init__(self, quality):
        super().__init__()
        self.quality = quality

    def __missing__(self, name):
        self[name] = BY_NAME[name].compute(self.quality)
        return self[name]


@pytest.fixture(scope='session')
def small():
    return Computed(Quality.DRAFT)


@pytest.fixture(scope='session')
def full():
    return Computed(Quality.FULL)
