# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The file of an individual element, as a fit writes it and a node uses it."""

import numpy as np
import pytest

from mlmem_ros import element_file
from mlmem_ros.device import preset
from mlmem_ros.physics import Specimen

DESIGN = preset('bits_1').design


def test_an_element_survives_its_file(tmp_path):
    alpha = 1.0 + 0.01 * np.random.default_rng(1).standard_normal(DESIGN.N)
    made = Specimen(DESIGN, alpha, k_r_factor=0.99, mass=1.01, offset=0.002)
    element_file.save(tmp_path / 'e.yaml', element_file.Element(made, 1e-4 * alpha))
    again = element_file.load(tmp_path / 'e.yaml')
    assert again.specimen.design == DESIGN
    for name in ('alpha', 'k_r', 'masses', 'offsets'):
        assert getattr(again.specimen, name) == pytest.approx(getattr(made, name), rel=1e-12)


@pytest.mark.parametrize(
    ('text', 'reason'),
    [('', 'as `mlmem fit` writes'), ('format: 2', 'format must be 1'), ('{', 'e.yaml'),
     ('{format: 1, design: {N: 5}}', 'this is not an element')],
)  # fmt: skip
def test_a_file_that_is_no_element_is_named(tmp_path, text, reason):
    (tmp_path / 'e.yaml').write_text(text, encoding='utf-8')
    with pytest.raises(element_file.ElementFileError, match=reason):
        element_file.load(tmp_path / 'e.yaml')
