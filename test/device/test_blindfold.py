# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No procedure can reach the true wall: each works on a driver that shows only its ends."""

import math

import numpy as np
import pytest

from mlmem_ros.device import (
    Abort,
    Calibrate,
    End,
    Erase,
    MemoryElement,
    Read,
    Refused,
    SelfTest,
    SetStrain,
    Write,
)
from mlmem_ros.device.driver import Driver
from mlmem_ros.device.instrument import LONGEST_RUN
from mlmem_ros.physics import CASE_II

from . import rig

SAID = {'dt', 'nodes', 'lag', 'own_clock', 'interrupted', 'V_N', 'chain'}
ASKED = {'advance', 'end', 'force', 'health', 'close'}
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
    return MemoryElement(CASE_II, seeing.settings, seeing.calibration, driver), seeing.chain


def test_the_interface_of_a_driver_is_small():
    members = {name for name in vars(Driver) if not name.startswith('_')}
    assert members | set(Driver.__annotations__) == SAID | ASKED


@pytest.mark.parametrize(
    'commands',
    [
        [Write(2), Read('both'), Write(3), Write(1), Erase(), Read()],
        [SetStrain(0.01), Write(0), Abort()],
        [Write(1), Calibrate()],
        [Write(0), SelfTest()],
    ],
    ids=lambda commands: type(commands[-1]).__name__,
)
def test_every_procedure_works_blindfolded(commands):
    """With the same bits as without a blindfold."""
    blind, chain = blindfolded()
    seeing = rig.device()
    for command in commands:
        for element in (blind, seeing):
            element.apply(command)
            while element.procedure:
                element.advance(LONGEST_RUN)
    assert chain.state().tobytes() == seeing.chain.state().tobytes()
    assert blind.reading == seeing.reading
    assert blind.ticks == seeing.ticks


def test_any_other_access_is_noticed():
    element, _ = blindfolded(3)
    for name in ('configuration', 'v', 'V', 'state', 'velocity', '_metamaterial', 'specimen'):
        with pytest.raises(AssertionError, match=name):
            getattr(element.driver, name)
    with pytest.raises(Refused, match='only a simulated element'):
        element.chain  # noqa: B018


class Stub(Driver):
    """Another kind of rig: its right end follows the strain, its left end reflects pulses."""

    def __init__(self, design, dt, delay):
        self.dt = dt
        self._design, self._lag, self._sent = design, round(delay / dt), np.zeros(0)
        self._share = 0.05 * math.exp(-0.5 * design.eta * delay)  # what a wave loses on its way

    def end(self, site):
        return self._design.D_s2 if site == 1 else self._design.D_s1 + self.V_N

    def advance(self, V_N, drive=None, shake=None, looks=1):
        steps, rest = len(V_N), self._design.D_s2
        sent = np.zeros(steps)
        if drive is not None:
            driven = drive.motion[0]
            sent[: len(driven)] = driven - rest
        self._sent = np.concatenate((np.zeros(self._lag), self._sent, sent))[-self._lag - steps :]
        self.V_N = float(V_N[-1])
        return np.stack((rest + sent + self._share * self._sent[:steps], self._design.D_s1 + V_N))


def test_another_kind_of_rig_is_strained_and_read():
    """It replaces the chain; its echo arrives with the delay of a level, and is read as that
    level.
    """
    element = rig.device()
    delays = element.calibration.left.delays

    def read(delay):
        nonlocal element
        stub = Stub(element.design, element.driver.dt, delay)
        element = MemoryElement(element.design, element.settings, element.calibration, stub)
        return element.perform(Read('left')).reading

    early = 500.0 - read(500.0).delay
    for level, delay in list(enumerate(delays))[1:]:  # the first comes while the pulse still rings
        reading = read(delay + early)
        assert reading.level == level
        assert reading.delay == pytest.approx(delay, abs=element.driver.dt)
    element.apply(SetStrain(0.01))
    rig.ticks(element, 100)
    assert element.transducer.rest(End.RIGHT) == pytest.approx(element.design.D_s1 + 2.25)
