# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem watch`: show the element behind a running node in the terminal, until Ctrl-C.

Shows level and code, the walls in the chain, strain, last echo, last procedure, rates and health.
Exit status 0; 1 when no node answers.
"""

from __future__ import annotations

import argparse
import time
from typing import TYPE_CHECKING

from .command import JSON, NODE, command, option, wait
from .interrupts import outcome_known
from .output import complain, plain_console, print_json

if TYPE_CHECKING:
    from mlmem_tools.view.monitor import View

FIRST_REPORT = 3.0
"""Longest wait in seconds for the first health report; there is one every second."""

PERIOD = 0.1
"""Seconds between two pictures."""


@command(
    'show the element behind a running node in the terminal',
    NODE,
    wait(5.0),
    option('--once', action='store_true', help='print one picture and exit'),
    JSON,
    text=__doc__,
)
def watch(arguments: argparse.Namespace) -> int:
    """Show the element; return the exit status."""
    from rich.live import Live

    from mlmem_ros.contract.calls import RequestError
    from mlmem_ros.ros.client.client import standalone, wait_until
    from mlmem_tools.view.monitor import WANTED, Monitor

    from .dashboard import dashboard

    if arguments.json and not arguments.once:
        return complain('watch', '--json must be given with --once', 2)
    console = plain_console()
    try:
        with standalone(arguments.node) as client:
            client.ready(arguments.wait).wait()
            monitor = Monitor(client, client.parameters(*WANTED).wait())
            if arguments.once:
                wait_until(lambda: complete(monitor.view), 'a health report', FIRST_REPORT)
                outcome_known()
                if arguments.json:
                    print_json(monitor.view)
                else:
                    console.print(dashboard(monitor.view, console.width))
                return 0
            with Live(console=console, auto_refresh=False) as live:
                while True:
                    live.update(dashboard(monitor.view, console.width), refresh=True)
                    time.sleep(PERIOD)
    except RequestError as error:
        return complain('watch', error, 1)
    except KeyboardInterrupt:
        return 0


def complete(view: View) -> bool:
    """Return whether a health report has come, and the level that it speaks of."""
    memory = view.health.get('memory')
    read = memory is not None and 'level' in memory.values
    return bool(view.health) and (view.level is not None or not read)
