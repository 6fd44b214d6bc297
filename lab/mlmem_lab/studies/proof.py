# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The proof of a design: the node's device, put to every use of the memory.

Four kinds of run, each judged by the device's answers and by the true configuration:

- `upward`: from blank, every level is written in turn and verified, one attempt each.
- `down`: from a wall at rest at a level, a lower one is written: erase, launch, steps.
- `erase`: from a wall at rest at a level, the element is made blank.
- `read`: a wall at rest at a level is read ten times in a row, from each end and both: what the
  reads before have left on its way must not be taken for an echo.

Of many walls, as many random words stand for the levels, the least first; what is blank is word 0.
"""

from __future__ import annotations

import math
import random
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mlmem import (
    Calibration,
    Erase,
    MemoryElement,
    Outcome,
    Read,
    Settings,
    Write,
    factory_calibration,
    load_element,
)
from mlmem.element_file import Element
from mlmem.factory import compute_calibration
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Design, Specimen, find_level
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.calibration import make_corrections
from mlmem.readers.reading import BLANK, UNDECODABLE
from mlmem.readers.register import find_wall_levels, pin_walls
from mlmem.readers.words import make_code

from ..study import Study

Values = Mapping[str, Any]
"""Numbers and strings by name: what JSON can hold."""


@dataclass(frozen=True, eq=False)
class Proof:
    """What to prove of a design.

    Attributes:
        given: The settings of its instrument, but for the one attempt that a write has here.
        sample: Most downward writes to make; by default all, or above 16 levels as many as levels.
            Every level is erased, and read.
        element: An element of the design with its pulses; None for one exactly as designed.
    """

    design: Design
    given: Settings
    sample: int | None = None
    seed: int = 0
    element: Element | None = None

    @cached_property
    def settings(self) -> Settings:
        """The settings, with one attempt to write."""
        return replace(self.given, write=replace(self.given.write, attempts=1))

    @cached_property
    def made(self) -> Specimen:
        """The element as it is simulated."""
        return Specimen(self.design) if self.element is None else self.element.timed_specimen

    @cached_property
    def calibration(self) -> Calibration:
        """Its delays and its pulses, factors on those set. Once known, processes are given them.

        Raises:
            SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
        """
        if self.element is None:
            return factory_calibration(self.design, self.settings)
        plan = self.element.plan
        return replace(
            compute_calibration(self.made, self.design, self.settings),
            pulse_corrections=plan and make_corrections(plan.steps, self.settings),
        )

    @cached_property
    def contents(self) -> list[int]:
        """What is written for each level, and at last what is blank."""
        code = make_code(self.design, self.settings)
        if code is None:
            return [*range(self.design.levels), BLANK]
        drawn = random.Random(self.seed).sample(range(1, code.words), self.design.levels)
        return [*sorted(drawn), 0]

    def build_device(self) -> MemoryElement:
        """Return a blank device; raises as `calibration`."""
        if self.element is None:
            return MemoryElement(self.design, self.settings, self.calibration)
        settings = self.element.apply_planned_kicks(self.settings)
        driver = Simulation.build_blank(self.made, settings.time)
        device = MemoryElement(self.design, settings, self.calibration, driver)
        if device.settings.holds_words:
            device.adopt_twin(self.made)
        return device

    def find_content(self, device: MemoryElement) -> int:
        """Return the level at which the wall of a device is; -1 if blank, -2 if at none; of many
        walls the word.
        """
        configuration = device.chain.configuration
        if (code := make_code(self.design, device.settings)) is not None:
            levels = find_wall_levels(self.design, configuration)
            allowed = levels is not None and code.is_valid_word(levels)
            return code.word(levels or ()) if allowed else UNDECODABLE
        return find_level(self.design, configuration, arrival_tolerance(self.design))

    def points(self) -> list[dict[str, Any]]:
        """Return the runs: kind, the level begun at and the level asked for (-1 for blank)."""
        p = self.design.levels
        downs = [(start, goal) for start in range(p) for goal in range(start)]
        if p > 16 or self.sample is not None:
            downs = self._sample_runs(downs, p if self.sample is None else self.sample)
        return [
            {'kind': 'upward', 'start': -1, 'goal': p - 1},
            *({'kind': 'erase', 'start': level, 'goal': -1} for level in range(p)),
            *({'kind': 'read', 'start': level, 'goal': level} for level in range(p)),
            *({'kind': 'down', 'start': start, 'goal': goal} for start, goal in downs),
        ]

    def _sample_runs(self, whole: Sequence[Any], count: int) -> list[Any]:
        """Return a sample that holds the first and the last, in order."""
        if count >= len(whole):
            return list(whole)
        generator = np.random.Generator(np.random.PCG64(self.seed))
        inner = generator.choice(np.arange(1, len(whole) - 1), max(0, count - 2), replace=False)
        return [whole[i] for i in sorted({0, len(whole) - 1, *map(int, inner)})]


def evaluate_run(proof: Proof, values: Values) -> dict[str, Any]:
    """Return how one run went: one of `Proof.points`.

    Returns:
        done: Levels written and read back upward, or right reads; for other runs 1 on success,
            else 0.
        asked: Procedures of the run.
        passed: Whether all succeeded at the first attempt.
        error: What the device said, or the truth if that differs.
        level_margin: The least of the readings, None without one.
        time: Duration in time units.
    """
    element, contents = proof.build_device(), proof.contents
    begin, goal = contents[values['start']], contents[values['goal']]
    if values['kind'] == 'upward':
        outcomes, error = write_upward(proof, element)
        passed = not error
        done = len(outcomes) - (not passed)
    else:
        made, reader = proof.made, element.reader
        many = element.settings.holds_words
        element.chain.place(
            pin_walls(made, reader.list_walls(begin)) if many else find_pinned_wall(made, begin)
        )
        element.transducer.assume_equilibrium()
        ends = 'left', 'right', 'both'
        commands: dict[str, list[Read | Erase | Write]] = {
            'read': [Read(ends[number % 3]) for number in range(10)],
            'erase': [Erase()],
            'down': [Write(goal)],
        }
        outcomes = [element.perform(command) for command in commands[values['kind']]]
        true = proof.find_content(element)
        said = [each.reading.level if each.success and each.reading else None for each in outcomes]
        right = [true == goal == level for level in said]
        done, passed = sum(right), all(right)
        error = next((each.error for each in outcomes if each.error), '')
        if not passed and not error:
            error = f'the wall is at level {true}'
    margins = (outcome.reading.level_margin for outcome in outcomes if outcome.reading)
    return dict(values) | {
        'done': done, 'asked': len(outcomes), 'passed': passed, 'error': error,
        'level_margin': min(filter(math.isfinite, margins), default=None),
        'time': element.ticks * element.tick,
    }  # fmt: skip


def write_upward(proof: Proof, element: MemoryElement) -> tuple[list[Outcome], str]:
    """Write contents in turn, one attempt each, up to the first failure.

    A content counts if the write decodes it and the walls are really there.

    Returns:
        The outcomes, and what failed, empty if nothing did: 'wall' if the device knows that its
        write failed, 'silent' if it does not, 'echo' if the wall is right and the reading is not.
    """
    outcomes: list[Outcome] = []
    for content in proof.contents[:-1]:
        outcomes.append(outcome := element.perform(Write(content)))
        there = proof.find_content(element) == content
        if not (there and outcome.success):
            failure = 'echo' if there else 'silent' if outcome.success else 'wall'
            return outcomes, f'level {content}: {failure} {outcome.error}'
    return outcomes, ''


@dataclass(frozen=True)
class Tally:
    """The totals of a proof's runs.

    Attributes:
        upward: Levels written and read back upward, and of how many.
        read: Right reads in a row, and of how many.
        level_margin: Least level margin of all readings, NaN without one.
        write_time: Mean time of an upward write in time units.
        erase_time: Longest erase in time units.
        errors: What failed and why, a line each; empty if everything succeeded.
    """

    upward: tuple[int, int]
    down: tuple[int, int]
    erase: tuple[int, int]
    read: tuple[int, int]
    level_margin: float
    write_time: float
    erase_time: float
    errors: tuple[str, ...]

    @classmethod
    def of(cls, rows: Iterable[Values]) -> Tally:
        """Add up the rows of all runs; one of them is the upward run."""
        rows = list(rows)
        run_kinds = ('upward', 'down', 'erase', 'read')
        of_kind = {kind: [row for row in rows if row['kind'] == kind] for kind in run_kinds}
        done = {kind: sum(row['done'] for row in some) for kind, some in of_kind.items()}
        margins = [row['level_margin'] for row in rows if row['level_margin'] is not None]
        return cls(
            (done['upward'], of_kind['upward'][0]['goal'] + 1),
            (done['down'], len(of_kind['down'])),
            (done['erase'], len(of_kind['erase'])),
            (done['read'], sum(row['asked'] for row in of_kind['read'])),
            min(margins, default=math.nan),
            of_kind['upward'][0]['time'] / max(1, done['upward']),
            max((row['time'] for row in of_kind['erase']), default=0.0),
            tuple(
                f'{row["kind"]} from {row["start"]} to {row["goal"]}: {row["error"]}'
                for row in rows
                if not row['passed']
            ),
        )


def describe_proof(design: Design, settings: Settings, tally: Tally) -> dict[str, str]:
    """Return what the table says of a design, by heading."""
    unit = settings.scale.time
    return {
        'levels': f'{design.levels}',
        'cells': f'{design.N}',
        'written and read back': '{} of {}'.format(*tally.upward),
        'written downward': '{} of {}'.format(*tally.down),
        'erased': '{} of {}'.format(*tally.erase),
        'read in a row': '{} of {}'.format(*tally.read),
        'least level margin': f'{tally.level_margin:.2f}',
        'time per level, s': f'{tally.write_time * unit:.2g}',
        'longest erase, s': f'{tally.erase_time * unit:.3g}',
    }


def prove_preset(name: str) -> dict[str, str]:
    """Return the proof of a preset."""
    chosen = load_element(name).design_and_settings
    sample = {'bits_4': 8}.get(name)  # where all downward writes would take long
    proof = Proof(*chosen, sample=sample)
    return describe_proof(
        *chosen, Tally.of(evaluate_run(proof, point) for point in proof.points())
    )


proofs_study = Study(
    'proofs',
    prove_preset,
    ('case_2', 'bits_1', 'bits_2', 'bits_4'),
    ('lab/mlmem_lab/studies/proof.py',),
)
