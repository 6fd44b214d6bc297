# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics: a status for every component, and lasting warnings."""

from types import SimpleNamespace
from unittest.mock import ANY

import numpy as np
import pytest
from robot import Robot, values

from mlmem import Faults, MemoryElement, Reading, SetFaults, SetStrain, Settings
from mlmem.instrument.end import End
from mlmem.loop.timetable import LoopStatistics, SteadyPacer
from mlmem.physics import CASE_II
from mlmem.readers.calibration import Calibration, DelayTable
from mlmem_ros.bag.errors import BagError
from mlmem_ros.bag.queued_writer import WriterStatus
from mlmem_ros.host import State
from mlmem_ros.ros.node import diagnostics
from mlmem_ros.ros.node.diagnostics import ERROR, OK, WARN, Health, Hysteresis, Pace

TICKING = SimpleNamespace(settings=Settings())
"""An element of the default tick, as far as the pace reads it."""

COMPONENTS = (
    'loop', 'material', 'actuator', 'transducer', 'memory', 'faults', 'twin', 'recorder'
)  # fmt: skip


def reported(array):
    """Return the statuses of a report by component."""
    return {status.name.split(': ')[1]: status for status in array.status}


# Hysteresis


def levels(reports, hold=2):
    smoother = Hysteresis(hold)
    return [smoother.smooth_health(Health(level, 'now')).level for level in reports]


def test_warning_stays_for_some_reports():
    assert levels([OK, WARN, OK, OK, OK, OK]) == [OK, WARN, WARN, WARN, OK, OK]


# The reports on the device


@pytest.fixture
def element():
    """A blank device; its calibration is not used."""
    table = DelayTable(tuple(100.0 * (level + 1) for level in range(CASE_II.levels)))
    return MemoryElement(CASE_II, Settings(), Calibration(table, table))


def test_material_report_has_the_energies_of_the_chain(element):
    element.apply(SetStrain(0.02))
    element.advance()
    health = diagnostics.report_material(element)
    assert health.level == OK
    assert health.values['stored_energy'] > health.values['kinetic_energy'] > 0.0
    assert 0.0 < health.values['stability_margin'] < 1.0
    assert health.values['walls'] == 0


def test_reports_change_no_bit_of_the_element(element):
    other = MemoryElement(CASE_II, Settings(), element.calibration)
    for device in (element, other):
        device.apply(SetStrain(0.02))
        device.transducer.fire(End.RIGHT)
    for _ in range(20):
        element.advance()
        for look in diagnostics.ELEMENT_REPORTS.values():
            look(element)
        other.advance()
    assert element.chain.state().tobytes() == other.chain.state().tobytes()


def test_two_walls_at_rest_are_a_warning(element):
    """Active, inactive, active: left by a kink that was not driven on."""
    sites = CASE_II.sites
    between = (sites > 50) & (sites <= 125)
    element.chain.place(np.where(between, CASE_II.D_s1, CASE_II.D_s2))
    health = diagnostics.report_material(element)
    assert health.level == WARN
    assert health.text.startswith('2 walls')
    element.reader.holds_words = True  # and are the content
    assert diagnostics.report_material(element).level == OK
    element.reader.holds_words = False
    element.apply(SetStrain(0.02))
    element.advance()
    assert diagnostics.report_material(element).level == OK  # not while it is driven


def test_fault_that_is_set_is_a_warning(element):
    assert diagnostics.report_faults(element) == Health(OK, 'healthy')
    element.apply(SetFaults(Faults(actuator_offset=0.01, weak_cell=50, weak_factor=0.4, seed=3)))
    health = diagnostics.report_faults(element)
    assert health.level == WARN
    assert health.values == {'actuator_offset': 0.01, 'weak_cell': 50, 'weak_factor': 0.4}
    element.apply(SetFaults(Faults(seed=3)))
    assert diagnostics.report_faults(element).level == OK


# The reports on failures


def session(**changes):
    """Return a recording as far as the report looks at it."""
    values = {
        'path': '/bag', 'state': 'recording', 'messages': 7, 'size': 9, 'queued': 0,
        'dropped': 0, 'error': None,
    }  # fmt: skip
    full = changes.pop('full', False)
    return SimpleNamespace(full=full), WriterStatus(**values | changes)


@pytest.mark.parametrize(
    ('recording', 'level', 'text'),
    [
        ((None, None), OK, 'not recording'),
        (session(), OK, 'recording'),
        (session(full=True), WARN, 'full: the session has ended'),
        (session(full=True, dropped=3), WARN, '3 messages were dropped from the recording'),
        (session(error=BagError('no space left'), dropped=3), ERROR, 'no space left'),
    ],
)
def test_worst_state_of_a_recording_is_reported(recording, level, text):
    current, status = recording
    sessions = SimpleNamespace(state=State.IDLE, current=current, status=status, buffer=None)
    health = diagnostics.report_recorder(SimpleNamespace(sessions=sessions))
    assert (health.level, health.text[: len(text)]) == (level, text)


