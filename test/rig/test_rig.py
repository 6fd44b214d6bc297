# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""An element behind a line gives the same bits as a local one, whatever the line does to frames.

The rig plays by its own sample clock, and samples carry its numbers; no time of the line enters.
"""

import dataclasses
import random

import numpy as np
import pytest
from lines import LocalDriver, TamperedLine, driven, emulated
from suite import sampled

from mlmem import (
    End,
    Erase,
    Faults,
    Kick,
    MemoryElement,
    Read,
    Refused,
    SetFaults,
    SetStrain,
    Settings,
    SettingsError,
    Write,
    load_element,
    snapshot,
)
from mlmem.element_file import use_kicks
from mlmem.physics import CASE_II
from mlmem.settings import ScaleSettings, TimeSettings
from mlmem_ros.rig.frames import encode_frame
from mlmem_tools.rig.emulated import RigSensors

KICKED = use_kicks(load_element('case_2')).settings
"""Those of the element when a write takes a tenth of the ticks."""


class Late(LocalDriver):
    """A local simulation whose samples arrive some ticks late."""

    def __init__(self, lag):
        super().__init__()
        self.lag = lag
        steps = lag * round(Settings().time.tick / self.dt)
        self._line = super().advance(np.zeros(steps * len(self.nodes)))
        self._last = self._line[:, -1]

    def advance(self, V_N, held_cell=None, shake=None, ticks=1):
        line = np.concatenate((self._line, super().advance(V_N, held_cell)), axis=1)
        arrived, self._line = np.split(line, [line.shape[1] - self._line.shape[1]], axis=1)
        self._last, self.V_N = arrived[:, -1], float(V_N[-1])
        return arrived

    def end(self, site):
        return float(self._last[0 if site == 1 else 1])


def told(element):
    """Return the outcomes of commands as values that can be compared to the bit."""
    story = Write(1), Read('both'), Erase()
    return [dataclasses.astuple(element.perform(command)) for command in story]


@pytest.fixture(scope='module')
def expected():
    """The outcomes of a local element with the same lag."""
    found = told(MemoryElement(CASE_II, driver=Late(5)))
    assert all(outcome[1] for outcome in found)
    return found


def test_kick_after_an_erase_begins_where_the_end_is():
    """The samples of a line a hundred ticks late still tell where the end was before."""
    element = MemoryElement(use_kicks(load_element('case_2')), driver=Late(100))
    for level in (1, 0):
        written = element.perform(Write(level))
        assert written.success, written.error


def lossy(seed, share=0.1):
    """Return a function that loses, damages, doubles or delays frames."""
    chance, held = random.Random(seed), []

    def tamper(frame):
        data = encode_frame(*frame)
        kind = chance.random() / share
        if frame.kind == 1 or kind > 4.0:
            return data + b''.join(held.pop() for _ in held[:])
        if kind < 1.0:
            return b''
        if kind < 2.0:
            return data[:-3] + b'\0' + data[-2:]
        if kind < 3.0:
            return data + data
        held.append(data)
        return b'mR' * 3

    return tamper


@pytest.mark.parametrize('seed', sampled(range(20), lambda seed: seed == 0))
def test_procedures_over_a_lossy_line_give_the_same_bits(expected, seed):
    """Whatever is lost, damaged, repeated and out of order."""
    line = TamperedLine(emulated(), lossy(seed), lossy(seed + 100))
    element = driven(line, address='tcp://nowhere:1?lead=0.01&patience=10')
    assert element.driver.lag == 5  # 10 ms ahead
    assert told(element) == expected
    assert line.rig.chain.configuration[0] < CASE_II.D_barrier  # blank, as was read
    health = element.driver.health()
    assert health['asked_again'] > 20
    assert health['dropped_frames'] > 20
    assert health['skipped_bytes'] > 20
    assert health['missed_samples'] == 0


def test_rig_counts_in_its_own_units():
    """Micrometres from its own zero, as single floats: the delay is the same."""
    rig = emulated(KICKED, sensors=RigSensors(1e-4, (1250.0, -77.5)), numbers='<f4')
    element = driven(TamperedLine(rig), KICKED)
    assert element.transducer.measure_rest(End.RIGHT) == pytest.approx(CASE_II.D_s1, rel=1e-6)
    assert element.perform(Write(3)).success
    reading = element.perform(Read()).reading
    assert reading.level == 3
    assert reading.delay == pytest.approx(element.calibration.left.delays[3], abs=2.0)
    element.apply(SetStrain(0.01))
    while element.actuator.is_moving:
        element.advance()
    assert pytest.approx(2.25) == rig.chain.V_N
    assert element.driver.force() is not None


def test_rig_without_an_actuator_is_written_by_kicks():
    line = TamperedLine(emulated(KICKED, actuator=False))
    element = driven(line, KICKED)
    assert not element.settings.actuator.present
    for command in (Write(5), Write(2), Erase()):
        outcome = element.perform(command)
        assert outcome.success, outcome.error
    element.perform(Kick(KICKED.kick.wall_speeds[3]))
    assert element.perform(Read()).level == 3
    assert line.rig.chain.V_N == 0.0
    with pytest.raises(Refused) as refused:
        element.apply(SetStrain(0.01))
    assert (refused.value.code, refused.value.field) == ('unsupported', 'actuator.present')
    with pytest.raises(SettingsError, match=r'write\.method must be kick or auto'):
        driven(TamperedLine(emulated(actuator=False)))  # whose settings write by strain


@pytest.mark.parametrize('number', [1, 3])
def test_echo_across_a_break_is_not_used(number):
    """If the rig runs dry during a read, the probe is repeated and no delay is shifted."""
    rig = emulated(KICKED)
    element = driven(TamperedLine(rig), KICKED)
    transducer, fired, breaks = element.transducer, [], [number]
    element.perform(Write(3))
    reading = element.perform(Read('left')).reading

    def run_dry_once():
        listening = len(transducer.detectors) == 2 and not transducer.is_driving
        if breaks and listening and transducer.detectors[End.LEFT].time > 100.0 * number:
            breaks.pop()
            rig._hold_set_points(7)

    fire = transducer.fire_probe
    transducer.fire_probe = lambda *given: (fired.append(given), fire(*given))[1]
    element.apply(Read('left'))
    while element.procedure:
        run_dry_once()
        element.advance()
    assert len(fired) == 4  # both ends, twice
    assert element.reading.delay == pytest.approx(reading.delay, abs=2.0)


def test_command_that_needs_a_simulation_is_rejected():
    element = driven(TamperedLine(emulated(KICKED)), KICKED)
    with pytest.raises(Refused, match='simulated'):
        _ = element.chain
    with pytest.raises(Refused, match='stuck_cell'):
        element.apply(SetFaults(Faults(stuck_cell=7)))
    element.apply(SetFaults(Faults(sensor_noise=1e-6)))  # of our own ears
    assert element.perform(Write(1)).reading.level == 1


def test_snapshot_keeps_calibration_element_its_content():
    rig = emulated()
    element = driven(TamperedLine(rig))
    left = dataclasses.replace(element.calibration.left, blank=9e3)
    element.calibration = dataclasses.replace(element.calibration, left=left)
    assert element.perform(Write(1)).success
    kept = snapshot.take_snapshot(element)
    assert kept['chain'] is None
    again = driven(TamperedLine(rig))  # which lets go of the first line
    snapshot.restore_snapshot(again, kept)
    assert again.calibration == element.calibration
    assert again.statistics == element.statistics
    assert again.reading is None  # until an echo tells
    assert again.perform(Read()).reading.level == 1


@pytest.mark.parametrize(
    ('settings', 'field'),
    [
        (Settings(time=TimeSettings(tick=30.0)), r'time\.tick'),
        (Settings(scale=ScaleSettings(time=2e-4)), r'scale\.time'),
    ],
)
def test_settings_that_do_not_fit_the_rig_are_rejected(settings, field):
    line = TamperedLine(emulated())
    with pytest.raises(ValueError, match=f'^{field}'):
        driven(line, settings)
    assert line.closed


def test_noise_of_sensors_has_its_standard_deviation():
    noisy = RigSensors(noise=1e-3, seed=1).measure_ends(np.zeros((2, 4000)))
    assert noisy.std() == pytest.approx(1e-3, rel=0.05)
