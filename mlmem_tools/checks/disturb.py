# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Read disturb: the loudest pulse that moves nothing, over that of a read.

A louder one pulls the wall to the left, or starts one at a blank end.
Found by simulation from rest on the bare chain, for the waveform of either end's own pulse. The
nearer the wall, the less it takes, so here it is at the two levels nearest to the end: one of
either kind of site.
"""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator
from functools import lru_cache

from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End, Pulse
from mlmem.physics import Chain, Design, Specimen, StateError, as_specimen
from mlmem.physics.equilibrium import find_pinned_wall, make_blank
from mlmem.physics.values import Array
from mlmem.procedure_table import BLANK
from mlmem.settings import ProbeSettings, TimeSettings

from ..identification.kick_search import drive_end
from .concern import Finding, Subject, grade_finding, judge_value


def check(subject: Subject) -> Iterator[Finding]:
    """Yield the finding on what a read by echoes does to the wall."""
    settings = subject.settings
    made, probes = (
        subject.element or subject.design,
        {end: end.select_probe(settings) for end in End},
    )
    loudest = {
        end: find_safe_limit(made, settings.time, end, probe) for end, probe in probes.items()
    }
    ratios = {end: loudest[end] / probe.A for end, probe in probes.items()}
    worst = min(ratios, key=lambda end: ratios[end])
    yield grade_finding(
        'read_disturb',
        {end.value: amplitude for end, amplitude in loudest.items()},
        'cells',
        judge_value(ratios[worst], 1.0, 2.0),
        f'a pulse moves nothing up to {ratios[worst]:.3g} times the amplitude of a read',
        f'a pulse may move the wall beyond {ratios[worst]:.3g} times the amplitude of a read, '
        f'from the {worst} end: choose a smaller A there, and a smaller v_th with it',
    )


def build_bare_chain(made: Specimen, time: TimeSettings) -> Chain:
    """Return the chain of an element as the device steps it: how a loud pulse fades depends on
    that. Its substrate is rigid, as a soft one takes a hundred times as long.
    """
    design = dataclasses.replace(made.design, substrate='rigid')
    return Simulation.build_blank(dataclasses.replace(made, design=design), time).chain


@lru_cache(maxsize=32)  # whatever else is set
def find_safe_limit(
    made: Design | Specimen, time: TimeSettings, end: End, probe: ProbeSettings
) -> float:
    """Return the largest amplitude up to which pulses of an end leave the wall of both levels
    nearest to it where it is, and from the right a blank element blank.

    If the probe's own amplitude moves something, fainter ones are tried; 0 if a level pins no
    wall.
    """
    chain = build_bare_chain(as_specimen(made), time)
    levels = range(chain.design.levels)
    least = 0.5  # cells; no read may be set to more
    factors = [1.25**k for k in range(24)]  # on the amplitude of the pulse: up to 170
    for level in levels[:2] if end is End.LEFT else (*levels[:-3:-1], BLANK):
        try:
            rest = (
                make_blank(chain.specimen)
                if level == BLANK
                else find_pinned_wall(chain.specimen, level)
            )
        except StateError:  # the level pins no wall
            return 0.0

        def leaves_wall(amplitude: float, level: int = level, rest: Array = rest) -> bool:
            chain.place(rest)
            return find_level_after(chain, end, dataclasses.replace(probe, A=amplitude)) == level

        louder = (factor * probe.A for factor in factors)
        most = max(least, probe.A)
        found = [*itertools.takewhile(leaves_wall, (A for A in louder if most >= A))]
        fainter = (probe.A / factor for factor in factors)
        least = min(least, found[-1] if found else next(filter(leaves_wall, fainter), 0.0))
    return least


def find_level_after(chain: Chain, end: End, probe: ProbeSettings) -> int:
    """Return where a pulse leaves the wall of a chain, or none; as `drive_end`."""
    made, site = chain.specimen, end.site(chain.design)
    near = 1.0 if made.is_ideal else 0.5 * made.design.J
    settling_time = 2500.0  # ten damping times: the wall no longer swings about its defect
    return drive_end(chain, Pulse(chain.end(site), probe), settling_time, site, near)
