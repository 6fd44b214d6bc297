# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What the parts of a kicked element may be like, by five laws in closed form.

The laws treat a wall as a soliton of the continuum. They were found by simulation, on designs of 4
to 16 levels, with an integrator of our own. Counted writes agree within a factor of two
(docs/build_one.md). The laws say what is impossible; counted writes say what works.

1. Disorder does not add up. The energy of a wall depends on the cells inside the wall alone. Its
   highest point between two levels scatters by 0.25 sigma E_0, however long the chain is.
2. A kick gives a wall at most E_max = E_0 (w / 1.97 - 1), because no kick makes a wall narrower
   than 1.97 cells. Every level has E_max / p of it, half to either side.
3. The rapidity of a wall falls by eta a cell: eta p J <= arcosh(w / 1.97).
4. Dry friction F takes F (D_s2 - D_s1) a cell from a wall, and fades an echo.
5. Wells of unequal depth do add up: every cell behind the wall keeps its own energy.

Lengths are in lattice constants a, energies in k_r a^2, forces in k_r a.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from mlmem.physics import Design, wall_energy
from mlmem.physics.wall import barrier_height, next_wall_costs, wall_width

from .concern import Finding, Report, Subject, Verdict, judge_value

MIN_HALF_WIDTH_CELLS = 1.97
"""Half width in cells below which no kick contracts a wall."""

ENERGY_PER_LEVEL = 2.0 * 2.58 * 0.25
"""Kinetic energy that a level with a scatter sigma needs, over sigma E_0. The highest point
between two levels scatters by 0.23 to 0.30 of sigma E_0; one of a hundred normal values lies
outside 2.58 standard deviations."""


def width_for_scatter(levels: int, scatter: float, share: float = 0.25) -> float:
    """Return the half width in cells of the narrowest wall that bears a scatter, by law 2.

    Args:
        levels: Number of levels.
        scatter: Standard deviation of on-site stiffness, springs and masses, relative.
        share: Share of the budget that a design reaches: usually a quarter, at best a half.
    """
    return MIN_HALF_WIDTH_CELLS * (1.0 + ENERGY_PER_LEVEL * levels * scatter / share)


def most_levels_with_scatter(scatter: float) -> float:
    """Return how many levels the widest walls ever tried bear with a scatter, by law 2."""
    if scatter <= 0.0:
        return math.inf
    widest_wall = 10.0  # half width in cells above which no design was tried
    energy = widest_wall / MIN_HALF_WIDTH_CELLS - 1.0
    best_share = 0.5  # share of the budget that designs reach at best
    return best_share * energy / (ENERGY_PER_LEVEL * scatter)


def most_levels_with_friction(friction: float) -> float:
    """Return to how many levels any kick gets a wall against dry friction in k_r a.

    Measured with an undamped, uniform chain, walls of 1.8 to 6 cells and kicks of all shapes: the
    reach, over twice the width of the wall, is 22 to 23 at 1e-3, 11 to 12 at 3e-3 and 5 to 6 at
    1e-2. It is farther than law 4 says, because the end pushes the wall on its first cells.
    """
    return 5.8 * (0.01 / friction) ** 0.6 if friction > 0.0 else math.inf


