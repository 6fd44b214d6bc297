# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""No procedure can reach the true wall: each works on a driver that shows only its ends."""

import dataclasses

import pytest

from mlmem import (
    Abort,
    Calibrate,
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
    for name in ('configuration', 'v', 'V', 'velocity', '_metamaterial', 'specimen'):
        with pytest.raises(AssertionError, match=name):
            getattr(blind.driver, name)
    with pytest.raises(Refused, match='only a simulated element'):
        blind.chain  # noqa: B018
    assert blind.reading == seeing.reading
    assert blind.ticks == seeing.ticks
