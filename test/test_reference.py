# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The reference pages match the declarations in the code, and those a live node."""

from pathlib import Path

import reference

from mlmem_ros.contract.services import NODE_SERVICES
from mlmem_ros.testing import memory_node

ROOT = Path(__file__).parent.parent


def test_the_reference_pages_are_up_to_date():
    folder, pages = ROOT / 'docs' / 'reference', reference.pages()
    found = {name: (folder / name).read_text(encoding='utf-8') for name in pages}
    assert found == pages, 'run .venv/bin/python tools/reference.py'


def test_the_policy_allows_the_services_and_actions_that_there_are():
    path = ROOT / 'config' / 'sros2_policy.xml'
    assert path.read_text(encoding='utf-8') == reference.policy(), 'run tools/reference.py'


def test_every_service_of_a_live_node_is_declared():
    with memory_node({'autostart': False}) as node:
        served = {
            service.srv_name.rpartition('/')[2]: service.srv_type
            for service in node.node.services
            if service.callback.__module__.startswith('mlmem_ros')
        }
    assert served
    declared = {each.name: each.type for each in NODE_SERVICES}
    types = {
        name: f'{kind.__module__.partition(".")[0]}/srv/{kind.__name__}'
        for name, kind in served.items()
        if name in declared
    }
    assert types == declared