@dataclass(frozen=True)
class Budget:
    """What the five laws allow for an element of one wall.

    Attributes:
        design: The element.
    """

    design: Design

    @property
    def width(self) -> float:
        """Half width w of a wall in cells. With the paper's potential it is 1 / (2 sqrt d)."""
        return 0.5 * wall_width(self.design)

    @property
    def way(self) -> int:
        """Cells to the last level."""
        return self.design.levels * self.design.J

    @property
    def kick_energy(self) -> float:
        """Greatest kinetic energy E_max of a wall in k_r a^2; 0 for one as narrow as any."""
        return wall_energy(self.design) * max(0.0, self.width / MIN_HALF_WIDTH_CELLS - 1.0)

    @property
    def scatter(self) -> float:
        """Largest relative scatter of on-site stiffness, springs and masses, by law 2."""
        needed = ENERGY_PER_LEVEL * self.design.levels * wall_energy(self.design)
        return self.kick_energy / needed

    @property
    def pinning_scatter(self) -> float:
        """Relative scatter at which disorder pins a wall as deep as a defect does, by law 1."""
        return max(0.0, self.pin_depth) / (ENERGY_PER_LEVEL * wall_energy(self.design))

    @property
    def pin_depth(self) -> float:
        """Energy in k_r a^2 that a wall needs to pass from a level to half-way to the next one."""
        factors, J = self.design.defect_factors, self.design.J
        cells = np.arange(len(factors)) - len(factors) // 2
        # a wall in all defects of a long row; the energy of a soliton's cell is a sech^2
        sites = (J * np.arange(-3, 4)[:, None] + cells).ravel()
        missing = np.tile(1.0 - np.array(factors), 7)

        def gained_energy(position: float) -> float:
            shares = np.cosh(0.5 * math.pi * (sites - position) / self.width) ** -2.0
            return float(barrier_height(self.design) * (missing * shares).sum())

        return gained_energy(0.0) - gained_energy(0.5 * J)

    @property
    def damping(self) -> float:
        """Largest damping eta, by law 3."""
        return math.acosh(max(1.0, self.width / MIN_HALF_WIDTH_CELLS)) / self.way

    @property
    def friction(self) -> float:
        """Largest dry friction of a cell in k_r a, by law 4."""
        return self.kick_energy / (abs(self.design.D_s2 - self.design.D_s1) * self.way)

    @property
    def well_scatter(self) -> float:
        """Largest standard deviation between the depths of a cell's wells, over the barrier, by
        law 5: the energy of a wall at the last level is a sum over all cells behind it.
        """
        # one of a hundred normal values lies outside 2.58 standard deviations
        deviation = self.kick_energy / (2.0 * 2.58 * self.design.levels)
        return deviation / (math.sqrt(self.way) * barrier_height(self.design))

    def echo_reach(self, omega: float, amplitude: float) -> float:
        """Return how far a wall is whose echo dry friction just lets return, in cells.

        Friction takes 4 F / omega^2 of the amplitude in every period of a free mass. The design's
        friction F brakes the wave on its way out and back.

        Args:
            omega: Carrier frequency in rad per time unit.
            amplitude: Amplitude of the pulse in cells.
        """
        design = self.design
        if not design.friction:
            return math.inf
        half = 0.25 * (omega**2 - min(design.k_s1, design.k_s2))  # sin^2 of half the phase a cell
        if not 0.0 < half < 1.0:
            return 0.0
        speed = 2.0 * math.sqrt(half * (1.0 - half)) / omega
        return math.pi * omega * speed * amplitude / (4.0 * design.friction)


def check(subject: Subject) -> Iterator[Finding]:
    """Yield what the laws allow of an element whose levels kicks select, and its next walls."""
    design, settings = subject.design, subject.settings
    if not any(settings.kick.wall_speeds):
        return
    yield _judge_next_walls(design, settings.holds_words)
    if settings.holds_words:
        return
    budget = Budget(design)
    if budget.width > MIN_HALF_WIDTH_CELLS:  # of narrower walls the laws say nothing
        yield from _judge_wide_wall(budget)
    yield from _judge_friction(subject, budget)


def _judge_wide_wall(budget: Budget) -> Iterator[Finding]:
    """Yield what follows from the energy that the fastest kick gives a wall."""
    eta = budget.design.eta
    yield Finding(
        'allowed_scatter',
        {'by the kick': budget.scatter, 'by the defects': budget.pinning_scatter},
        'relative',
        Verdict.PASS,
        'bounds of the scatter of on-site stiffness, springs and masses at which one write in a '
        'hundred ends off-level; designs reach a quarter to a half of the smaller one',
    )
    yield Finding(
        'allowed_damping',
        {'eta': eta, 'at most': budget.damping},
        '1/time',
        # narrow walls get up to half as much energy again as the law says
        judge_value(budget.damping / eta if eta else math.inf, 0.33, 0.66),
        'damping that lets the fastest wall reach the last level, arcosh(w / 1.97) / (p J)',
    )
    yield Finding(
        'allowed_unequal_wells',
        {'by the kick': budget.well_scatter},
        'barriers',
        Verdict.PASS,
        "bound of the standard deviation between the depths of a cell's two wells: measure this "
        'first',
    )


