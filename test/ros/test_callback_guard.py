# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a client sends, every request is answered once and the node lives on.

All tests use one node. Each ends with a read that the node has to answer; the last one ends it.
"""

import json
import logging
import signal
import threading
from types import SimpleNamespace

import pytest
import rclpy
from lifecycle_msgs.srv import ChangeState, GetState
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParameters, SetParametersAtomically
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import LoggingSeverity, set_logger_level
from rclpy.serialization import serialize_message
from robot import RELIABLE, Robot, values
from std_srvs.srv import SetBool
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from mlmem_ros.host import ThrottledLog
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.middleware import create_events_executor
from mlmem_ros.ros.node import callback_guard
from mlmem_ros.ros.node.callback_guard import CallbackGuard
from mlmem_ros.ros.node.node import QuickLog
from mlmem_ros.ros.node.run import ENDED
from mlmem_ros.session.data import load_session
from mlmem_ros.session.replay import run_replay


@pytest.fixture(scope='module')
def node(start_shared):
    return start_shared(apart=True)


@pytest.fixture(scope='module')
def client(node):
    with Robot(node.element) as robot:
        yield robot


@pytest.fixture
def robot(node, client):
    yield client
    assert node.running
    assert client.trigger('read')['procedure'] == 'read'


def test_lines_that_nobody_looks_up_have_severities_and_levels_still(capfd):
    log = QuickLog('quick')
    log.info('an event')
    set_logger_level('quick', LoggingSeverity.WARN)
    log.info('not this one')
    log.warning('a refusal')
    log.error('a failure')
    told = capfd.readouterr()
    lines = (told.out + told.err).splitlines()
    assert [(line.split('] ')[0], line.partition('[quick]: ')[2]) for line in lines] == [
        ('[INFO', 'an event'), ('[WARN', 'a refusal'), ('[ERROR', 'a failure'),
    ]  # fmt: skip


@pytest.mark.parametrize('own', [True, False])
def test_a_defect_is_answered_like_a_refusal(own):
    """One of our services answers with a JSON object, one of rclpy's with its text."""

    def broken(request, response):
        raise RuntimeError('broken')

    broken.__module__ = 'mlmem_ros.ros.node.services' if own else 'rclpy.parameter_service'
    sent = []
    service = SimpleNamespace(
        srv_name='/mlmem/request',
        callback=broken,
        send_response=lambda response, header: sent.append(response.result),
    )
    log = ThrottledLog(logging.getLogger())
    CallbackGuard(SimpleNamespace(services=[service]), log).guard_services()
    asked, response = SetParametersAtomically.Request(), SetParametersAtomically.Response()
    service.send_response(service.callback(asked, response), None)
    (told,) = sent
    assert not told.successful
    assert (json.loads(told.reason) if own else told.reason) == (
        {'error': 'broken'} if own else 'broken'
    )
    assert log.caught == 1


@pytest.mark.parametrize('drops', [0, 1, 2, 9])
def test_an_answer_that_the_middleware_drops_is_sent_again(monkeypatch, drops):
    """It blocks for 0.1 s then, and says nothing. Who never matches is given up."""
    monkeypatch.setattr(callback_guard, 'RESEND_DELAYS_S', (0.01, 0.02))
    clock, sent = SimpleNamespace(now=0.0), []
    monkeypatch.setattr(callback_guard, 'time', SimpleNamespace(monotonic=lambda: clock.now))

    def send(response, header):
        waits = len(guard.waiting)  # who ends a node waits for the answer
        sent.append((response.success, header, waits, threading.current_thread()))
        clock.now += 0.1 if len(sent) <= drops else 1e-3

    service = SimpleNamespace(
        srv_name='/mlmem/request', callback=lambda _, response: response, send_response=send
    )
    guard = CallbackGuard(SimpleNamespace(services=[service]), ThrottledLog(logging.getLogger()))
    guard.guard_services()
    response = SetBool.Response(success=True)
    service.send_response(service.callback(SetBool.Request(), response), 'header')
    wait_until(lambda: not guard.waiting, 'the answer')
    times = 1 + min(drops, 2)
    assert [what[:3] for what in sent] == [(True, 'header', 1)] * times
    me = threading.current_thread()  # which is the loop's, and must not wait
    assert [thread is me for *_, thread in sent] == [n == 0 for n in range(times)]


