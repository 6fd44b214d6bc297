# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A failing script is cut down to the steps that make it fail."""

from dataclasses import replace

from .script import Step, script
from .shrink import shrunk


def test_only_the_steps_that_matter_stay():
    steps = tuple(Step(0.0, 'pause', number) for number in range(40))

    def fails(given):
        left = [step.given for step in given.steps]
        return 7 in left and 31 in left

    short = shrunk(replace(script(1), steps=steps), fails)
    assert [step.given for step in short.steps] == [7, 31]
