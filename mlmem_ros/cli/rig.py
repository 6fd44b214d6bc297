# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem rig`: an emulated element behind a TCP port, for a node with `device.driver:=rig`.

It has a clock of its own, and its line may be late, jitter and lose frames; all of it by chance
with a seed. The element stays what it is when a client hangs up and another one comes. What it
prints first is the address that `device.address` wants.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from .command import JSON, command, option
from .console import complain
from .output import print_json


@command(
    'run an emulated rig, for a node to drive over TCP',
    option('--preset', default='case_2', help='shipped element'),
    option('--host', default='127.0.0.1', help='address to listen at'),
    option('--port', type=int, default=0, help='port to listen at; 0: one that is free'),
    option(
        '--scale-time', type=float, metavar='S', help="s per time unit, by default the preset's"
    ),
    option('--latency', type=float, default=0.0, metavar='S', help='time that every frame takes'),
    option('--jitter', type=float, default=0.0, metavar='S', help='time it may take in addition'),
    option('--loss', type=float, default=0.0, metavar='P', help='probability that it never comes'),
    option(
        '--drift', type=float, default=0.0, metavar='X', help='share by which its clock is fast'
    ),
    option(
        '--restart', type=float, default=0.0, metavar='S', help='hang up after this time; 0: never'
    ),
    option('--seed', type=int, default=0, help='which chance'),
    JSON,
    text=__doc__,
)
def rig(arguments: argparse.Namespace) -> int:
    """Serve until it is interrupted; return the exit status."""
    from ..device import preset
    from ..physics import DesignError
    from ..rig.emulated import EmulatedRig
    from ..rig.server import Line, Server

    try:
        chosen = preset(arguments.preset)
        scale = chosen.settings.scale
        if arguments.scale_time is not None:
            scale = replace(scale, time=arguments.scale_time)
        emulated = EmulatedRig(
            chosen.design, replace(chosen.settings, scale=scale), drift=arguments.drift
        )
        line = Line(
            arguments.latency, arguments.jitter, arguments.loss, arguments.restart, arguments.seed
        )
        server = Server(emulated, line, arguments.host, arguments.port)
    except (DesignError, ValueError, OSError) as error:
        return complain('rig', error, 2)
    address = f'tcp://{arguments.host}:{server.port}'
    if arguments.json:
        print_json({'address': address})
    else:
        print(address)
    sys.stdout.flush()  # for whoever starts a rig and waits for its address
    server.run()
    return 0
