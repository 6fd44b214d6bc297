# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Diagnostics: a status for every component, and lasting warnings."""

from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import ANY

import numpy as np
import pytest
from diagnostic_msgs.msg import DiagnosticStatus
from robot import values

from mlmem import Faults, MemoryElement, Reading, SetFaults, SetStrain, Settings
from mlmem.instrument.end import End
from mlmem.loop.timetable import LoopStatistics, SteadyPacer
from mlmem.physics import CASE_II
from mlmem.readers.calibration import Calibration, DelayTable
from mlmem.settings import RegisterSettings
from mlmem_ros.bag.errors import BagError
from mlmem_ros.contract.topics import ERROR, OK, WARN, Status
from mlmem_ros.ros.node import diagnostics
from mlmem_ros.ros.node.diagnostics import Pace


def reported(array):
    """Return the statuses of a report by component."""
    return {status.name.split(': ')[1]: status for status in array.status}


@pytest.fixture
def element():
    """A blank device; its calibration is not used."""
    table = DelayTable(tuple(100.0 * (level + 1) for level in range(CASE_II.levels)))
    return MemoryElement(CASE_II, Settings(), Calibration(table, table))


def test_two_walls_at_rest_are_a_warning(element):
    """Active, inactive, active: left by a kink that was not driven on."""
    sites = CASE_II.sites
    between = (sites > 50) & (sites <= 125)
    element.chain.place(np.where(between, CASE_II.D_s1, CASE_II.D_s2))
    health = diagnostics.report_material(element)
    assert health.severity == WARN
    assert health.text.startswith('2 walls')
    one_wall = element.settings
    element.settings = replace(one_wall, register=RegisterSettings(spacing=1))
    assert diagnostics.report_material(element).severity == OK  # they are the content
    element.settings = one_wall
    element.apply(SetStrain(0.02))
    element.advance()
    assert diagnostics.report_material(element).severity == OK  # not while it is driven


def test_fault_that_is_set_is_a_warning(element):
    assert diagnostics.report_faults(element) == Status(OK, 'healthy')
    element.apply(SetFaults(Faults(actuator_offset=0.01, weak_cell=50, weak_factor=0.4, seed=3)))
    health = diagnostics.report_faults(element)
    assert health.severity == WARN
    assert health.values == {'actuator_offset': 0.01, 'weak_cell': 50, 'weak_factor': 0.4}
    element.apply(SetFaults(Faults(seed=3)))
    assert diagnostics.report_faults(element).severity == OK


@pytest.mark.parametrize(
    ('changes', 'level', 'word'),
    [
        (None, OK, 'not recording'),
        ({}, OK, 'recording'),
        ({'full': True}, WARN, 'full'),
        ({'full': True, 'dropped': 3}, WARN, '3 messages were dropped'),
        ({'error': BagError('no space left'), 'dropped': 3}, ERROR, 'no space left'),
    ],
)
def test_worst_state_of_a_recording_is_reported(changes, level, word):
    healthy = {'path': '/bag', 'state': 'recording', 'messages': 7, 'size': 9, 'queued': 0}
    healthy |= {'full': False, 'dropped': 0, 'error': None}
    recording = None if changes is None else SimpleNamespace(**healthy | changes)
    sessions = SimpleNamespace(current=recording, buffer=None)
    health = diagnostics.report_recorder(SimpleNamespace(sessions=sessions))
    assert health.severity == level
    assert health.text.startswith(word)


def test_loop_report_names_failure_and_skipped_ticks():
    warnings = []
    log = SimpleNamespace(caught=0, refusals=0, warning=warnings.append)
    loop = SimpleNamespace(
        statistics=LoopStatistics(ticks=10, overruns=2),
        element=SimpleNamespace(settings=Settings()),
        failure=None,
        is_paused=False,
        pacer=SteadyPacer(),
    )
    report = Pace(SimpleNamespace(held_up='', log=log))
    health = report.report_health(loop)
    assert health == Status(WARN, '2 ticks of time were skipped', ANY)
    factor = health.values['real_time_factor'] / health.values['rate']
    assert factor == pytest.approx(Settings().tick_seconds)
    assert report.report_health(loop) == Status(OK, 'running', ANY)
    for loop.statistics.overruns in (3, 4, 5, 8):
        report.report_health(loop)
    skipped = [int(line.split()[0]) for line in warnings]
    assert skipped == [2, 4, 8]  # one line in the log each time the number has doubled
    loop.is_paused = True
    assert report.report_health(loop).text == 'paused'
    loop.statistics.overruns = 9
    assert report.report_health(loop).values['paused'], 'though the text is a warning'
    loop.failure = RuntimeError('the chain stopped being finite')
    assert report.report_health(loop) == Status(ERROR, 'the chain stopped being finite', ANY)


@pytest.mark.parametrize(
    ('report', 'level', 'margin', 'expected', 'word'),
    [
        ('transducer', 3, 1.2, WARN, '1.2 times the threshold'),
        ('transducer', 3, 1.5, OK, ''),
        ('transducer', -2, 1.2, OK, ''),  # reported by the memory
        ('memory', None, None, OK, 'not read yet'),
        ('memory', -2, 1.2, WARN, 'between two levels'),
        ('memory', 3, 1.2, OK, 'level 3'),
    ],
)
def test_weak_or_undecodable_echo_is_a_warning(element, report, level, margin, expected, word):
    if level is not None:
        element.reading = Reading(
            level, '', End.LEFT, 700.0, 0.9, margin, 100.0, 'between two levels'
        )
    health = diagnostics.ELEMENT_REPORTS[report](element)
    assert health.severity == expected
    assert word in health.text


def test_every_component_reports(robot):
    assert robot.write(2)['level'] == 2
    array = robot.next(
        '/diagnostics', lambda array: values(reported(array)['material']).get('walls') == '1'
    )
    found = {name: values(status) for name, status in reported(array).items()}
    assert ' '.join(found) == 'loop material actuator transducer memory faults recorder'
    loop = {'rate', 'lateness_mean', 'lateness_deviation', 'overruns', 'refused'}
    assert loop <= found['loop'].keys()
    for component, name, low in (
        ('material', 'stored_energy', 0.0),
        ('transducer', 'threshold_margin', 1.5),
        ('memory', 'level_margin', 0.5),
        ('memory', 'threshold_margin', 1.5),
        ('memory', 'confidence', 0.3),
        ('memory', 'writes', 0.5),
    ):
        assert float(found[component][name]) > low, name
    assert found['memory']['level'] == '2'
    assert float(found['actuator']['strain']) == pytest.approx(0.0, abs=1e-9)
    robot.publish('strain', data=1e-4)  # moves no wall, but nobody knows that
    robot.next_status(
        'memory',
        lambda memory: memory.level == b'\1' and memory.message.endswith(': strained by hand'),
    )


def test_inactive_node_reports_every_component(robot):
    robot.change_state('deactivate')
    array = robot.next('/diagnostics', lambda a: reported(a)['loop'].message == 'inactive')
    for name, status in reported(array).items():
        text = 'not recording' if name == 'recorder' else 'inactive'
        found = status.level, status.message, status.hardware_id
        assert found == (DiagnosticStatus.OK, text, robot.element)
