# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Shortening a failing run: steps are left out while it still fails."""

from dataclasses import replace


def shrink(script, fails, max_runs=400):
    """Return a script of few steps that still fails.

    Args:
        script: A script that fails.
        fails: Returns whether a script fails.
        max_runs: Most runs for it.
    """
    runs = 0
    steps = script.steps
    size = max(1, len(steps) // 2)
    while runs < max_runs:
        shorter = None
        for begin in range(0, len(steps), size):
            rest = steps[:begin] + steps[begin + size :]
            runs += 1
            if fails(replace(script, steps=rest)):
                shorter = rest
                break
        if shorter is not None:
            steps = shorter
            size = max(1, min(size, len(steps) // 2))
        elif size > 1:
            size //= 2
        else:
            break
    return replace(script, steps=steps)
