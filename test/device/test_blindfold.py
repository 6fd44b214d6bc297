# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No procedure can reach the true wall: each works on a driver that shows only its ends."""

import dataclasses
import math

import numpy as np
import pytest

from mlmem import (
    UNDECODABLE,
    Abort,
    Calibrate,
    Calibration,
    DelayTable,
    End,
    Erase,
    MemoryElement,
    Read,
    Refused,
    SelfTest,
    SetStrain,
    Settings,
    Write,
    factory_calibration,
)
from mlmem.instrument.drivers import Driver
from mlmem.instrument.instrument import MAX_RUN_TICKS
from mlmem.physics import CASE_II

from . import rig

SAID = {'dt', 'nodes', 'lag', 'strains', 'own_clock', 'interrupted', 'V_N', 'chain'}
ASKED = {'advance', 'at_rest', 'pass_by', 'end', 'force', 'health', 'close'}
"""All that an instrument may ask of its driver."""


class Blindfold(Driver):
    """Passes on the motion of the ends of a chain, and nothing else."""

    def __init__(self, chain):
        self.dt, self.nodes = chain.dt, chain.integrator.nodes
        self.advance, self.end = lambda *given: chain.advance(*given), lambda site: chain.end(site)

    def advance(self):
        """Each has one of its own."""

    end = advance

    def __getattr__(self, name):
        raise AssertionError(f'somebody looks at {name}')


def blindfolded(level=None, **settings):
    """Return a device whose driver shows only the ends, and the chain for the experimenter."""
    seeing = rig.device(level, **settings)
    driver = Blindfold(seeing.chain)
    return MemoryElement(seeing.design, seeing.settings, seeing.calibration, driver), seeing.chain


def test_interface_of_driver_is_small():
    members = {name for name in vars(Driver) if not name.startswith('_')}
    assert members | set(Driver.__annotations__) == SAID | ASKED


@pytest.mark.parametrize(
    'commands',
    [
        [Write(0), Read('both'), Write(1), Write(0), Erase(), Read()],
        [SetStrain(0.01), Write(0), Abort()],
        [Write(1), Calibrate()],
        [Write(0), SelfTest()],
    ],
    ids=lambda commands: type(commands[-1]).__name__,
)
def test_every_procedure_works_blindfolded(commands):
    """With the same bits as without a blindfold."""
    two_levels = dataclasses.replace(CASE_II, N=75)
    known = factory_calibration(two_levels, Settings())
    blind, chain = blindfolded(design=two_levels, calibration=known)
    seeing = rig.device(design=two_levels, calibration=known)
    for command in commands:
        for element in (blind, seeing):
            element.apply(command)
            while element.procedure:
                element.advance(MAX_RUN_TICKS)
    assert chain.state().tobytes() == seeing.chain.state().tobytes()
    for name in ('configuration', 'v', 'V', 'state', 'velocity', '_metamaterial', 'specimen'):
        with pytest.raises(AssertionError, match=name):
            getattr(blind.driver, name)
    with pytest.raises(Refused, match='only a simulated element'):
        blind.chain  # noqa: B018
    assert blind.reading == seeing.reading
    assert blind.ticks == seeing.ticks


class Stub(Driver):
    """Another kind of rig: its right end follows the strain, and both ends reflect pulses."""

    def __init__(self, design, dt, delays):
        self.dt = dt
        self._design = design
        self._lines = {end: Line(design, round(delays[end] / dt), dt) for end in End}

    def _rest(self, end):
        return end.rest(self._design) + end.displacement(self._design, self.strain)

    @property
    def strain(self):
        return self.V_N / self._design.end_displacement(1.0)

    def end(self, site):
        return self._rest(End.LEFT if site == 1 else End.RIGHT)

    def advance(self, V_N, held_cell=None, shake=None, looks=1):
        self.V_N = float(V_N[-1])
        heard = []
        for end, line in self._lines.items():
            sent = np.zeros(len(V_N))
            if held_cell is not None and held_cell.site == end.site(self._design):
                driven = held_cell.motion[0]
                sent[: len(driven)] = driven - self._rest(end)
            moved = V_N if end is End.RIGHT else np.zeros(len(V_N))
            heard.append(end.rest(self._design) + moved + line.reflect(sent))
        return np.stack(heard)


class Line:
    """A delay line: what is sent comes back, fainter by what a wave loses on its way."""

    def __init__(self, design, lag, dt):
        self._lag, self._sent = lag, np.zeros(0)
        self._share = 0.5 * math.exp(-0.5 * design.eta * lag * dt)

    def reflect(self, sent):
        steps = len(sent)
        self._sent = np.concatenate((np.zeros(self._lag), self._sent, sent))[-self._lag - steps :]
        return sent + self._share * self._sent[:steps]


def test_another_kind_of_rig_is_strained_and_read():
    """It replaces the chain; its echoes arrive with the delays of a level, and are read as that
    level.
    """
    element = rig.paper()
    tables = {end: element.calibration.table(end).delays for end in End}
    blank = element.calibration.right.blank
    known = Calibration(DelayTable(tables[End.LEFT]), DelayTable(tables[End.RIGHT], blank))

    def read(left, right):
        nonlocal element
        stub = Stub(element.design, element.driver.dt, {End.LEFT: left, End.RIGHT: right})
        element = MemoryElement(element.design, element.settings, known, stub)
        return element.perform(Read()).reading

    first = read(500.0, 400.0)
    early = 500.0 - first.left_delay, 400.0 - first.right_delay
    for level in range(1, 7):  # the outermost come while a pulse still rings
        delays = tables[End.LEFT][level], tables[End.RIGHT][level]
        reading = read(*(delay + lead for delay, lead in zip(delays, early, strict=True)))
        assert (reading.level, reading.walls) == (level, 1)
        got = reading.left_delay, reading.right_delay
        assert got == pytest.approx(delays, abs=element.driver.dt)
    wrong = read(tables[End.LEFT][3] + early[0], tables[End.RIGHT][5] + early[1])
    assert wrong.level == UNDECODABLE
    element.apply(SetStrain(0.01))
    rig.ticks(element, 100)
    assert element.transducer.rest(End.RIGHT) == pytest.approx(element.design.D_s1 + 2.25)
