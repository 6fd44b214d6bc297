# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A twin beside its element: what it tells of a change, after how many reads, and how far off;
and which reads its monitor compares, with which wall.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from mlmem import EchoReceived, Faults, MemoryElement, Read, SetFaults, Write, load_element
from mlmem.element_file import Element
from mlmem.instrument.drivers import Simulation
from mlmem.physics import Scatter, draw_specimen
from mlmem.readers.reading import BLANK, UNDECODABLE
from mlmem_ros.contract.streams import decode_read_shot, encode_read_shot
from mlmem_tools.identification.watching import ResidualMonitor, locate_wall
from mlmem_tools.rig.emulated import RigSensors

CHOSEN = load_element('bits_1')
DESIGN, SETTINGS = CHOSEN.design_and_settings
MADE = draw_specimen(DESIGN, Scatter(alpha=0.01), 0)
NOISE = 1e-5
LEVEL = 1


def compare_read(monitor, pulses, procedure='read'):
    """Return how many reads have been compared after one."""
    for each in pulses:
        monitor.take_shot(each)
    monitor.end_procedure(procedure)
    return monitor.compared


class Worn(Simulation):
    """The element, as sensors show it whose gain may fall, and transducers that may weaken."""

    def __init__(self):
        super().__init__(Simulation.build_blank(MADE, SETTINGS.time).chain)
        self.sensors, self.weaker = RigSensors(), [1.0, 1.0]
        self.rest = None  # of the end that is held

    def advance(self, V_N, drive=None, shake=None, looks=1):
        if drive is not None:
            motion = self.sensors.held(drive.site, drive.motion)
            rest = self.chain.end(drive.site) if self.rest is None else self.rest
            self.rest = rest if len(motion.T) == len(V_N) else None
            weaker = self.weaker[drive.site > 1]
            motion = weaker * (motion - [[rest], [0.0]]) + [[rest], [0.0]]
            drive = replace(drive, motion=motion)
        return self.sensors.measure_ends(super().advance(V_N, drive, shake, looks))


class Bench:
    """An element with a monitor of its twin, which a fit knows to 0.05 % of every cell."""

    def __init__(self):
        error = 1.0 + 5e-4 * np.random.default_rng(1).standard_normal(DESIGN.N)
        known = replace(MADE, alpha_factor=MADE.alpha_factor * error)
        self.twin = Element(known, 5e-4 * MADE.alpha), True
        self.monitor, self.driver = ResidualMonitor(*self.twin), Worn()
        self.element = MemoryElement(CHOSEN, driver=self.driver)
        self.set_faults()
        self.element.perform(Write(LEVEL))
        self.told(1)  # from which the monitor knows where the wall is

    def set_faults(self, **faults):
        self.element.apply(SetFaults(Faults(sensor_noise=NOISE, **faults)))

    def record_read(self):
        """Return the pulses of a read after ten damping times, as they come from a node."""
        self.element.pass_ticks(math.ceil(10.0 / DESIGN.eta / self.element.tick))
        run, heard = self.element.apply(Read()), []
        while run.outcome is None:
            heard += [each for each in self.element.advance(50) if isinstance(each, EchoReceived)]
        return [decode_read_shot(encode_read_shot(self.element, each)) for each in heard[-2:]]

    def told(self, reads=2):
        """Read some times; return what the twin says after each."""
        found = []
        for number in range(self.monitor.compared, self.monitor.compared + reads):
            assert compare_read(self.monitor, self.record_read()) == number + 1
            found.append(self.monitor.last)
        return found


@pytest.fixture(scope='module')
def shared_bench():
    return Bench()


@pytest.fixture
def bench(shared_bench):
    """A bench whose element is healthy again after the test."""
    yield shared_bench
    shared_bench.set_faults()
    shared_bench.driver.sensors, shared_bench.driver.weaker = RigSensors(), [1.0, 1.0]
    shared_bench.element.transducer.assume_equilibrium()


def test_healthy_element_is_as_forecast(bench):
    told = bench.told(3)
    assert [each.text for each in told] == [''] * 3
    assert max(each.chi2 for each in told) < 2.0
    assert max(each.residual.max() for each in told) < 1e-4  # the pulse has 1e-2


