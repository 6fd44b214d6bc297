# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A register of fewer levels than any that ships."""

from dataclasses import replace

from mlmem import as_designed, load_element


def first_levels(n):
    """Return a byte with its first levels alone."""
    design, settings = load_element('byte').design_and_settings
    kick = settings.kick
    speeds, kinks = (' '.join(each.split()[:n]) for each in (kick.speeds, kick.kinks))
    return as_designed(
        replace(design, N=design.J * (n + 1)),
        replace(settings, kick=replace(kick, speeds=speeds, kinks=kinks)),
    )
