# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Whatever a client sends, every request is answered once and the node lives on.

Tests with a robot use one node. Each ends with a read that the node has to answer; the last one
ends it.
"""

import re
import signal
import subprocess
import time
from contextlib import ExitStack
from pathlib import Path
from types import SimpleNamespace

import pytest
from lifecycle_msgs.msg import Transition
from nodes import program
from rcl_interfaces.msg import Parameter, ParameterValue
from rcl_interfaces.srv import SetParametersAtomically
from rclpy.serialization import serialize_message
from robot import Robot
from std_srvs.srv import Trigger
from suite import TIMEOUT_S
from trajectory_msgs.msg import JointTrajectory

from mlmem_ros import MemoryClient, NoAnswer, standalone
from mlmem_ros.host import ThrottledLog, store
from mlmem_ros.ros.client.client import wait_until
from mlmem_ros.ros.node import callback_guard
from mlmem_ros.ros.node.callback_guard import CallbackGuard
from mlmem_ros.ros.node.run import ENDED, GuardedExecutor


@pytest.fixture(scope='module')
def memory(start_shared, tmp_path_factory):
    """A node in a process of its own, whose output shows every traceback, and which serves its
    clients longer than itself.
    """
    state = tmp_path_factory.mktemp('lasting') / 'state.json'
    return start_shared({'linger': 600.0, 'state.path': str(state)}, apart=True)


@pytest.fixture
def answering(memory):
    """A robot; after each test the node still answers it."""
    with Robot(memory.element) as robot:
        yield robot
        assert memory.running
        assert robot.trigger('read')['procedure'] == 'read'


@pytest.mark.parametrize(
    ('module', 'reason'),
    [
        ('mlmem_ros.ros.node.services', '{"error": "broken", "error_code": "other"}'),
        ('rclpy.parameter_service', 'broken'),
    ],
)
def test_defect_in_a_callback_is_answered_with_an_error(module, reason):
    """One of our services answers with a JSON object, one of rclpy's with its text."""

    def broken(request, response):
        raise RuntimeError('broken')

    broken.__module__ = module
    results = []
    service = SimpleNamespace(
        srv_name='/mlmem/request',
        callback=broken,
        send_response=lambda response, header: results.append(response.result),
    )
    log = ThrottledLog(lambda *_: None)
    CallbackGuard(SimpleNamespace(services=[service]), log).guard_services()
    request, response = SetParametersAtomically.Request(), SetParametersAtomically.Response()
    service.send_response(service.callback(request, response), None)
    assert [(result.successful, result.reason) for result in results] == [(False, reason)]
    assert log.caught == 1


@pytest.mark.parametrize('drops', [0, 1, 2, 9])
def test_dropped_answer_is_sent_again_to_its_own_client(monkeypatch, drops):
    """The middleware blocks for 0.1 s when it drops one. A second request comes in between."""
    monkeypatch.setattr(callback_guard, 'RESEND_DELAYS_S', (0.01, 0.02))
    clock, sent = SimpleNamespace(now=0.0), {'first': [], 'second': []}
    monkeypatch.setattr(callback_guard, 'time', SimpleNamespace(monotonic=lambda: clock.now))

    def send(response, client):
        sent[client].append(response.message)
        clock.now += 0.1 if len(sent[client]) <= drops else 1e-3

    service = SimpleNamespace(
        srv_name='/mlmem/read', callback=lambda client, _: Trigger.Response(message=client),
        send_response=send,
    )  # fmt: skip
    guard = CallbackGuard(SimpleNamespace(services=[service]), ThrottledLog(lambda *_: None))
    guard.guard_services()
    for client in sent:
        service.send_response(service.callback(client, None), client)
    wait_until(lambda: not guard.waiting, 'the answers', TIMEOUT_S)
    times = 1 + min(drops, 2)
    assert sent == {'first': times * ['first'], 'second': times * ['second']}


def test_transition_that_is_not_available_is_rejected(answering, memory):
    def change(**transition):
        return answering.call('change_state', transition=Transition(**transition)).success

    available = {Transition.TRANSITION_DEACTIVATE, Transition.TRANSITION_ACTIVE_SHUTDOWN}
    for number in sorted({*range(20), *range(60, 70), 127, 128, 254, 255} - available):
        assert not change(id=number), number
    assert not change(label='activate')
    assert not change(label='no such transition')
    assert answering.state == 'active'
    assert 'Traceback' not in memory.output


@pytest.mark.parametrize('kind', [10, 200, 255])
def test_parameter_of_unknown_type_is_rejected(answering, kind):
    odd = Parameter(name='target_level', value=ParameterValue(type=kind))
    good = Parameter(name='target_level', value=ParameterValue(type=2, integer_value=1))
    answer = answering.call('set_parameters', parameters=[odd, good])
    assert [result.successful for result in answer.results] == [False, False]
    assert str(kind) in answer.results[0].reason
    at_once = answering.call('set_parameters_atomically', parameters=[good, odd])
    assert not at_once.result.successful
    assert answering.get('target_level') == -1


