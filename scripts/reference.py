# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the generated parts of docs/reference, actions and the SROS 2 policy from the code.

.venv/bin/python scripts/reference.py

A page is written by hand, but for the parts between `<!-- generated: NAME -->` and
`<!-- /generated -->`, which the functions of `reference_pages` return by name.
"""

import re
from pathlib import Path

from reference_pages.commands import generate_commands
from reference_pages.elements import generate_checks, generate_elements
from reference_pages.interface import ACTION_FOLDER, generate_actions, generate_interfaces
from reference_pages.parameters import generate_parameters
from reference_pages.problems import generate_standard_problems
from reference_pages.rig import generate_rig

from mlmem_ros.contract import requests
from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.requests import ACTION_TYPE_NAMES
from mlmem_ros.contract.streams import STREAMS

CHECKOUT_ROOT = Path(__file__).resolve().parent.parent
REFERENCE_FOLDER = CHECKOUT_ROOT / 'docs' / 'reference'
POLICY = CHECKOUT_ROOT / 'config' / 'sros2_policy.xml'

GENERATED_PART = re.compile(r'(<!-- generated: ([^>]+) -->\n).*?(<!-- /generated -->)', re.DOTALL)
"""A part of a page and the comments around it."""

PAGE_PARTS = {
    'checks.md': generate_checks,
    'commands.md': generate_commands,
    'elements.md': generate_elements,
    'interfaces.md': generate_interfaces,
    'parameters.md': generate_parameters,
    'rig.md': generate_rig,
    'standard_problems.md': generate_standard_problems,
}
"""The functions that return the parts of a page by name."""


def pages() -> dict[str, str]:
    """Return every page with generated parts, up to date, by the name of its file.

    Raises:
        ValueError: A page and its function have parts of different names.
    """
    return {name: place_parts(name, generate()) for name, generate in PAGE_PARTS.items()}


def place_parts(name: str, parts: dict[str, str]) -> str:
    """Return a page with these parts in place of the old ones."""
    text = (REFERENCE_FOLDER / name).read_text(encoding='utf-8')
    if wrong := {found[2] for found in GENERATED_PART.finditer(text)} ^ set(parts):
        raise ValueError(f'{name} and its function must name the same parts; got {sorted(wrong)}')
    return GENERATED_PART.sub(
        lambda found: f'{found[1]}\n{parts[found[2]].strip()}\n\n{found[3]}', text
    )


def policy() -> str:
    """Return the SROS 2 policy with the present topics, services and actions."""
    text = POLICY.read_text(encoding='utf-8')
    served = *requests.NODE_SERVICES, *requests.SIMULATOR_SERVICES
    own = ''.join(f'            <service>~/{name}</service>\n' for name, *_ in served)
    text = re.sub(
        r'(<services reply="ALLOW">\n).*?( *<service>~/change_state)',
        lambda found: found[1] + own + found[2],
        text,
        count=1,
        flags=re.DOTALL,
    )
    for rule, topics, end in (
        ('publish', STREAMS, '~/alive'),
        ('subscribe', [topic.name for topic in COMMAND_TOPICS], '/clock'),
    ):
        listed = ''.join(f'            <topic>~/{name}</topic>\n' for name in topics)
        text = re.sub(
            rf'(<topics {rule}="ALLOW">\n).*?( *<topic>{end}</topic>)',
            lambda found, listed=listed: found[1] + listed + found[2],
            text,
            count=1,
            flags=re.DOTALL,
        )
    for rule, above in (('execute', '~'), ('call', '/mlmem')):
        listed = ''.join(
            f'            <action>{above}/{name}</action>\n' for name in ACTION_TYPE_NAMES
        )
        text = re.sub(
            rf'(<actions {rule}="ALLOW">[^\n]*\n).*?( *</actions>)',
            lambda found, listed=listed: found[1] + listed + found[2],
            text,
            flags=re.DOTALL,
        )
    return text


if __name__ == '__main__':
    for name, text in generate_actions().items():  # which the pages list
        (ACTION_FOLDER / name).write_text(text, encoding='utf-8')
        print(f'mlmem_interfaces/action/{name}')
    for name, text in pages().items():
        (REFERENCE_FOLDER / name).write_text(text, encoding='utf-8')
        print(f'docs/reference/{name}')
    POLICY.write_text(policy(), encoding='utf-8')