@pytest.mark.parametrize('executor', [SingleThreadedExecutor, create_events_executor])
def test_a_client_ignores_a_second_answer(context, executor):
    """Rather twice than never: what was slow may not have been dropped."""
    node = rclpy.create_node('twice', context=context, use_global_arguments=False)
    answered = []

    def answer(request, response):
        answered.append(request.data)
        response.success = request.data
        return response

    service = node.create_service(SetBool, '~/answer', answer)
    send = service.send_response

    def twice(response, header):
        send(response, header)
        send(response, header)

    service.send_response = twice
    client = node.create_client(SetBool, '/twice/answer')
    spins = executor(context=context)
    spins.add_node(node)
    assert client.wait_for_service(30.0)
    for wanted in (True, False, True):
        answer_to_come = client.call_async(SetBool.Request(data=wanted))
        spins.spin_until_future_complete(answer_to_come, 30.0)
        assert answer_to_come.result().success == wanted
    assert answered == [True, False, True]
    spins.shutdown()
    node.destroy_node()


def test_nothing_is_read_behind_a_request_of_another_binding(monkeypatch):
    """nanobind, to which rclpy may move, puts no pointer there: to follow it ends the node."""

    class Header:
        """Of C's size, but not of pybind11's making."""

        __slots__ = ('first',)

    header = Header()
    header.first = 'no pointer to a structure'
    monkeypatch.setattr(
        callback_guard, 'rclpy_implementation', SimpleNamespace(rmw_service_info_t=Header)
    )
    monkeypatch.setattr(callback_guard, 'ctypes', None)
    node = SimpleNamespace(
        resolve_service_name=lambda name: f'/mlmem/{name}',
        get_subscriptions_info_by_topic=lambda name, no_mangle: [],
        get_publishers_info_by_topic=lambda name, no_mangle: [],
    )
    first, second = (callback_guard.Requester(node, 'read', header) for _ in range(2))
    assert first.key != second.key
    assert not first.gone


def test_nodes_whose_names_are_not_known_yet_are_several(monkeypatch):
    """In one program, in the moment after they have begun: each was taken for the first one, and
    refused as busy instead of waiting for its turn.
    """
    monkeypatch.setattr(callback_guard, '_read_writer_id', lambda header: header)
    ends = []
    node = SimpleNamespace(
        resolve_service_name=lambda name: f'/mlmem/{name}',
        get_subscriptions_info_by_topic=lambda name, no_mangle: ends,
        get_publishers_info_by_topic=lambda name, no_mangle: [],
    )

    def keys(*names):
        found = []
        for number, name in enumerate(names):
            header = bytes([*range(12), 0, 0, number, 3])
            ends.append(SimpleNamespace(endpoint_gid=header, node_name=name, node_namespace='/'))
            found.append(callback_guard.Requester(node, 'read', header).key)
        ends.clear()
        return found

    unknown = '_NODE_NAME_UNKNOWN_'  # as Fast DDS has it in a robot's first moments
    assert len(set(keys(unknown, unknown, 'robot'))) == 3
    assert len(set(keys('robot', 'robot', 'arm'))) == 2


def state(robot):
    return robot.response(
        robot.send('get_state', GetState.Request(), GetState)
    ).current_state.label


def change(robot, **transition):
    request = ChangeState.Request()
    for name, value in transition.items():
        setattr(request.transition, name, value)
    return robot.response(robot.send('change_state', request, ChangeState)).success


ACTIVE_CAN = {4, 7}
"""Transitions of an active node: deactivate, and shut down."""


def test_transitions_that_are_not_available_are_refused(robot, node):
    for number in sorted({*range(20), *range(60, 70), 127, 128, 254, 255} - ACTIVE_CAN):
        assert not change(robot, id=number), number
    assert not change(robot, label='activate')
    assert not change(robot, label='no such transition')
    assert state(robot) == 'active'
    assert 'Traceback' not in node.output


def test_a_parameter_of_no_known_type_is_refused(robot):
    for kind in (10, 200, 255):
        odd = Parameter(name='target_level', value=ParameterValue(type=kind))
        good = Parameter(name='target_level', value=ParameterValue(type=2, integer_value=1))
        request = SetParameters.Request(parameters=[odd, good])
        answer = robot.response(robot.send('set_parameters', request, SetParameters))
        assert [result.successful for result in answer.results] == [False, False]
        assert str(kind) in answer.results[0].reason
        request = SetParametersAtomically.Request(parameters=[good, odd])
        answer = robot.response(
            robot.send('set_parameters_atomically', request, SetParametersAtomically)
        )
        assert not answer.result.successful
    assert robot.get('target_level') == -1


