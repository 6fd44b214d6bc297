# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The managed node: its transitions, its saved content, what it prepares, and its log."""

import logging
import re
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from concurrent.futures import TimeoutError as FuturesTimeout
from contextlib import nullcontext
from types import SimpleNamespace

import pytest
from nodes import QUICK, SOON, element_file, end_node
from robot import Robot

from mlmem.physics import CASE_II
from mlmem_ros import standalone
from mlmem_ros.host import Host, state_file
from mlmem_ros.ros.node import starting

BY_HAND = {'autostart': False}


def test_managed_node_passes_through_its_states(start):
    start(BY_HAND)
    with Robot() as robot:
        assert robot.state == 'unconfigured'
        robot.set(target_level=1)
        for service in ('write', 'read', 'erase', 'calibrate', 'abort', 'step'):
            assert 'inactive' in robot.trigger(service)['error']
        tested = robot.response(robot.send('self_test'))
        assert (tested.passed, len(tested.status)) == (b'\0', 1)
        assert 'inactive' in tested.status[0].message
        robot.change_state('configure')
        assert 'inactive' in robot.trigger('read')['error']
        robot.change_state('activate')
        assert robot.state == 'active'
        assert robot.write(1)['level'] == 1
        robot.change_state('deactivate')
        assert 'inactive' in robot.trigger('read')['error']
        robot.change_state('activate')
        assert robot.trigger('read')['level'] == 1  # held in between
        robot.change_state('deactivate', 'cleanup')
        assert robot.state == 'unconfigured'


def test_element_is_changed_only_while_unconfigured(start):
    start(BY_HAND | {'element': 'bits_4', 'write.method': 'strain'})
    with Robot() as robot:
        robot.change_state('configure')
        before = robot.get('element')
        assert 'unconfigured' in robot.try_set('element', 'bits_2').reason
        assert robot.get('element') == before
        robot.change_state('cleanup')
        robot.set(element='bits_2')
        robot.change_state('configure')
        assert not robot.try_set('target_level', 4).successful
        robot.set(target_level=3)
        robot.change_state('cleanup')
        short = element_file('bits_2', {'design.N': 60})  # shorter than a level and the tail
        assert 'N - tail' in robot.try_set('element', short).reason
        robot.set(element='case_2')
        robot.change_state('configure')


def test_deactivation_during_a_write_releases_the_strain(start):
    start({'write.method': 'strain', 'scale.time': 4e-4, 'publish.joint_states_every': 10})
    with Robot() as robot:
        written = robot.begin_strained_write(3)
        robot.change_state('deactivate')
        assert 'aborted' in robot.answer(written)['error']
        robot.change_state('activate')
        assert robot.next('joint_states').position[0] == 0.0
        robot.set(time__speed=40.0)
        assert robot.write(0)['level'] == 0


def test_content_survives_the_node(start, refused, tmp_path):
    file = tmp_path / 'states' / 'element.json'
    keeping = {**QUICK, 'state.path': str(file)}
    walls = []
    for level in (2, None):
        node = start(keeping)
        with Robot() as robot:
            assert level is None or robot.write(level)['level'] == level
            assert robot.trigger('read')['level'] == 2  # which waits until the wall is at rest
            walls.append(list(robot.next('wall').data))
        end_node(node)
    assert walls[1] == pytest.approx(walls[0], abs=0.01)
    other = refused({**keeping, 'design.gamma': -1e-4}, warned=True)
    assert f'{file} does not belong to this design' in other
    file.write_text('{"format"')
    assert 'damaged' in refused(keeping)


def test_content_is_saved_at_intervals(start, tmp_path):
    """Also what changes without a write: here the number of ticks."""
    file = tmp_path / 'element.json'
    start({'state.path': str(file), 'state.interval': 0.2})
    with Robot() as robot:
        assert robot.write(0)['level'] == 0
        ticks = state_file.load_snapshot(file)['ticks']
        robot.wait(lambda: state_file.load_snapshot(file)['ticks'] > ticks, 'a later state')
    assert state_file.load_snapshot(file)['reading']['level'] == 0


