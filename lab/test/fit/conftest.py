# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One fit, which takes seconds, for all tests."""

import pytest
from computed import once

from mlmem_tools.identification.fit import fit_element

from .truth import SMALL, hidden, measured


@pytest.fixture(scope='session')
def fitted(tmp_path_factory):
    """A hidden element, its shots, and their fit."""

    def compute():
        element = hidden(1)
        shots = measured(element)
        return element, shots, fit_element(SMALL, shots)

    return once(tmp_path_factory, 'fitted', compute)
