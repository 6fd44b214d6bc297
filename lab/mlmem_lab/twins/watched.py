# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a twin tells: false alarms in healthy reads; how soon and how well it places a change."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from mlmem import Calibrate, EchoReceived, Event, Faults, Read, SetFaults, Write, load_element
from mlmem.errors import ProcedureFailed
from mlmem.physics import Scatter, draw_specimen
from mlmem_tools.identification.watching import Comparison, Residuals, locate_wall
from mlmem_tools.rig.emulated import RigSensors

from .sensed import (
    TRANSDUCER_NOISE_CELLS,
    SensedSimulation,
    build_device,
    fit_specimen,
    load_forecast,
    perform_command,
)

CHANGE_KINDS: dict[str, dict[str, Any]] = {
    'a cell 3 % weaker': {'weak_factor': 0.97},
    'a cell 8 % weaker': {'weak_factor': 0.92},
    'a cell 20 % weaker': {'weak_factor': 0.8},
    'a cell stuck': {'stuck_cell': True},
    'damping + 20 %': {'damping_factor': 1.2},
    'damping + 50 %': {'damping_factor': 1.5},
    'strain + 0.002': {'actuator_offset': 0.002},
    'left gain - 5 %': {'gain': (0.95, 1.0)},
    'right gain - 5 %': {'gain': (1.0, 0.95)},
    'a grip that slips': {'missed_cycle': 1.0},
}
"""Faults by what they are; a cell is drawn."""


class WatchedElement:
    """A calibrated element with its twin."""

    def __init__(self, preset: str, scatter: float, seed: int) -> None:
        """Make the element of a seed, and calibrate it by its forecast.

        Raises:
            ProcedureFailed: It cannot be calibrated, so what it does afterwards tells nothing.
        """
        specimen = draw_specimen(load_element(preset).design, Scatter(alpha=scatter), seed)
        self.element, known = build_device(preset, specimen), fit_specimen(specimen, seed)
        load_forecast(preset, self.element, known)
        calibrated, _ = perform_command(self.element, Calibrate())
        if not calibrated.success:
            raise ProcedureFailed(f'seed {seed}: {calibrated.error}')
        self.watch = Residuals(known, simulated=True)
        self.wall: float | None = 0.0

    def compare_last_read(self, command: Read | Write) -> Comparison | None:
        """Perform a command and compare its last read, as a node does."""
        return self._compare_events(
            perform_command(self.element, command)[1], isinstance(command, Write)
        )

    def read_at_rest(self) -> Comparison | None:
        """Let the element rest, read it, and compare the read."""
        element = self.element
        # ten damping times: only if the element was at rest is a read compared
        element.pass_ticks(math.ceil(10.0 / element.design.eta / element.tick))
        return self.compare_last_read(Read())

    def _compare_events(self, events: list[Event], moved: bool) -> Comparison | None:
        heard = [event for event in events if isinstance(event, EchoReceived)]
        if not heard:
            return None
        heard = [each for each in heard if each.reading is heard[-1].reading]
        self.wall = locate_wall(self.element.design, heard[-1].reading.level, self.wall, moved)
        shots = [each.echo.shot for each in heard if each.echo.shot is not None]
        shots.sort(key=lambda shot: -shot.samples.shape[1])
        if self.wall is None or not self.watch.was_at_rest(shots):
            return None
        return self.watch.compare(shots, self.wall)

    def apply_change(self, change: str, site: int) -> tuple[str, float]:
        """Change something; return the name under which it should be told, and its amount."""
        faults = dict(CHANGE_KINDS[change])
        if 'gain' in faults:
            gains = faults.pop('gain')
            assert isinstance(self.element.driver, SensedSimulation)
            self.element.driver.sensors = RigSensors(gain=gains)
            self.element.transducer.assume_equilibrium()
            end = int(gains[1] != 1.0)
            return ('gain_left', 'gain_right')[end], gains[end] - 1.0
        [(name, value)] = faults.items()
        if cell := {'weak_factor': 'weak_cell', 'stuck_cell': 'stuck_cell'}.get(name):
            faults[cell] = site
        self.element.apply(SetFaults(Faults(sensor_noise=TRANSDUCER_NOISE_CELLS, **faults)))
        amount = value if name == 'actuator_offset' else value - 1.0
        other = {'damping_factor': 'eta', 'actuator_offset': 'strain'}.get(name, '')
        return 'cell' if cell else other, float(amount)


def watch_healthy(preset: str, scatter: float, seed: int, reads: int = 280) -> dict[str, Any]:
    """Return how many of healthy reads, every tenth by a write, were told as a change."""
    bench, random = WatchedElement(preset, scatter, seed), np.random.default_rng(seed)
    told, chi2 = [], []
    for number in range(reads):
        if number % 10 == 0:
            found = bench.compare_last_read(
                Write(int(random.integers(bench.element.design.levels)))
            )
        else:
            found = bench.read_at_rest()
        if found is not None:
            chi2.append(found.chi2)
            told += [found.text] if found.text else []
    return {
        'seed': seed, 'reads': len(chi2), 'alarms': len(told), 'told': sorted(set(told)),
        'chi2': float(np.median(chi2)), 'most chi2': float(np.max(chi2)),
    }  # fmt: skip


def summarise_healthy(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the totals of many elements."""
    return {
        'elements': len(rows),
        'reads': sum(row['reads'] for row in rows),
        'alarms': sum(row['alarms'] for row in rows),
        'told': [f'{row["seed"]}: {each}' for row in rows for each in row['told']],
    }


def watch_changed(preset: str, scatter: float, seed: int, change: str) -> dict[str, Any]:
    """Return what is told of a change, after how many reads, and how far off it is."""
    bench, random = (
        WatchedElement(preset, scatter, seed),
        np.random.default_rng([seed, len(change)]),
    )
    design = bench.element.design
    bench.compare_last_read(Write(int(random.integers(design.levels))))
    before = [seen.text for seen in (bench.read_at_rest(), bench.read_at_rest()) if seen]
    site = int(random.integers(2, design.N - 1))
    name, amount = bench.apply_change(change, site)
    found: dict[str, Any] = {
        'seed': seed, 'site': site, 'wall': bench.wall, 'alarm': any(before), 'text': '',
        'reads': None, 'named': False, 'off': None,
    }  # fmt: skip
    max_changed_reads = 10  # reads after which a change that has not been told is given up
    for number in range(1, max_changed_reads + 1):
        seen = bench.read_at_rest()
        if seen is not None and seen.text:
            found |= {'text': seen.text, 'reads': number}
            if (one := seen.change) is not None and one.name == name:
                stuck = 'stuck' in change
                near = name != 'cell' or abs(one.site - site) <= 1
                off = None if stuck else abs(one.amount / amount - 1.0)
                # found if what is told is off by at most a half
                found |= {'named': near and (off is None or off <= 0.5), 'off': off}
            break
    return found


def summarise_changed(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return what was told of a change of many elements."""
    told = [row for row in rows if row['text']]
    off = [row['off'] for row in rows if row['named'] and row['off'] is not None]
    return {
        'elements': len(rows),
        'told': len(told),
        'named': sum(row['named'] for row in rows),
        'alarms': sum(row['alarm'] for row in rows),
        'reads': float(np.median([row['reads'] for row in told])) if told else None,
        'off': 100.0 * float(np.median(off)) if off else None,
        'silent': [{key: row[key] for key in ('seed', 'site', 'wall')}
                   for row in rows if not row['text']],
    }  # fmt: skip
