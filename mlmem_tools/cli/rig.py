# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem rig`: emulate an element behind a TCP port, for a node with `device.driver:=rig`.

The first line printed is the value for `device.address`. The element keeps its state between
clients.
"""

from __future__ import annotations

import argparse
import sys
from typing import TYPE_CHECKING

from .command import JSON_OPTION, declare_command, declare_option
from .output import print_failure, print_json

if TYPE_CHECKING:
    from mlmem import Element

    from ..rig.emulated import EmulatedRig


@declare_command(
    'run an emulated rig, for a node to drive over TCP',
    declare_option('--element', default='case_2', metavar='NAME|FILE', help='element of the rig'),
    declare_option('--host', default='127.0.0.1', help='address to listen on'),
    declare_option(
        '--port', type=int, default=0, help='port to listen on; by default any free one'
    ),
    declare_option(
        '--at-once',
        action='store_true',
        help='play set-points as soon as they arrive',
    ),
    declare_option('--no-actuator', action='store_true', help='emulate a rig without an actuator'),
    *(
        declare_option(name, type=float, default=0.0, metavar='X', help=text)
        for name, text in (
            ('--latency', 'delay of every frame in s'),
            ('--jitter', 'additional random delay in s'),
            ('--loss', 'probability that a frame is lost'),
            ('--drift', 'relative error of its clock; positive: fast'),
            ('--scatter', 'relative scatter of the on-site stiffness of the cells'),
            ('--gain', 'relative scatter of the gain of either transducer'),
            ('--noise', 'noise of a sample, in cells (s.d.)'),
        )
    ),
    declare_option('--seed', type=int, default=0, help='seed of the random numbers'),
    JSON_OPTION,
    text=__doc__,
)
def rig(arguments: argparse.Namespace) -> int:
    """Serve until interrupted; return the exit status."""
    from mlmem import load_element
    from mlmem.physics import DesignError, StateError

    from ..rig.emulated import LineProperties, RigServer

    try:
        emulated = _build_rig(load_element(arguments.element), arguments)
        line = LineProperties(arguments.latency, arguments.jitter, arguments.loss, arguments.seed)
        server = RigServer(emulated, line, arguments.host, arguments.port)
    except (DesignError, StateError, ValueError, OSError) as error:
        return print_failure('rig', error, 2)
    address = f'tcp://{arguments.host}:{server.port}'
    if arguments.json:
        print_json({'address': address})
    else:
        print(address)
    sys.stdout.flush()  # for whoever starts a rig and waits for its address
    server.run()
    return 0


def _build_rig(chosen: Element, given: argparse.Namespace) -> EmulatedRig:
    from mlmem.instrument.drivers import Simulation
    from mlmem.physics import Scatter, draw_specimen
    from mlmem.rng import RandomStream, make_generator

    from ..rig.emulated import EmulatedRig, RigSensors

    made = draw_specimen(chosen.design, Scatter(given.scatter), given.seed)
    # by how much steps are shorter than in a node: what stands for a real element has no step, and
    # a fit would hear the errors of the usual one
    step_refinement = 2
    element = Simulation.build_blank(made, chosen.settings.time, step_refinement)
    drawn = make_generator(given.seed, RandomStream.GAIN).standard_normal(2)
    left, right = (1.0 + given.gain * drawn).tolist()
    sensors = RigSensors(gain=(left, right), noise=given.noise, seed=given.seed)
    return EmulatedRig(
        chosen.design,
        chosen.settings,
        element,
        sensors,
        drift=given.drift,
        at_once=given.at_once,
        actuator=not given.no_actuator,
    )
