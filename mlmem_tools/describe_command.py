# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands of a session in words."""

from __future__ import annotations

from typing import Any

from mlmem import Command, FollowTrajectory, Kick, Read, SetFaults, SetMethod, SetStrain, Write
from mlmem.procedure_table import describe_content
from mlmem_ros.contract.requests import REQUEST_ARGUMENTS, find_command_type

COMMAND_NAMES: dict[type[Any], str] = {
    **{find_command_type(name): name for name in REQUEST_ARGUMENTS},
    SetStrain: 'strain',
    SetFaults: 'faults',
    SetMethod: 'write.method',
}


def describe_command(command: Command, content_name: str) -> str:
    """Return a command in words, with active faults only.

    Args:
        command: The command.
        content_name: `level` or `word`.
    """
    name = COMMAND_NAMES.get(type(command), type(command).__name__)
    match command:
        case Write(level=content):
            described = describe_content(content_name, content)
            return f'{name} {described if content_name == "word" else content}'
        case SetStrain(strain=strain):
            return f'{name} {strain:+.4f}'
        case FollowTrajectory(strains=strains):
            return f'{name} to {strains[-1]:+.4f}'
        case Kick(speed=speed):
            return f'{name} at {speed:g}'
        case Read(end=end) if end:
            return f'{name} from {end}'
        case SetFaults(faults=faults):
            return f'{name} {", ".join(faults.list_active()) or "healed"}'
        case SetMethod(method=method):
            return f'{name} {method}'
        case _:
            return name
