# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executor survives undecodable messages, can be interrupted, and answers late requests."""

import logging
import time

import pytest
import rclpy
from std_srvs.srv import Trigger

from mlmem_ros.host import ThrottledLog
from mlmem_ros.ros.node.run import GuardedExecutor

SOON = 30.0


@pytest.fixture
def node(context):
    return rclpy.create_node('server', context=context, use_global_arguments=False)


@pytest.fixture
def client(context, node):
    asking = rclpy.create_node('client', context=context, use_global_arguments=False)
    yield asking.create_client(Trigger, '/ask')
    asking.destroy_node()


@pytest.fixture
def executor(context, node):
    executor = GuardedExecutor(context)
    executor.add_node(node, ThrottledLog(logging.getLogger()))
    yield executor
    executor.shutdown()
    node.destroy_node()


def responses(executor, client, sent):
    """Spin the server until all requests are answered; return the answers."""
    deadline = time.monotonic() + SOON
    while not all(future.done() for future in sent):
        assert time.monotonic() < deadline, 'no answer'
        executor.turn(0.01)
        header, response = client.handle.take_response(Trigger.Response)
        if header is not None:
            client.get_pending_request(header.request_id.sequence_number).set_result(response)
    return [future.result().message for future in sent]


def test_requests_next_to_an_undecodable_one_are_served(executor, node, client):
    """The exception loses the middleware's count of waiting requests."""

    class Odd:
        """A service type that fails once."""

        Response = Trigger.Response
        failures = 0

        @property
        def Request(self):
            self.failures += 1
            if self.failures == 1:
                raise UnicodeDecodeError('utf-8', b'', 0, 1, 'as a take raises it')
            return Trigger.Request

    def answer(_, response):
        response.message = 'served'
        return response

    service = node.create_service(Trigger, '/ask', answer)
    assert client.wait_for_service(SOON)
    service.srv_type = Odd()
    sent = [client.call_async(Trigger.Request()) for _ in range(3)]
    assert responses(executor, client, sent) == 3 * ['served']
    assert service.srv_type.failures > 1
