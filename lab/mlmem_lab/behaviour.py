# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the device does, to the bit: hashes of the same trials of every shipped element.

All other results depend on these hashes, not on the device's code. So code that was only written
anew leaves them valid as soon as this study has proven that it does the same, in minutes.

A trial is a row of commands. Its hash is of every sample of an echo or a survey, of how each
procedure ended and when, and of the state of the chain after it; no sentence is part of it. Where
numpy computes a margin or the start of a wall, processors may round differently: on another one,
hash the former commit, too.
"""

from __future__ import annotations

import hashlib
import itertools
from collections.abc import Iterable, Iterator
from dataclasses import fields, replace
from typing import Any

import numpy as np

from mlmem import (
    ELEMENT_NAMES,
    Abort,
    Calibrate,
    Command,
    Disturb,
    EchoReceived,
    Erase,
    Faults,
    FollowTrajectory,
    Kick,
    Locate,
    MemoryElement,
    Outcome,
    Read,
    Refused,
    Reset,
    Scatter,
    SelfTest,
    SetFaults,
    SetMethod,
    SetStrain,
    SettingsError,
    Shot,
    Specimen,
    StateError,
    Survey,
    Write,
    draw_specimen,
    load_element,
    simulate,
    wall_at,
)
from mlmem.instrument.drivers import Simulation
from mlmem.physics.curve import Curve
from mlmem.physics.equilibrium import make_blank

from .study import Study


class Record:
    """The hash of all that a trial has shown so far."""

    def __init__(self) -> None:
        """Begin with nothing."""
        self._content = hashlib.blake2b(digest_size=8)

    def add(self, *values: object) -> None:
        """Add numbers, arrays and words."""
        for value in values:
            is_array = isinstance(value, np.ndarray)
            self._content.update(value.tobytes() if is_array else repr(value).encode())  # type: ignore[attr-defined]

    def perform(self, element: MemoryElement, *commands: Command) -> None:
        """Apply commands one after the other, each until its procedure has ended, and add what
        happened; after one that is no procedure, let a thousand ticks pass.
        """
        for command in commands:
            try:
                run, rounds = element.apply(command), 0
                while rounds < 10 if run is None else run.outcome is None:
                    self._add_events(element.advance(100))
                    rounds += 1
            except (Refused, StateError) as error:
                self.add('refused' if isinstance(error, Refused) else 'state')
            chain = element.chain
            self.add(chain.v, chain.velocity, chain.V, chain.substrate_velocity, element.ticks)

    def _add_events(self, events: Iterable[object]) -> None:
        for event in events:
            match event:
                case EchoReceived(echo):
                    self.add(str(echo.end), echo.t, echo.v_m, echo.v_c, echo.delay, echo.floor)
                case Shot():
                    self.add(str(event.end), event.samples, event.unrest, event.wall)
                case Outcome():
                    self.add(event.success, str(event.code), event.attempts, event.end_tick)
                    self.add(sorted(event.delays.items()), sorted(event.found.items()))
                    if (read := event.reading) is not None:
                        self.add(read.content, read.left_delay, read.right_delay, read.confidence)

    def describe(self) -> str:
        """Return the hash."""
        return self._content.hexdigest()


def run_trial(element: MemoryElement, *commands: Command) -> str:
    """Return the hash of a row of commands, and the tick at which they ended."""
    record = Record()
    record.perform(element, *commands)
    return f'{record.describe()}, tick {element.ticks}'


def list_faults(middle: int) -> Iterator[tuple[str, Faults]]:
    """Yield one case of every fault by its name; a fault of a cell is at the middle."""
    own_values: dict[str, Any] = {
        'sensor_noise': 1e-5, 'sensor_dropout': 0.02, 'sensor_gain': 0.9, 'sensor_lag': 0.3,
        'sensor_delay': 20.0, 'transducer_gain': 0.97, 'actuator_offset': 0.001,
        'actuator_lag': 10.0, 'missed_cycle': 0.5, 'weak_cell': middle, 'stuck_cell': middle,
        'damping_factor': 2.0, 'sensor_off': True, 'transducer_off': True, 'actuator_stuck': True,
    }  # fmt: skip
    for field in fields(Faults):
        if field.name not in ('seed', 'weak_factor', 'sensor_end', 'transducer_end'):
            values = {field.name: own_values.get(field.name, 1e-3), 'seed': 5}
            yield field.name, Faults(**values)


def measure_element(name: str) -> dict[str, str]:
    """Return the hashes of the trials of a shipped element."""
    shipped = load_element(name)
    design, settings = shipped.design_and_settings
    element = MemoryElement(shipped)
    if element.reader.needs_calibration(element):
        element.perform(Calibrate())
    last = element.reader.content_count - 1
    some = sorted({0, last // 3, last})
    reads = Read('left'), Read('right'), Read('both'), Locate()
    found = {
        'written': run_trial(
            element,
            *(each for content in some for each in (Write(content), Read(), Locate())),
            *reads, Erase(), Read(), Locate(), Kick(0.05), Read(), Erase(), Write(last + 1),
        ),
        'by hand': run_trial(
            element,
            Reset(some[-1], seed=3), SetStrain(0.02), SetStrain(0.0), Read(),
            FollowTrajectory((0.0, 0.01, 0.03), (0.0, 0.01, 0.0)), Read(),
            SetMethod('auto'), Write(some[0]), SetMethod('kick'), Erase(),
            Disturb(5e-5), Read(), Disturb(2e-3), Read(), Disturb(0.0), Abort(), Read(),
        ),
    }  # fmt: skip
    for fault, faults in list_faults(design.N // 2):
        found[fault] = run_trial(
            element, Reset(some[-1]), SetFaults(faults), Read(), Write(some[0]), Read(),
            SetFaults(Faults()), Calibrate() if fault == 'disorder_alpha' else Read(),
        )  # fmt: skip
    found['kept well'] = run_trial(
        MemoryElement(shipped), Write(some[-1]), Calibrate(), Survey(), SelfTest(), Read()
    )
    for scatter in (0.002, 0.02):
        made = draw_specimen(design, Scatter(alpha=scatter, k_r=scatter, mass=scatter), 7)
        driver = Simulation.build_blank(made, settings.time)
        element = MemoryElement(design, settings, driver=driver)
        found[f'parts scattered by {scatter:g}'] = run_trial(
            element, Calibrate(), *(each for one in some for each in (Write(one), *reads)), Erase()
        )
    return found | _measure_readers(name)


def _measure_readers(name: str) -> dict[str, str]:
    """Return the hashes of a scattered element that is read in every way, and with bad cells."""
    design, settings = load_element(name).design_and_settings
    stuck, weak, found = 2 * design.N // 3, design.N // 3, {}
    made = draw_specimen(design, Scatter(alpha=1e-3), 2)
    for what, group, field, value, faults in (
        ('delays', 'read', 'method', 'delay', Faults()),
        ('waveforms', 'read', 'method', 'waveform', Faults()),
        ('records', 'read', 'method', 'records', Faults()),
        ('a known stuck cell', 'element', 'bad_cells', f'{stuck}', Faults(stuck_cell=stuck)),
        ('a known weak cell', 'element', 'bad_cells', f'{weak}:0.5', Faults(weak_cell=weak)),
        ('a twin', 'read', 'method', settings.read.method, Faults()),
    ):
        try:
            changed = replace(getattr(settings, group), **{field: value})
            driver = Simulation.build_blank(made, settings.time)
            element = MemoryElement(design, replace(settings, **{group: changed}), driver=driver)
            if what == 'a twin':
                element.adopt_twin(made)
        except SettingsError as error:
            found[f'read with {what}'] = f'rejected: {error.field}'
            continue
        element.set_faults(faults)
        levels = sorted(element.reader.single_walls)
        found[f'read with {what}'] = run_trial(
            element, Read(), Calibrate(), Write(levels[0]), Read(), Locate(),
            Write(levels[-1]), Read('left'), Erase(), Read(),
        )  # fmt: skip
    return found


def measure_research(name: str) -> dict[str, str]:
    """Return the hashes of simulations without a device."""
    design, found = load_element(name).design, {}
    D = np.linspace(-1.8, 1.8, 200)
    own = Curve(-1.8, 1.8, tuple((0.8 * D * (D**2 - 1.0)).tolist()))
    specimens = {
        'as designed': Specimen(design),
        'scattered': draw_specimen(design, Scatter(alpha=0.01, k_r=0.01, s=0.01, depth=0.01), 4),
        'elastic': Specimen(replace(design, substrate='elastic')),
        'a law of its own': Specimen(replace(design, law=own, phase=0)),
    }
    starts = {
        'blank': make_blank,
        'with a wall at rest': wall_at(0),
        'with a wall that moves': wall_at(position=min(30.0, 0.5 * design.N), relaxed=False),
    }
    for (what, made), (start, initial) in itertools.product(specimens.items(), starts.items()):
        record = Record()
        for site in (1, design.N):
            run = simulate(
                made, duration=300.0, save_every=5.0, initial=initial,
                strain=lambda t: 2e-7 * t * (300.0 - t), eta=0.005, progress=False,
                drive={site: lambda t: np.where(t < 200.0, 2e-3 * (t % 9.0), np.nan)},
            )  # fmt: skip
            record.add(run.t, run.configuration, run.velocity)
        found[f'{what}, {start}'] = record.describe()
    return found


def measure_case(case: str) -> dict[str, str]:
    """Return the hashes of an element, or those of its simulations without a device."""
    name, comma, _ = case.partition(',')
    return measure_research(name) if comma else measure_element(name)


behaviour_study = Study(
    'behaviour',
    measure_case,
    (
        *ELEMENT_NAMES,
        *(f'{name}, simulated' for name in ('case_2', 'bits_4', 'robust_2_friction')),
    ),
    ('lab/mlmem_lab/behaviour.py', *(f'config/{name}.yaml' for name in ELEMENT_NAMES)),
    device_modules=('mlmem',),
)
