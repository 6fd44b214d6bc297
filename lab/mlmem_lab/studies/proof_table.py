# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The proof of a design as a line of a table."""

from __future__ import annotations

from mlmem_ros.checks.schedule import cycle_time
from mlmem_ros.checks.subject import Subject
from mlmem_ros.device import Settings
from mlmem_ros.device.end import End
from mlmem_ros.physics import Design

from ..designer.pulses import dynamic_range
from .proof import Tally


def cells(name: str, design: Design, settings: Settings, tally: Tally) -> dict[str, str]:
    """Return what the table says of a design, by heading."""
    write, subject = settings.write, Subject(design, settings)
    end = End.RIGHT if settings.read.end == End.RIGHT else End.LEFT
    probe = end.probe(settings)
    times = write.ramp, write.hold, write.ease, write.release, write.settle
    step = cycle_time(subject, write)
    unit = settings.scale.time
    return {
        'preset': name,
        'levels': f'{design.levels}',
        'N': f'{design.N}',
        'J': f'{design.J}',
        'gamma': f'{design.gamma:.3g}',
        'beta': f'{design.beta:.3g}',
        '1/eta': f'{1.0 / design.eta:.0f}' if design.eta else 'none',
        'ramp, hold, ease, release, settle': ', '.join(f'{time:.0f}' for time in times),
        'peaks': f'{write.compression:.4g}, {write.tension:+.4g}',
        'read from, carrier, sigma': f'{settings.read.end}, {probe.omega_c:g}, {probe.sigma:g}',
        'echo range, dB': f'{dynamic_range(subject):.0f}',
        'written and read back': '{} of {}'.format(*tally.upward),
        'written downward': '{} of {}'.format(*tally.down),
        'erased': '{} of {}'.format(*tally.erase),
        'read in a row': '{} of {}'.format(*tally.read),
        'least level margin': f'{tally.level_margin:.2f}',
        'time per level': f'{step:.0f}',
        'in s': f'{step * unit:.2g}',
        'longest erase, s': f'{tally.erase_time * unit:.3g}',
    }
