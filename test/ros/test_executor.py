# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The executor serves requests next to one that cannot be decoded."""

import logging
import time

from nodes import SOON
from std_srvs.srv import Trigger

from mlmem_ros.host import ThrottledLog
from mlmem_ros.ros.node.run import GuardedExecutor


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


def answer(_, response):
    response.message = 'served'
    return response


def test_requests_next_to_an_undecodable_one_are_served(context, create_node):
    """The exception loses the middleware's count of waiting requests."""
    node = create_node('server')
    service = node.create_service(Trigger, '/ask', answer)
    client = create_node('client').create_client(Trigger, '/ask')
    executor = GuardedExecutor(context)
    executor.add_node(node, ThrottledLog(logging.getLogger()))
    assert client.wait_for_service(SOON)
    service.srv_type = Odd()
    sent = [client.call_async(Trigger.Request()) for _ in range(3)]
    deadline = time.monotonic() + SOON
    while not all(future.done() for future in sent):
        assert time.monotonic() < deadline, 'no answer'
        executor.turn(0.01)
        header, response = client.handle.take_response(Trigger.Response)
        if header is not None:
            client.get_pending_request(header.request_id.sequence_number).set_result(response)
    assert [future.result().message for future in sent] == 3 * ['served']
    assert service.srv_type.taken > 1
    executor.shutdown()
