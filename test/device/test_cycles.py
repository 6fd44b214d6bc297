# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A strain cycle that pauses on its way back, and how an abort ends one."""

import dataclasses

import numpy as np

from mlmem import Write, new_element, preset

from .rig import succeed

PER_LEVEL = 620.0


def test_cycle_pauses_on_way_back_and_takes_stated_time():
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
