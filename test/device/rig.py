# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Devices to experiment on, and the true wall, which only the experimenter may see."""

import dataclasses
import json

import hypothesis
import numpy as np

from mlmem import (
    BLANK,
    EchoReceived,
    Faults,
    MemoryElement,
    SetFaults,
    Settings,
    as_designed,
    factory_calibration,
    load_element,
    snapshot,
)
from mlmem.instrument.drivers import Simulation
from mlmem.physics import CASE_II, find_level, find_walls
from mlmem.physics.equilibrium import find_pinned_wall
from mlmem.readers.register import pin_walls

unhurried = hypothesis.settings(deadline=None, derandomize=True, max_examples=60)
"""For Hypothesis: 60 cases, the same in every run; a loaded machine is no finding."""

DESIGN = dataclasses.replace(CASE_II, N=125)
"""Four of the eight levels of the paper's second element, of its cells and at its distances: what
a procedure does costs a third here."""

ROBUST_NAMES = ['robust_2', 'robust_3', 'robust_2_friction', 'robust_3_friction']

STUCK_CELL = 104
"""A cell beside the defect of level 3 of Case II, which is cell 100."""


def change(settings, **groups):
    """Return settings with other values of some groups, as in `write={'attempts': 1}`."""
    changed = {
        name: dataclasses.replace(getattr(settings, name), **given)
        if isinstance(given, dict)
        else given
        for name, given in groups.items()
    }
    return dataclasses.replace(settings, **changed)


def device(level=BLANK, *, design=DESIGN, calibration=None, driver=None, **settings):
    """Return a device with its wall resting at a level, or blank, with unknown content.

    Settings are changed as by `change`. The calibration is the factory's for the default settings
    and a rigid substrate, so that others may be as wrong as an experiment needs.
    """
    rigid = dataclasses.replace(design, substrate='rigid')
    calibration = calibration or factory_calibration(rigid, Settings())
    element = MemoryElement(design, change(Settings(), **settings), calibration, driver)
    return element if level == BLANK else settle(element, find_pinned_wall(design, level))


def shipped(name, made=None, **settings):
    """Return a blank shipped element with other settings, as by `change`, and with a calibration
    of its own; its material is that of its file, or what was made instead.
    """
    design, given = load_element(name).design_and_settings
    given = change(given, **settings)
    driver = None if made is None else Simulation.build_blank(made, given.time)
    return MemoryElement(design, given, driver=driver)


def first_levels(name, n):
    """Return a shipped element with its first levels alone: what a procedure does costs less."""
    design, settings = load_element(name).design_and_settings
    kick = settings.kick
    speeds, kinks = (' '.join(each.split()[:n]) for each in (kick.speeds, kick.kinks))
    return as_designed(
        dataclasses.replace(design, N=design.N - design.J * (design.levels - n)),
        change(settings, kick={'speeds': speeds, 'kinks': kinks}),
    )


def failed_checks(outcome):
    """Return the names of the checks of a self-test that did not pass, which it must list."""
    failed = [check.name for check in outcome.checks if not check.passed]
    assert (outcome.code, outcome.error) == ('failed', f'failed: {", ".join(failed)}')
    return failed


def settle(element, v):
    """Put an element at rest with these displacements, and return it."""
    element.chain.place(v)
    element.transducer.assume_equilibrium()
    return element


def pin(element, *levels):
    """Put walls at rest at some levels of the material as it is, and return the element."""
    return settle(element, pin_walls(element.chain.specimen, levels))


def set_faults(element, **faults):
    """Give an element these faults and no others, as the command does, and return it."""
    element.apply(SetFaults(Faults(**faults)))
    return element


def save_state(element):
    """Return the snapshot of an element as a file keeps it: as JSON without NaN."""
    return json.loads(json.dumps(snapshot.take_snapshot(element), allow_nan=False))


def ticks(element, *steps):
    """Apply commands and advance by numbers of ticks, in turn and in runs; return the events."""
    seen = []
    for step in steps:
        if isinstance(step, int):
            end = element.ticks + step
            while element.ticks < end:
                seen += element.advance(end - element.ticks)
        else:
            element.apply(step)
    return seen


def events(element, command):
    """Apply a command and return the events until its procedure has ended, in runs of ticks."""
    seen, run = [], element.apply(command)
    while run.outcome is None:
        seen += element.advance(1000)
    return seen


def find_echoes(events):
    """Return the events of received echoes."""
    return [event for event in events if isinstance(event, EchoReceived)]


def plain(told):
    """Return what is told, for an exact comparison in which NaN equals itself."""
    if isinstance(told, np.ndarray):
        return told.tobytes()
    if dataclasses.is_dataclass(told):
        values = (plain(getattr(told, each.name)) for each in dataclasses.fields(told))
        return type(told).__name__, *values
    return repr(told)


def strains(element, command):
    """Return all strains that the substrate is given during a procedure, and what is told."""
    given, advance = [], element.driver.advance

    def follow(V_N, *more, **named):
        given.append(V_N / element.design.N)
        return advance(V_N, *more, **named)

    element.driver.advance = follow
    told = events(element, command)
    element.driver.advance = advance
    return np.concatenate(([], *given)), told


def cycles(trace):
    """Return the peak of every strain cycle, that is of every stretch with non-zero strain."""
    groups = np.split(trace, 1 + np.flatnonzero(np.diff(trace != 0.0)))
    return [group[np.abs(group).argmax()] for group in groups if group.any()]


def succeed(element, command):
    """Apply a command, which must succeed, and return its outcome."""
    outcome = element.perform(command)
    assert outcome.success, outcome.error
    return outcome


def wall(element):
    """Return the true position of the one wall."""
    (only,) = find_walls(element.design, element.chain.configuration)
    assert only.anti_kink
    return only.position


def true_level(element, tolerance=1.0):
    """Return the level within so many cells of which the true wall is, `BLANK` if all cells are
    inactive, or `UNDECODABLE`.
    """
    return find_level(element.design, element.chain.configuration, tolerance)


def bits(element):
    """Return all that a command could change, for an exact comparison."""
    actuator, transducer = element.actuator, element.transducer
    return (
        snapshot.hash_state(element),
        actuator.strain,
        actuator.elapsed,
        actuator.motion,
        transducer.recent.tobytes(),
        transducer.is_driving,
        not transducer.detectors,
        element.procedure,
        element.reading,
        element.calibration,
    )


def kind_with(name, cells, method='strain'):
    """Return a preset whose settings name bad cells; of Case II, whose first five levels."""
    design, settings = load_element(name).design_and_settings
    if name == 'case_2':
        design = dataclasses.replace(design, N=150)
    return design, change(settings, write={'method': method}, element={'bad_cells': cells})


def element_with(name, cells, faults, method='strain'):
    """Return a blank element that is kind_with of some cells, with faults that may be others."""
    element = MemoryElement(*kind_with(name, cells, method))
    element.set_faults(faults)
    return element