def test_loop_report_names_failure_and_skipped_ticks():
    statistics, told = LoopStatistics(ticks=10, overruns=2), []
    log = SimpleNamespace(caught=0, warning=told.append)
    loop = SimpleNamespace(
        statistics=statistics, element=TICKING, failure=None, paused=False,
        pacer=SteadyPacer(),
    )  # fmt: skip
    component = Pace(SimpleNamespace(refused=0, held_up='', log=log))
    assert component.health(loop) == Health(WARN, '2 ticks of time were skipped', ANY)
    assert component.health(loop) == Health(OK, 'running', ANY)
    for statistics.overruns in (3, 4, 5, 8):
        component.health(loop)
    skipped = [int(line.split()[0]) for line in told]
    assert skipped == [2, 4, 8]  # one line in the log each time the number has doubled
    loop.paused = True
    assert component.health(loop).text == 'paused'
    statistics.overruns = 9
    assert component.health(loop).values['paused'], 'though the text is a warning'
    loop.failure = RuntimeError('the chain stopped being finite')
    assert component.health(loop) == Health(ERROR, 'the chain stopped being finite', ANY)


def test_rate_counts_the_ticks_of_an_idle_loop(monkeypatch):
    """It sleeps for up to two seconds. Ticks of before the first report are none of its rate."""
    clock = iter([0.0, 1.0, 2.0, 3.0, 4.0])
    monkeypatch.setattr(diagnostics.time, 'monotonic', lambda: next(clock))
    component = Pace(SimpleNamespace(refused=0, held_up='', log=SimpleNamespace(caught=0)))
    statistics = LoopStatistics(ticks=500)
    loop = SimpleNamespace(
        statistics=statistics, paused=False, failure=None, element=TICKING, pacer=SteadyPacer()
    )
    component.health(loop, heard=False)
    component.health(loop, heard=False)  # asleep
    statistics.ticks = 1500  # which a report wakes
    assert component.health(loop).values['rate'] == 500.0
    statistics.ticks = 2000
    assert component.health(loop).values['rate'] == 500.0


@pytest.mark.parametrize(
    ('report', 'level', 'margin', 'expected'),
    [
        ('transducer', 3, 1.2, (WARN, 'a weak echo: 1.2 times the threshold')),
        ('transducer', 3, 1.5, (OK, None)),
        ('transducer', -2, 1.2, (OK, None)),  # reported by the memory
        ('memory', None, None, (OK, 'not read yet')),
        ('memory', -2, 1.2, (WARN, 'between two levels')),
        ('memory', 3, 1.2, (OK, 'level 3')),
    ],
)
def test_weak_or_undecodable_echo_is_a_warning(element, report, level, margin, expected):
    if level is not None:
        element.reading = Reading(
            level, '', End.LEFT, 700.0, 0.9, margin, 100.0, 'between two levels'
        )
    health = diagnostics.ELEMENT_REPORTS[report](element)
    assert (health.level, expected[1] and health.text) == expected


# On a live node


def test_every_component_reports(robot):
    assert robot.write(2)['level'] == 2
    array = robot.next(
        '/diagnostics', lambda array: values(reported(array)['material']).get('walls') == '1'
    )
    found = reported(array)
    assert tuple(found) == COMPONENTS
    assert {'rate', 'lateness_mean', 'lateness_deviation', 'overruns', 'refused'} <= set(
        values(found['loop'])
    )
    material = {key: float(value) for key, value in values(found['material']).items()}
    assert material['stored_energy'] > 0.0
    assert float(values(found['actuator'])['strain']) == pytest.approx(0.0, abs=1e-9)
    assert float(values(found['transducer'])['threshold_margin']) > 1.5
    memory = values(found['memory'])
    assert memory['level'] == '2'
    assert float(memory['level_margin']) > 0.5
    assert float(memory['threshold_margin']) > 1.5
    assert float(memory['confidence']) > 0.3
    assert int(memory['writes']) >= 1
    robot.publish('strain', 1e-4)  # moves no wall, but nobody knows that
    robot.next(
        '/diagnostics',
        lambda array: (
            reported(array)['memory'].message.startswith('unknown since tick')
            and reported(array)['memory'].message.endswith(': strained by hand')
            and reported(array)['memory'].level == WARN
        ),
    )


def test_inactive_node_reports_every_component(start):
    start(name='idle')
    with Robot('/idle', 'idle_robot') as robot:
        robot.next('/diagnostics', lambda a: reported(a)['loop'].level <= WARN)
        robot.change_state('deactivate')
        array = robot.next('/diagnostics', lambda a: reported(a)['loop'].message == 'inactive')
        for name, status in reported(array).items():
            text = {'recorder': 'not recording', 'twin': 'no twin'}.get(name, 'inactive')
            assert (status.level, status.message, status.hardware_id) == (OK, text, '/idle')