@pytest.mark.parametrize(
    ('path', 'why'),
    [
        ('~nosuchuser/x', 'home'),
        ('/', 'folder'),
        ('.', 'folder'),
        ('..', 'folder'),
        ('x' * 300, 'too long'),
    ],
)
@pytest.mark.parametrize('parameter', ['record.path', 'state.path'])
def test_an_impossible_path_is_refused_when_it_is_set(robot, parameter, path, why):
    result = robot.try_set(parameter, path)
    assert not result.successful
    assert result.reason.startswith(parameter)
    if parameter == 'record.path':
        assert why in result.reason
        assert robot.get('record.path') == ''


def test_one_of_many_requests_to_record_succeeds(robot, tmp_path):
    robot.set(record__path=str(tmp_path / 'session'))
    for on in (True, False):
        sent = [robot.send('record', SetBool.Request(data=on)) for _ in range(20)]
        answers = [robot.answer(future) for future in sent]
        (done,) = [answer for answer in answers if answer.success]
        assert done == {'recording': on, 'path': str(tmp_path / 'session')}
        why = 'busy: recording into' if on else 'nothing is being recorded'
        assert all(why in answer['error'] for answer in answers if not answer.success)
    assert [path.name for path in tmp_path.iterdir()] == ['session']
    robot.set(record__path='')


def test_views_are_turned_on_while_a_recording_begins(robot, tmp_path):
    robot.set(record__path=str(tmp_path / 'session'))
    begun = robot.send('record', SetBool.Request(data=True))
    robot.set(record__views=True)
    assert robot.answer(begun).success
    assert robot.trigger('read').success
    assert robot.record(False).success
    assert run_replay(load_session(tmp_path / 'session')).exact
    robot.set(record__views=False, record__path='')


def test_every_step_is_answered_although_time_runs(robot):
    sent = [robot.send('step') for _ in range(50)]
    answers = [robot.answer(future) for future in sent]
    assert len(answers) == 50
    assert all('only while paused' in answer['error'] for answer in answers)


def test_messages_that_cannot_be_decoded_do_no_harm(robot):
    """A text that is not UTF-8, a length beyond the end, a truncated message."""
    message = JointTrajectory()
    message.header.frame_id = 'frame'
    good = serialize_message(message)
    publisher = robot.node.create_publisher(
        JointTrajectory, robot.name('strain_trajectory'), RELIABLE
    )
    robot.wait(publisher.get_subscription_count, 'a subscriber')
    for bad in (
        good.replace(b'frame', b'\xff\xfe\xff\xfe\xff'),
        good[:9],
        good[:4] + b'\xff' * 40,
    ):
        publisher.publish(bad)
    assert robot.trigger('read').success


def test_a_flood_of_bad_messages_leaves_a_short_log(robot, node):
    before = len(node.output)
    long = JointTrajectory(joint_names=['j' * 5_000_000])
    for _ in range(3):
        robot.send_message('strain_trajectory', long)

    def many_are_refused(array):
        for _ in range(200):  # again: of those that come while a busy node waits, it sees the last
            robot.publish('strain', float('nan'))
        return int(values(array.status[0]).get('refused', 0)) > 1000

    for _ in range(2000):
        robot.publish('strain', float('nan'))
    assert robot.trigger('read').success
    assert robot.latest('/diagnostics', many_are_refused)
    assert len(node.output) - before < 20_000


def test_a_trajectory_with_malformed_points_is_refused(robot, node):
    message = JointTrajectory(joint_names=['substrate'])
    message.points = [JointTrajectoryPoint(positions=[0.0, 0.0]), JointTrajectoryPoint()]
    robot.send_message('strain_trajectory', message)
    robot.wait(lambda: 'one position' in node.output, 'the refusal in the log')


def test_sim_time_is_not_switched_while_time_runs(robot):
    result = robot.try_set('use_sim_time', True)
    assert not result.successful
    assert 'not active' in result.reason
    assert robot.try_set('use_sim_time', False).successful  # as in a dump that is loaded


def test_ctrl_c_ends_it_after_all_that(node):
    node.signal(signal.SIGINT)
    assert node.exit_status() == ENDED
    assert 'Traceback' not in node.output
