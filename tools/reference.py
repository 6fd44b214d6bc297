# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Write the pages of docs/reference and the SROS 2 policy from the code.

.venv/bin/python tools/reference.py
"""

import re
from pathlib import Path

from reference_pages.commands import commands_page
from reference_pages.elements import checks_page, presets_page
from reference_pages.files import files_page
from reference_pages.interface import actions_page, diagnostics_page, services_page, topics_page
from reference_pages.parameters import parameters_page, settings_page
from reference_pages.problems import standard_problems_page
from reference_pages.rig import rig_page

from mlmem_ros.contract import services
from mlmem_ros.contract.commands import COMMAND_TOPICS
from mlmem_ros.contract.services import ACTION_TYPE_NAMES
from mlmem_ros.contract.streams import STREAMS

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / 'docs' / 'reference'
POLICY = ROOT / 'config' / 'sros2_policy.xml'

GENERATED = '<!-- Made by tools/reference.py from the code; edit that. -->\n\n'


def pages() -> dict[str, str]:
    """Return every page by the name of its file."""
    made = {
        'topics.md': topics_page(),
        'services.md': services_page(),
        'actions.md': actions_page(),
        'diagnostics.md': diagnostics_page(),
        'parameters.md': parameters_page(),
        'settings.md': settings_page(),
        'commands.md': commands_page(),
        'files.md': files_page(),
        'rig.md': rig_page(),
        'checks.md': checks_page(),
        'presets.md': presets_page(),
        'standard_problems.md': standard_problems_page(),
    }
    return {name: GENERATED + text for name, text in made.items()}


def policy() -> str:
    """Return the SROS 2 policy with the present topics, services and actions."""
    text = POLICY.read_text(encoding='utf-8')
    served = *services.NODE_SERVICES, *services.SIMULATOR_SERVICES
    own = ''.join(f'            <service>~/{name}</service>\n' for name, *_ in served)
    text = re.sub(
        r'(<services reply="ALLOW">\n).*?( *<service>~/change_state)',
        lambda found: found[1] + own + found[2],
        text,
        count=1,
        flags=re.DOTALL,
    )
    for rule, topics, end in (
        ('publish', STREAMS, 'alive'),
        ('subscribe', [topic.name for topic in COMMAND_TOPICS], 'clients'),
    ):
        listed = ''.join(f'            <topic>~/{name}</topic>\n' for name in topics)
        text = re.sub(
            rf'(<topics {rule}="ALLOW">\n).*?( *<topic>~/{end}</topic>)',
            lambda found, listed=listed: found[1] + listed + found[2],
            text,
            count=1,
            flags=re.DOTALL,
        )
    for rule, above in (('execute', '~'), ('call', '/mlmem')):
        names = (
            [*ACTION_TYPE_NAMES, services.STEPS_ACTION] if rule == 'execute' else ACTION_TYPE_NAMES
        )
        listed = ''.join(f'            <action>{above}/{name}</action>\n' for name in names)
        text = re.sub(
            rf'(<actions {rule}="ALLOW">[^\n]*\n).*?( *</actions>)',
            lambda found, listed=listed: found[1] + listed + found[2],
            text,
            flags=re.DOTALL,
        )
    return text


if __name__ == '__main__':
    FOLDER.mkdir(exist_ok=True)
    for name, text in pages().items():
        (FOLDER / name).write_text(text, encoding='utf-8')
        print(f'docs/reference/{name}')
    POLICY.write_text(policy(), encoding='utf-8')
