# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands of a session in words."""

from __future__ import annotations

from mlmem import Command, FollowTrajectory, Kick, Read, SetFaults, SetMethod, SetStrain, Write
from mlmem.procedure_table import PROCEDURES, describe_content


def describe_command(command: Command, content_name: str) -> str:
    """Return a command in words, with active faults only.

    Args:
        command: The command.
        content_name: `level` or `word`.
    """
    match command:
        case Write(level=content):
            described = describe_content(content_name, content)
            return f'write {described if content_name == "word" else content}'
        case SetStrain(strain=strain):
            return f'strain {strain:+.4f}'
        case FollowTrajectory(strains=strains):
            return f'follow to {strains[-1]:+.4f}'
        case Kick(speed=speed):
            return f'kick at {speed:g}'
        case Read(end=end) if end:
            return f'read from {end}'
        case SetFaults(faults=faults):
            return f'faults {", ".join(faults.list_active()) or "healed"}'
        case SetMethod(method=method):
            return f'write.method {method}'
    names = {row.command: name for name, row in PROCEDURES.items()}
    return names.get(type(command), type(command).__name__)
