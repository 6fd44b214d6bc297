# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a device does with the file of a fitted element: simulate it, and know it beforehand."""

import gc
import json
import weakref
from dataclasses import replace

import numpy as np
import pytest
import rig
from suite import expect_rejection

from mlmem import (
    UNDECODABLE,
    Calibrate,
    MemoryElement,
    Read,
    SettingsError,
    Shot,
    element_file,
    load_element,
)
from mlmem.factory import compute_calibration
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import End
from mlmem.instrument.instrument import Instrument
from mlmem.parsing import DecodeError, encode_value
from mlmem.physics import Chain, Scatter, Specimen, draw_specimen
from mlmem.readers.calibration import PulseCorrection, PulseCorrections, hash_schedule
from mlmem.settings import ProbeSettings
from mlmem_ros.bag import jazzy
from mlmem_ros.session import records
from mlmem_ros.session.records import read_header
from mlmem_tools.identification.forward import Forward
from mlmem_tools.identification.unknowns import Unknowns

CHOSEN = load_element('bits_1')
DESIGN = CHOSEN.design
MADE = draw_specimen(replace(DESIGN, eta=1.1 * DESIGN.eta), Scatter(alpha=0.01, offset=0.001), 3)
"""An element whose damping differs from the design's, and its cells from each other."""


@pytest.fixture
def element():
    return MemoryElement(CHOSEN, driver=Simulation.build_blank(MADE, CHOSEN.settings.time))


def test_element_is_at_equilibrium_in_its_ground_states(element):
    before = element.chain.v.copy()
    element.pass_ticks(50)
    assert np.abs(element.chain.v - before).max() < 1e-12
    assert (before != DESIGN.D_s1).all()


def test_wrong_clock_is_simulated_by_masses_and_damping():
    """The same waveforms as of a fit's forward model, which scales the step instead."""
    unknowns = Unknowns(DESIGN)
    x = unknowns.mean
    x[unknowns.shared('time_unit')] = 1.01
    shot = Shot(End.LEFT, 1.2, 0.01, 3.0, 0, 0.0, 0.25, np.zeros(2), np.zeros((2, 400)))
    foretold = Forward(unknowns, x, simulated=True).predict(shot, 100.0)[:, 1:]

    file = element_file.Element(unknowns.specimen(x), np.zeros(DESIGN.N), time_unit=1.01)
    time = replace(CHOSEN.settings.time, tick=1.0)
    chain = Chain(file.timed_specimen, 0.25)
    element = Instrument(DESIGN, replace(CHOSEN.settings, time=time), Simulation(chain))
    recorder = element.transducer.record_pulse(
        End.LEFT, ProbeSettings(omega_c=shot.omega_c, A=shot.A, sigma=shot.sigma)
    )
    element.pass_ticks(100)
    assert np.abs(recorder.shot(0.0, 0.0, 0.25).samples - foretold).max() < 1e-12


def test_uniform_substrate_has_rates_too():
    """The ratio of its springs cannot fall below 1, where a fit may pass."""
    unknowns = Unknowns(DESIGN)
    x = unknowns.mean
    x[unknowns.shared('substrate_ratio')] = 1.0
    by_ratio, by_j_0 = unknowns.substrate_rates(x)
    assert np.isfinite(by_ratio).all()
    assert np.abs(by_ratio).max() > 1e3 * np.abs(by_j_0).max()


NIBBLE = rig.first_levels('byte', 4)
OWN = draw_specimen(NIBBLE.design, Scatter(alpha=0.01), 1)


def reads(element, word):
    """Return what is read of a word at rest in an element."""
    rig.pin(element, *element.reader.forecasts.code.walls(word))
    return element.perform(Read()).reading.level


def test_scattered_register_is_read_by_its_twin():
    """By the design's forecasts 7 of 16 words are read; all others are undecodable."""
    element = MemoryElement(NIBBLE, driver=Simulation.build_blank(OWN, NIBBLE.settings.time))
    words = (3, 5, 6, 7, 10, 11, 12, 13, 14)
    assert {reads(element, word) for word in words} == {UNDECODABLE}
    element.adopt_twin(OWN)
    assert {word: reads(element, word) for word in words} == {word: word for word in words}


def test_twin_that_cannot_hold_every_word_is_rejected():
    element = MemoryElement(NIBBLE)
    known = element.reader.forecasts
    with expect_rejection(SettingsError, 'unsupported', 'word'):
        element.adopt_twin(Specimen(NIBBLE.design, stuck=(104,)))
    assert (element.twin, element.reader.forecasts) == (None, known)


def test_twin_lives_no_longer_than_its_element():
    """So that a robot that adopts one after each fit does not keep them all."""
    twin = draw_specimen(load_element('robust_2'), Scatter(alpha=0.01), 1)
    element, known = MemoryElement(load_element('robust_2')), weakref.ref(twin)
    element.adopt_twin(twin)
    del element, twin
    gc.collect()
    assert known() is None


def header_of(element):
    return jazzy.deserialize_message(
        records.build_header(element, '/mlmem', {}), 'std_msgs/msg/String'
    ).data


def test_calibration_verifies_the_forecast(element):
    """The delays of the forecast are those heard, to a time unit, with its planned pulses."""
    steps = PulseCorrection(), PulseCorrection(peak=1.5, times=1.3)
    foretold = replace(
        compute_calibration(MADE, DESIGN, CHOSEN.settings),
        pulse_corrections=PulseCorrections(steps, hash_schedule(CHOSEN.settings)),
    )
    element.forecast = foretold
    outcome = element.perform(Calibrate())
    assert outcome.success
    assert outcome.delays['left'] == pytest.approx(foretold.left.delays, abs=5.0)
    assert outcome.delays['right'] == pytest.approx(foretold.right.delays, abs=5.0)


def test_header_carries_element_forecast_and_twin(element):
    element.forecast = element.calibration
    header = read_header(header_of(element))
    assert (header.made.alpha == MADE.alpha).all()
    assert header.made.design == MADE.design
    assert header.forecast == element.calibration
    register = MemoryElement(NIBBLE)
    register.adopt_twin(OWN)
    text = header_of(register)
    assert (read_header(text).twin.alpha == OWN.alpha).all()
    other = {'twin': encode_value(Specimen(DESIGN))}
    with pytest.raises(DecodeError, match='twin must have the cells and defects of the design'):
        read_header(json.dumps(json.loads(text) | other))