def test_undecodable_messages_are_rejected(answering, memory):
    """A text that is not UTF-8, a length beyond the end, a truncated message."""
    message = JointTrajectory()
    message.header.frame_id = 'frame'
    good = serialize_message(message)
    not_utf8 = good.replace(b'frame', b'\xff\xfe\xff\xfe\xff')
    for bad in (not_utf8, good[:9], good[:4] + b'\xff' * 40):
        answering.send_message('strain_trajectory', bad)
    rejected = 'strain_trajectory refused: the message must be'
    answering.wait(lambda: rejected in memory.output, 'a rejection')


def test_node_that_stood_still_answers_again(memory, create_node):
    """Half of them used to be forgotten for good: of those who ask meanwhile, and of others."""
    with ExitStack() as stack:
        clients = [stack.enter_context(standalone()) for _ in range(4)]
        clients.append(MemoryClient(create_node('behaviour'), '/mlmem'))
        for client in clients:
            client.ready(TIMEOUT_S).wait()
            client.read().wait()
        memory.signal(signal.SIGSTOP)
        begun = time.monotonic()
        for reading in [client.read(timeout=600.0) for client in clients[::2]]:
            with pytest.raises(NoAnswer, match='went away during read: how it ended is not known'):
                reading.result(TIMEOUT_S)  # while it stands still
        time.sleep(max(0.0, begun + 6.0 - time.monotonic()))
        memory.signal(signal.SIGCONT)
        assert [client.request('read').wait().details['level'] for client in clients] == [-1] * 5


def test_robot_stopped_with_its_memory_writes_once_more(memory, tmp_path):
    """The program printed in docs/robot.md, and the last test of this node."""
    page = Path(__file__).parents[2] / 'docs' / 'robot.md'
    blocks = re.findall(r'```python\n(.*?)```', page.read_text(), re.DOTALL)
    behaviour = tmp_path / 'behaviour.py'
    assert 'timeout=3.0' in blocks[1]
    blocks[1] = blocks[1].replace('timeout=3.0', f'timeout={TIMEOUT_S}')  # on a busy machine
    behaviour.write_text('\n'.join([*blocks, 'main()\n']))
    with standalone() as client:
        client.ready(TIMEOUT_S).wait()  # on a busy machine it starts late
        assert client.write(5, timeout=TIMEOUT_S).wait().level == 5
        state = client.parameters('state.path').wait()['state.path']
    reads = memory.output.count('read succeeded')
    robot = program(behaviour, stderr=subprocess.PIPE, text=True)
    wait_until(
        lambda: memory.output.count('read succeeded') > reads, "its constructor's read", TIMEOUT_S
    )
    for _ in range(3):  # as a terminal does, and again, as launch does
        memory.signal(signal.SIGINT)
        robot.send_signal(signal.SIGINT)
        time.sleep(0.003)
    assert (robot.wait(TIMEOUT_S), robot.stderr.read()) == (0, '')
    while memory.running:  # it does not linger to the end, nor do impatient users break it
        memory.signal(signal.SIGINT)
        time.sleep(0.01)
    assert memory.exit_status() == ENDED
    assert 'Traceback' not in memory.output
    assert store.load_snapshot(state)['reading']['level'] == 0


class Odd:
    """A service type of which the first request cannot be decoded."""

    Response = Trigger.Response
    taken = 0

    @property
    def Request(self):
        self.taken += 1
        if self.taken == 1:
            raise UnicodeDecodeError('utf-8', b'', 0, 1, 'as a take raises it')
        return Trigger.Request


def test_requests_next_to_an_undecodable_one_are_served(context, create_node):
    """The exception loses the middleware's count of waiting requests."""
    node = create_node('server')
    served = Trigger.Response(message='served')
    service = node.create_service(Trigger, '/ask', lambda *_: served)
    client = create_node('client').create_client(Trigger, '/ask')
    executor = GuardedExecutor(context)
    executor.add_node(node, ThrottledLog(lambda *_: None))
    assert client.wait_for_service(TIMEOUT_S)
    service.srv_type = Odd()
    sent = [client.call_async(Trigger.Request()) for _ in range(3)]
    deadline = time.monotonic() + TIMEOUT_S
    while not all(future.done() for future in sent):
        assert time.monotonic() < deadline, 'no answer'
        executor.turn(0.01)
        header, response = client.handle.take_response(Trigger.Response)
        if header is not None:
            client.get_pending_request(header.request_id.sequence_number).set_result(response)
    assert [future.result().message for future in sent] == 3 * ['served']
    assert service.srv_type.taken > 1
    executor.shutdown()
