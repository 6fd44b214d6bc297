# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A faster write for the paper's element: half the time per level, a quarter of the tension.

See docs/fast_write.md for how it was found, and config/fast.yaml for the same as parameters.
"""

from __future__ import annotations

from .settings import ActuatorSettings, ReadSettings, Settings, TimeSettings, WriteSettings

FAST = Settings(
    actuator=ActuatorSettings(max_rate=1e-3),
    write=WriteSettings(
        ramp=50.0,
        hold=280.0,
        ease=80.0,
        ease_to=0.5,
        release=660.0,
        settle=1130.0,
        final_settle=1000.0,
        compression=-0.022,
        tension=0.0135,
        start_strain=0.03,
    ),
    read=ReadSettings(min_margin=0.5),
    time=TimeSettings(tick=10.0),
)
"""2200 time units per level instead of 4500, and a longer rest at the end of a write."""