@pytest.mark.parametrize('site', [5, 24])
def test_weaker_cell_is_named_after_two_reads(bench, site):
    bench.set_faults(weak_cell=site, weak_factor=0.92)
    told = bench.told()[-1]
    assert told.change.name == 'cell'
    assert told.change.site == pytest.approx(site, abs=1)
    assert told.change.amount == pytest.approx(-0.08, abs=0.02)
    assert told.text.startswith(f'cell {told.change.site:g} has become ')
    assert told.text.endswith(' % weaker since the survey')
    bench.set_faults()
    assert not bench.told()[-1].text


@pytest.mark.parametrize(
    ('name', 'amount'),
    [
        ('eta', pytest.approx(0.2, abs=0.05)),
        ('gain_left', pytest.approx(-0.05, abs=0.01)),
        ('gain_right', pytest.approx(-0.05, abs=0.01)),
        ('drive_left', pytest.approx(-0.1, abs=0.02)),
        ('drive_right', pytest.approx(-0.1, abs=0.02)),
    ],
)
def test_change_is_reported_with_its_amount(bench, name, amount):
    """The echo of an end's own pulse does not show its gain, for the pulse grows as the gain
    falls; the other end does.
    """
    end = int(name.endswith('right'))
    if name == 'eta':
        bench.set_faults(damping_factor=1.2)
    elif name.startswith('drive'):
        bench.driver.weaker[end] = 0.9
    else:
        bench.driver.sensors = RigSensors(gain=(1.0, 0.95) if end else (0.95, 1.0))
        bench.element.transducer.assume_equilibrium()
    change = bench.told()[-1].change
    assert (change.name, change.amount) == (name, amount)


def test_stuck_cell_is_not_taken_for_a_weak_one(bench):
    """No small change of one cell explains its echo; at times its place is told all the same."""
    bench.set_faults(stuck_cell=12)
    told = bench.told()[-1]
    assert 'not as forecast' in told.text or 'cell 12 is not what it was' in told.text


def test_wall_after_a_failed_write_is_not_known():
    """Compared with where it was before, a healthy element would seem to have changed."""
    before, there = float(DESIGN.defect_site(0)), float(DESIGN.defect_site(1))
    assert locate_wall(DESIGN, UNDECODABLE, before, moved=True) is None
    assert locate_wall(DESIGN, UNDECODABLE, before, moved=False) == before  # a stuck cell hides it
    assert locate_wall(DESIGN, 1, before, moved=True) == there
    assert locate_wall(DESIGN, BLANK, before, moved=False) == 0.0


# --- which reads are compared ----------------------------------------------------------------


@pytest.fixture(scope='module')
def pulses(shared_bench):
    """The twin of an element at level 1, and the pulses of a read."""
    return shared_bench.twin, shared_bench.record_read()


@pytest.mark.parametrize(('procedure', 'reads'), [('read', 2), ('write', 1)])
def test_read_after_a_failed_write_is_not_compared(procedure, reads, pulses):
    """A failed read moves nothing, so that what spoils the reads can be told."""
    twin, read = pulses
    monitor = ResidualMonitor(*twin)
    assert {each.level for each in read} == {LEVEL}
    assert compare_read(monitor, read) == 1
    assert not monitor.text
    unclear = [each._replace(level=UNDECODABLE) for each in read]
    assert compare_read(monitor, unclear, procedure) == reads
    assert monitor.compared + monitor.skipped == 2


def test_disturbed_read_is_not_compared(pulses):
    twin, read = pulses
    disturbed = [each._replace(disturbed=True) for each in read]
    assert compare_read(ResidualMonitor(*twin), disturbed) == 0


def test_last_read_of_a_procedure_is_compared(pulses):
    twin, read = pulses
    monitor = ResidualMonitor(*twin)
    earlier = [each._replace(tick=each.tick - 1, level=0) for each in read]
    assert compare_read(monitor, earlier + read) == 1
    assert not monitor.text  # the wall of level 0 would be another one
    assert monitor.skipped == 1
