# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device at rest: its material computes nothing, its clock goes on, and it reads as before."""

import pytest

from mlmem_ros.device import EchoReceived, Read, SetFaults, Write, new_element, preset, snapshot
from mlmem_ros.device.faults import Faults

from . import rig


def count(element):
    """Return a list that grows by the ticks of every call of the material's loop."""
    steps, arguments = [], element.chain._arguments

    def asked(inputs, ends, every=0):
        steps.append(ends.shape[1] / element.steps_per_tick)
        return arguments(inputs, ends, every)

    element.chain._arguments = asked
    return steps


def test_a_blank_element_computes_nothing_and_its_clock_goes_on():
    element = rig.device()
    computed = count(element)
    rig.ticks(element, 2000)
    assert computed == []
    assert element.ticks == 2000
    assert element.chain.steps_done == 2000 * element.steps_per_tick


@pytest.mark.parametrize('noise', [0.0, 1e-6])
def test_an_element_rests_again_after_a_read(noise):
    """Noise of the transducers does not move the material."""
    element = rig.device(1)
    element.apply(SetFaults(Faults(sensor_noise=noise)))
    computed = count(element)
    rig.ticks(element, 100)
    assert computed == []
    rig.succeed(element, Read())
    assert computed
    rig.ticks(element, 1000)
    assert not element.chain.velocity.any()


def test_a_snapshot_carries_the_rest():
    element = rig.device(1)
    rig.ticks(element, 10)
    twin = rig.device()
    snapshot.restore(twin, snapshot.take(element))
    computed = count(twin)
    rig.ticks(element, 100)
    rig.ticks(twin, 100)
    assert computed == []
    assert snapshot.take(twin) == snapshot.take(element)


def test_rest_moves_no_delay():
    """Beside a twin that never rests."""
    heard = []
    for restless in (False, True):
        element = new_element(preset('bits_2'))
        if restless:
            chain = element.chain
            element.driver.advance = lambda *given, chain=chain: chain.advance(*given[:3])
        for command in (Write(3), Write(2)):
            assert element.perform(command).success
            rig.ticks(element, 1000)
            assert element.chain.velocity.any() == restless
            heard += [(restless, each.echo) for each in rig.events(element, Read())
                      if isinstance(each, EchoReceived)]  # fmt: skip
    delays = [[echo.delay for it, echo in heard if it == restless] for restless in (False, True)]
    assert len(delays[0]) == 4
    assert delays[0] == delays[1]
