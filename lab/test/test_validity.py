# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the model leaves out, tried: an element that rubs is found to fail, an ideal one is not."""

import pytest

from mlmem_lab.validity import try_amount


@pytest.mark.parametrize('way', ['relative damping', 'friction', 'end mass', 'softer'])
def test_next_to_nothing_passes_any_trial(way):
    """Damping of v - V is all or nothing, and slow writes do not feel it."""
    amount = 1.0 if way in ('relative damping', 'end mass') else 1e-9
    assert try_amount('bits_1', way, amount).passed


def test_friction_above_the_limit_fails_its_trial():
    """The wall stops short, and no write is called a success that is none."""
    trial = try_amount('bits_1', 'friction', 3e-5)
    assert not trial.passed
    assert trial.read <= trial.reached
