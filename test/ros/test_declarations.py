# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every parameter is declared once, with a legal default."""

from mlmem_ros.ros.node.declarations import declarations


def test_every_parameter_has_a_unique_name_and_a_description():
    found = list(declarations())
    names = [name for name, _, _ in found]
    assert len(set(names)) == len(names)
    assert {'target_level', 'design.preset', 'probe_right.v_th', 'faults.seed'} <= set(names)
    assert all(description.text for _, _, description in found)


def test_every_default_is_legal():
    for name, default, description in declarations():
        if description.low is not None:
            assert default >= description.low, name
        if description.high is not None:
            assert default <= description.high, name
        if description.choices:
            assert default in description.choices, name
