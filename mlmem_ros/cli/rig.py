# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem rig`: emulate an element behind a TCP port, for a node with `device.driver:=rig`.

It has its own clock, and its line may delay, jitter and lose frames, all at random from a seed.
The element keeps its state when a client disconnects and another connects. The first line printed
is the value for `device.address`.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from .command import JSON, command, option
from .output import complain, print_json


@command(
    'run an emulated rig, for a node to drive over TCP',
    option('--preset', default='case_2', help='shipped element'),
    option('--host', default='127.0.0.1', help='address to listen on'),
    option('--port', type=int, default=0, help='port to listen on; 0: any free one'),
    option(
        '--scale-time', type=float, metavar='S', help="s per time unit, by default the preset's"
    ),
    option('--latency', type=float, default=0.0, metavar='S', help='delay of every frame'),
    option('--jitter', type=float, default=0.0, metavar='S', help='additional random delay'),
    option(
        '--loss', type=float, default=0.0, metavar='P', help='probability that a frame is lost'
    ),
    option(
        '--drift', type=float, default=0.0, metavar='X', help='fraction by which its clock is fast'
    ),
    option(
        '--restart',
        type=float,
        default=0.0,
        metavar='S',
        help='disconnect after this time; 0: never',
    ),
    option('--seed', type=int, default=0, help='seed of the random numbers'),
    JSON,
    text=__doc__,
)
def rig(arguments: argparse.Namespace) -> int:
    """Serve until interrupted; return the exit status."""
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
