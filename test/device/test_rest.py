# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A device at rest: its material computes nothing, its clock goes on, and it reads as before."""

import dataclasses
import random

import pytest
from sampled import sampled

from mlmem import (
    Read,
    SetFaults,
    preset,
)
from mlmem.instrument.end import End, Pulse
from mlmem.instrument.faults import Faults
from mlmem.instrument.instrument import Instrument
from mlmem.physics import Specimen
from mlmem.physics.equilibrium import find_pinned_wall

from . import rig


def count(element):
    """Return a list that grows by the ticks of every call of the material's loop."""
    steps, arguments = [], element.chain._build_arguments

    def asked(inputs, ends, every=0):
        steps.append(ends.shape[1] / element.steps_per_tick)
        return arguments(inputs, ends, every)

    element.chain._build_arguments = asked
    return steps


@pytest.mark.parametrize('noise', [0.0, 1e-6])
def test_element_rests_again_after_read(noise):
    """Noise of the transducers does not move the material."""
    element = rig.device(1)
    element.apply(SetFaults(Faults(sensor_noise=noise)))
    computed = count(element)
    rig.ticks(element, 100)
    assert computed == []
    assert element.ticks == 100
    assert element.chain.steps_done == 100 * element.steps_per_tick
    rig.succeed(element, Read())
    assert computed
    rig.ticks(element, 1000)
    assert not element.chain.velocity.any()


class RestlessInstrument(Instrument):
    """The slow twin without procedures."""

    at_rest = False


SHORT = dataclasses.replace(preset('bits_1').design, eta=0.2)
"""So damped that it rests some ticks after whatever moved it."""


def instrument(kind, level):
    """Return an instrument with a wall at rest."""
    made = kind(SHORT, preset('bits_1').settings)
    made.chain.place(find_pinned_wall(Specimen(SHORT), level))
    made.transducer.assume_equilibrium()
    return made


def drawn(chance):
    """Return something that is done to an instrument: many are so faint that nothing moves."""
    end, A = chance.choice(list(End)), chance.choice((1e-9, 1e-3))
    faint, strain = chance.random() < 0.7, chance.choice((0.0, 1e-4))
    noisy = Faults(sensor_noise=1e-7, sensor_end=chance.choice(('both', 'right')))
    faults = noisy if chance.random() < 0.5 else Faults()
    shake = chance.choice((0.0, 1e-7))

    def pulse(made):
        probe = dataclasses.replace(made.transducer.probes[end], A=A, sigma=2.0)
        made.transducer._hold_cell(end, Pulse(made.transducer.rest(end), probe))

    def stay(made):
        """Hold an end where it is."""
        made.transducer.move(end, made.driver.end(end.site(SHORT)), 0.01)

    return chance.choice((
        pulse, stay,
        lambda made: stay(made) if faint else made.transducer.fire(end),
        lambda made: made.transducer.record_pulse(end, made.transducer.probes[end]),
        lambda made: made.transducer.listen(end),
        lambda made: made.actuator.slew_to(strain),
        lambda made: made.base.disturb(shake),
        lambda made: made.set_faults(faults),
    ))  # fmt: skip


def release(made):
    """End all that keeps an element from its rest."""
    made.transducer.release()
    made.base.disturb(0.0)
    made.set_faults(Faults())


def whole(made):
    """Return all that ticks change."""
    transducer, chain = made.transducer, made.chain
    return (
        made.ticks, made.last_moved, made.substrate_speed, made.base.state, made.actuator.state,
        made.transmission.state, chain.state().tobytes(), chain.V_N, chain.steps_done,
        transducer.recent.tobytes(), transducer.held is None, transducer.remaining_time,
        {end: each.returns for end, each in transducer.reverberation.items()},
        {end: (each.time, each.delay) for end, each in transducer.detectors.items()},
        [each.shot(0.0, 0.0, 0.5).samples.tobytes() for each in transducer.recorders],
    )  # fmt: skip


@pytest.mark.parametrize('seeds', sampled([range(6), range(6, 300)], lambda seeds: 0 in seeds))
def test_any_rest_of_instrument_equals_computing_every_tick(seeds):
    """Rests begin, and end, at every phase of a pulse, a strain, a shake and a fault, in runs of
    any length; what is driven too faintly to move anything is driven and heard all the same.
    """
    for seed in seeds:
        chance = random.Random(seed)
        quick, slow = instrument(Instrument, seed % 2), instrument(RestlessInstrument, seed % 2)
        rests = 0
        for left in reversed(range(15)):
            acts, runs = [drawn(chance)], [chance.choice((1, 2, 3, 7)) for _ in range(4)]
            if left == 0 or chance.random() < 0.4:
                acts, runs = [release, *acts] if left else [release], [*runs, 60]
            for made in (quick, slow):
                for act in acts:
                    act(made)
            for ticks in runs:
                quick.pass_ticks(ticks)
                for _ in range(ticks):
                    slow.pass_ticks()
                assert whole(quick) == whole(slow)
                rests += quick.at_rest
        assert rests
