# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A strain cycle that pauses on its way back, and how an abort ends one."""

import dataclasses

import numpy as np

from mlmem import Abort, SetStrain, Write, new_element, preset
from mlmem.presets import load_preset

from .rig import run, succeed

PER_LEVEL = 620.0


def test_a_cycle_pauses_on_the_way_back_and_takes_the_stated_time():
    design, settings = preset('bits_2')
    plain = dataclasses.replace(settings.write, final_settle=0.0, shaped=False)
    element = new_element(design, dataclasses.replace(settings, write=plain))
    succeed(element, Write(0))
    element.apply(Write(2))
    strain = []
    for _ in range(round(PER_LEVEL / element.tick)):
        element.advance()
        strain.append(element.actuator.strain)
    write = settings.write
    at = np.cumsum([write.ramp, write.hold, write.ease, write.release]) / element.tick - 1
    seen = np.array(strain)[at.astype(int)] / write.compression
    np.testing.assert_allclose(seen, [1.0, 1.0, write.ease_to, 0.0], atol=1e-12)
    assert np.all(np.array(strain)[int(at[-1]) :] == 0.0)
    assert element.procedure == 'write'  # which ends with a read


def test_an_abort_releases_the_strain_as_slowly_as_an_erase():
    """The way back of a fast write takes a tick, which would be a jerk from the peak."""
    design, settings = load_preset('bits_2')
    assert settings.write.release == settings.time.tick
    element = new_element(design, settings)
    element.apply(SetStrain(0.02))
    while element.actuator.is_moving:
        element.advance()
    outcome = run(element, Abort())
    assert (outcome.end_tick - outcome.start_tick) * element.tick >= settings.erase.release
