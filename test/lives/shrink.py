# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Making a failing life short: its steps are left out, more and more, while it goes on failing."""

from dataclasses import replace


def shrunk(script, fails, most=400):
    """Return a script of few steps that still fails.

    Args:
        script: One that fails.
        fails: Whether a script does.
        most: Lives that may be lived for it.
    """
    lived = 0
    steps = script.steps
    size = max(1, len(steps) // 2)
    while lived < most:
        shorter = None
        for begin in range(0, len(steps), size):
            rest = steps[:begin] + steps[begin + size :]
            lived += 1
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