def test_design_that_fails_its_check_is_rejected_or_named(start):
    """The gradient is weak: the lattice may stop the wall, but a calibration works."""
    node = start(BY_HAND | {'element': 'case_2', 'design.check': 'refuse'})
    with Robot() as robot:
        robot.set(element=element_file('case_2', {'design.gamma': -6e-5}))
        assert not robot.response(robot.request_transition('configure')).success
        assert 'cannot configure: the design fails its check (peierls_nabarro' in node.output
        assert not robot.try_set('design.check', 'perhaps').successful
        robot.set(design__check='warn')
        robot.change_state('configure')
        assert 'design check: peierls_nabarro' in node.output


@pytest.fixture
def slow_build(monkeypatch):
    """Let a device take a time to build, as with a cold cache; return what lets it go on."""
    built, go_on = Host.build, threading.Event()

    def build(*arguments):
        assert go_on.wait(SOON)
        return built(*arguments)

    monkeypatch.setattr(Host, 'build', build)
    yield go_on
    go_on.set()


def test_preparing_node_answers_get_state_at_once(start, slow_build):
    """nav2's lifecycle manager waits 5 s for the state; kernels take longer to compile."""
    start({'autostart': False})
    with Robot() as robot:
        configured = robot.request_transition('configure')
        begun = time.monotonic()
        assert robot.state == 'unconfigured'
        assert time.monotonic() - begun < 5.0
        assert not configured.done()
        slow_build.set()
        assert robot.response(configured).success
        assert robot.state == 'inactive'


def test_request_to_a_preparing_node_waits(start, slow_build, capfd):
    """Longer than its time-out, and says what it waits for."""
    with standalone(patience=SOON) as memory, ThreadPoolExecutor() as threads:
        starting = threads.submit(start)
        read = memory.read(timeout=4.0)
        with pytest.raises(FuturesTimeout):
            read.result(8.0)
        slow_build.set()
        assert read.wait().level == -1
        starting.result()
    assert 'read waits for /mlmem: preparing the device' in capfd.readouterr().err


@pytest.mark.parametrize('cached', [True, False])
@pytest.mark.parametrize('fails', [False, True])
def test_preparation_is_reported_until_it_ends(monkeypatch, caplog, cached, fails):
    """Only a compilation is logged."""
    monkeypatch.setattr(starting, 'is_kernel_cached', lambda *_: cached)
    host = SimpleNamespace(preparing='')
    node = SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
    with (
        caplog.at_level('INFO'),
        pytest.raises(RuntimeError) if fails else nullcontext(),
        starting.report_preparation(node, host, CASE_II, 'pefrl'),
    ):
        assert host.preparing.startswith('preparing' if cached else 'compiling')
        if fails:
            raise RuntimeError
    assert host.preparing == ''
    words = [] if cached else ['compiling', 'compiled'][: 1 if fails else 2]
    assert [line.split()[0] for line in caplog.messages[: len(words)]] == words
    assert bool(caplog.messages) != cached


def test_log_lists_transitions_settings_and_rejections(start):
    node = start(name='told')
    with Robot('/told') as robot:
        robot.set(time__speed=2.0, faults__seed=3)
        assert not robot.try_set('element', 'bits_1').successful
        assert not robot.answer(robot.ask('write', level=9)).success
        assert not robot.answer(robot.ask('write')).success
        assert not robot.trigger('step').success
        robot.change_state('deactivate', 'cleanup')
        assert not robot.trigger('read').success
    others = re.compile('preparing|ready|.* ticks of time were skipped')  # on a loaded machine
    lines = [line.partition(' [told]: ')[::2] for line in node.output.splitlines()]
    kinds = [(kind, text.partition(':')[0]) for kind, text in lines if not others.match(text)]
    assert kinds == [
        ('[INFO]', 'active'),
        ('[INFO]', 'set time.speed = 2.0'),
        ('[INFO]', 'set faults.seed = 3'),
        ('[WARN]', 'a parameter refused'),
        ('[WARN]', 'write refused'),
        ('[WARN]', 'request refused'),
        ('[WARN]', 'step refused'),
        ('[INFO]', 'inactive'),
        ('[INFO]', 'unconfigured'),
        ('[WARN]', 'read refused'),
    ]
