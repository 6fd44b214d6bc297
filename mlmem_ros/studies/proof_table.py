# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The proofs of designs, as a table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from ..analysis.checks.schedule import cycle_time
from ..analysis.checks.subject import Subject
from ..analysis.designer.right_pulse import dynamic_range
from ..device import Settings
from ..device.end import read_from
from ..device.settings import WriteSettings
from ..physics import Design
from .proof import Tally

COLUMNS = (
    'preset',
    'levels',
    'N',
    'J',
    'gamma',
    'beta',
    '1/eta',
    'ramp, hold, ease, release, settle',
    'peaks',
    'read from, carrier, sigma',
    'echo range, dB',
    'written and read back',
    'written downward',
    'erased',
    'least level margin',
    'time per level',
    'in s',
    'longest erase, s',
)


def row(name: str, design: Design, settings: Settings, tally: Tally) -> tuple[str, ...]:
    """Return the cells of one design, in the order of `COLUMNS`.

    Args:
        name: What to call it.
        design: The element.
        settings: The instrument's settings.
        tally: The totals of its proof.
    """
    write, subject = settings.write, Subject(design, settings)
    probe = read_from(settings)[0].probe(settings)
    step = cycle_time(subject, write)
    unit = settings.scale.time
    return (
        name,
        str(design.levels),
        str(design.N),
        str(design.J),
        f'{design.gamma:.3g}',
        f'{design.beta:.3g}',
        f'{1.0 / design.eta:.0f}' if design.eta else 'none',
        ', '.join(f'{time:.0f}' for time in _times(write)),
        f'{write.compression:.4g}, {write.tension:+.4g}',
        f'{settings.read.end}, {probe.omega_c:g}, {probe.sigma:g}',
        f'{dynamic_range(subject):.0f}',
        f'{tally.levels} of {tally.of_levels}',
        f'{tally.downs} of {tally.of_downs}',
        f'{tally.erases} of {tally.of_erases}',
        f'{tally.level_margin:.2f}',
        f'{step:.0f}',
        f'{step * unit:.2g}',
        f'{tally.erase_time * unit:.3g}',
    )


def _times(write: WriteSettings) -> tuple[float, ...]:
    return write.ramp, write.hold, write.ease, write.release, write.settle


def markdown(rows: Iterable[Sequence[str]]) -> str:
    """Return the table in Markdown."""
    lines = [COLUMNS, ['---'] * len(COLUMNS), *rows]
    return ''.join('| ' + ' | '.join(cells) + ' |\n' for cells in lines)