def _judge_friction(subject: Subject, budget: Budget) -> Iterator[Finding]:
    design, settings = subject.design, subject.settings
    most = most_levels_with_friction(design.friction)
    verdict = judge_value(most / design.levels, 1.0, 1.0)
    values = {'friction': design.friction}
    if math.isfinite(most):
        values['levels at most'] = most
    text = 'dry friction of a cell that lets the fastest wall reach the last level'
    if verdict is Verdict.FAIL:
        text = f'friction stops every wall before level {math.floor(most)}: choose fewer levels'
    yield Finding('allowed_friction', values, 'k_r cells', verdict, text)
    if not design.friction or settings.read.method != 'waveform':
        return
    pulse = settings.register
    reach = budget.echo_reach(pulse.omega_c, pulse.A)
    verdict, text = Verdict.PASS, 'friction lets echoes of all levels return to an end'
    if reach < 0.5 * design.N:
        verdict = Verdict.WARN
        text = (
            'friction swallows echoes from the middle of the element: choose a stronger pulse '
            '(register.A) or fewer cells'
        )
    yield Finding('echo_reach', {'reach': reach}, 'cells', verdict, text)


def _judge_next_walls(design: Design, is_register: bool) -> Finding:
    below, above = next_wall_costs(design.potential, design.phase)
    found = {'below s1': below, 'above s2': above}
    values = {name: cost for name, cost in found.items() if math.isfinite(cost)}
    erase, words = describe_erase(below, above)
    return Finding(
        'next_walls',
        values,
        'walls',
        Verdict.PASS if is_register or below > 1.0 else Verdict.WARN,
        f'energy of the walls to the next states; {erase}; {words}',
    )


def describe_erase(below: float, above: float) -> tuple[str, str]:
    """Return what kicks erase, of one wall and of words, as two clauses.

    A kink and a wall annihilate if going on as walls of a further state would cost more. The kink
    that erases one wall has s1 outside; a pair of neighbours of a word has s2 outside.

    Args:
        below: Energy of a wall from s1 to the state below, over that of the memory's wall;
            infinity if there is no such state.
        above: The same of a wall from s2 to the state above.
    """
    erase = 'a kick erases one wall'
    if below <= 1.0:
        erase = 'no kick erases a wall, which passes through the kink into the state below s1'
    words = 'kicks of any speed erase words'
    if above <= 1.0:
        words = (
            'kicks that stop next to a wall erase words; fast ones may not, because two walls '
            'that meet across s1 can pass into the state above s2'
        )
    return erase, words


def judge_request(levels: int, scatter: float, friction: float) -> Report:
    """Judge a request before any design: whether levels, scatter and friction go together.

    Args:
        levels: Number of levels.
        scatter: Standard deviation of on-site stiffness, springs and masses, relative.
        friction: Dry friction of a cell in k_r a.
    """
    width = width_for_scatter(levels, scatter)
    sized = Finding(
        'width',
        {
            'at least': width_for_scatter(levels, scatter, share=0.5),
            'usually': width,
            # two cells per level over the width of a wall; nearer defects merge
            'cells of the element': 2.0 * levels * width,
        },
        'cells',
        Verdict.PASS,
        'half width of a wall that bears the scatter; wider walls need longer levels',
    )
    bounds = {
        'scatter': (scatter, most_levels_with_scatter(scatter)),
        'friction': (friction, most_levels_with_friction(friction)),
    }
    findings = [sized]
    for name, (amount, most) in bounds.items():
        allowed = levels <= most
        text = f'a {name} of {amount:g} leaves room for {levels} levels'
        if not allowed:
            text = (
                f'{levels} levels with a {name} of {amount:g} are impossible: choose at most '
                f'{math.floor(most)} levels, or parts with less {name}'
            )
        verdict = Verdict.PASS if allowed else Verdict.FAIL
        values = {'levels at most': most}
        findings.append(Finding(f'levels_by_{name}', values, '', verdict, text))
    return Report(tuple(findings))
