# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The places of requests that wait for their turn."""

import math
from types import SimpleNamespace

import pytest

from mlmem import Refused, Write
from mlmem.loop.mailbox import Cancel, Request
from mlmem.loop.open_requests import OpenRequests
from mlmem.loop.timetable import LoopStatistics

from . import rig


@pytest.mark.parametrize('leaves', ['canceled', 'past its deadline', 'gone'])
def test_places_move_up_when_a_request_leaves(leaves):
    requests = OpenRequests(rig.device(), LoopStatistics(), None, None, most=3)
    clients = [SimpleNamespace(key=name, gone=False) for name in 'abcd']
    running, *waiting = (Request(Write(1), client=client) for client in clients)
    for request in (running, *waiting):
        requests.apply(request)
    assert [request.place for request in (running, *waiting)] == [0, 1, 2, 3]
    first, second, third = waiting
    if leaves == 'canceled':
        requests.apply(Request(Cancel(first)))
    else:
        first.client.gone = leaves == 'gone'
        first.deadline = math.inf if first.client.gone else 0.0
        requests.refuse_expired()
    assert isinstance(first.answer.exception(0.0), Refused)
    assert (second.place, third.place) == (1, 2)
