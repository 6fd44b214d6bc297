# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The SROS2 policy allows exactly what node and client do on a live graph."""

import contextlib
import time
from fnmatch import fnmatchcase
from pathlib import Path
from xml.etree import ElementTree

from mlmem_ros.contract import requests
from mlmem_ros.contract.answers import RequestFailed, RequestRefused
from mlmem_ros.contract.requests import load_action_types
from mlmem_ros.ros.client.client import standalone
from mlmem_ros.ros.node import simulator

POLICY = Path(__file__).parents[2] / 'config' / 'sros2_policy.xml'

ON_DEMAND = {'/clock', '/mlmem/word'}
"""Of `use_sim_time` and of registers alone."""

SETTLED = 1.0
"""Seconds without news after which everything is discovered."""

ACTIONS_BUILT, SIMULATOR_BUILT = bool(load_action_types()), simulator.load_types() is not None


REQUESTS, REPORTS = {'send_goal', 'cancel_goal', 'get_result'}, {'feedback', 'status'}
ACTION = {
    'execute': {'reply': REQUESTS, 'publish': REPORTS},
    'call': {'request': REQUESTS, 'subscribe': REPORTS},
}
"""The parts of an action by role and rule."""


def allowed(enclave, rule):
    """Return the full names that an enclave's only profile allows, as SROS2 expands them.

    The names of types that are not built are left out.
    """
    names = set(listed(enclave, rule))
    if not SIMULATOR_BUILT:
        names -= {f'/mlmem/{service.name}' for service in requests.SIMULATOR_SERVICES}
    for role, parts in ACTION.items():
        for action in listed(enclave, role):
            if ACTIONS_BUILT:
                names |= {f'{action}/_action/{part}' for part in parts.get(rule, ())}
    return names


def listed(enclave, rule):
    """Return the full names that an enclave's only profile lists under a rule."""
    (profile,) = ElementTree.parse(POLICY).iterfind(f'.//enclave[@path="{enclave}"]//profile')
    namespace = profile.get('ns').rstrip('/')
    names = [
        expression.text for group in profile for expression in group if group.get(rule) == 'ALLOW'
    ]
    assert len(names) == len(set(names)), 'a name is listed twice'
    return {name.replace('~', f'{namespace}/{profile.get("node")}', 1) for name in names}


def used(robot, *nodes):
    """Return the names of nodes on the graph by rule, once none has been added for a second."""
    robot.wait(lambda: set(nodes) <= set(robot.node.get_node_names()), nodes)
    find = {
        'publish': robot.node.get_publisher_names_and_types_by_node,
        'subscribe': robot.node.get_subscriber_names_and_types_by_node,
        'reply': robot.node.get_service_names_and_types_by_node,
        'request': robot.node.get_client_names_and_types_by_node,
    }
    found, since = {}, time.monotonic()

    def settled():
        nonlocal found, since
        now = {
            rule: {topic for name in nodes for topic, _ in ask(name, '/')}
            for rule, ask in find.items()
        }
        if now != found:
            found, since = now, time.monotonic()
        return time.monotonic() - since > SETTLED

    robot.wait(settled, 'the whole graph')
    return found


def test_policy_allows_what_the_node_does(robot):
    robot.next('wall')
    for rule, names in used(robot, 'mlmem').items():
        assert names == allowed('/mlmem', rule) - ON_DEMAND, rule
    assert allowed('/mlmem', 'request') == set()  # it asks nobody


def test_policy_allows_what_the_client_does(robot):
    with standalone(robot.element) as client:
        client.ready().wait()
        requests = [
            lambda: client.write(0),
            client.read,
            client.erase,
            client.calibrate,
            client.self_test,
            lambda: client.procedure('survey'),
            client.abort,
            lambda: client.pause(False),
            client.step,
            lambda: client.parameters('element'),
            lambda: client.set_parameters({'time.speed': 1.0}),
            lambda: client.follow([1.0], [0.0]),
            lambda: client.record(False),
        ]
        for request in requests:
            with contextlib.suppress(RequestFailed, RequestRefused):
                asked = request()
                client.abort().wait()  # what is asked counts, not how it ends
                asked.wait()
        name = client.node.get_name()
        unused = {'/mlmem/self_test'} if ACTIONS_BUILT else set()  # done by an action instead
        found = used(robot, name)
        assert found['request'] == allowed('/mlmem_client', 'request') - unused
        assert found['publish'] == allowed('/mlmem_client', 'publish')
        for service in found['reply']:
            assert any(fnmatchcase(service, known) for known in allowed('/mlmem_client', 'reply'))
    listens = {'alive', 'content', 'level', 'outcome', 'word'}
    topics = {f'/mlmem/{topic}' for topic in listens} | {'/diagnostics'}
    assert set(listed('/mlmem_client', 'subscribe')) == topics


def test_policies_of_client_and_node_agree():
    assert allowed('/mlmem_client', 'request') <= allowed('/mlmem', 'reply')
    assert allowed('/mlmem_client', 'subscribe') <= allowed('/mlmem', 'publish')
