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
    SelfTest,
    SetStrain,
    Settings,
    Write,
    factory_calibration,
)
from mlmem.instrument.instrument import MAX_RUN_TICKS
from mlmem.physics import CASE_II
from test.rig.lines import LocalDriver

from . import rig


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
    seeing = rig.device(design=two_levels, calibration=known)
    blind = MemoryElement(two_levels, Settings(), known, LocalDriver(two_levels))
    for command in commands:
        for element in (blind, seeing):
            element.apply(command)
            while element.procedure:
                element.advance(MAX_RUN_TICKS)
    assert blind.transducer.recent.tobytes() == seeing.transducer.recent.tobytes()
    assert blind.reading == seeing.reading
    assert blind.calibration == seeing.calibration
    assert blind.ticks == seeing.ticks
