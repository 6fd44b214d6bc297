# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem plan`: find pulses for one element, level by level, with their distance to failure.

Steps up get a peak and times, kicks a speed. A margin is how far off peak or speed may be,
relative.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from pathlib import Path
from typing import Any

from mlmem import Element, load_element
from mlmem.element_file import read_element_file, write_element_file
from mlmem.moves.kick import kick_speed
from mlmem.moves.strain_cycle import correct_write, select_peak
from mlmem.parsing import DecodeError
from mlmem.physics import DesignError

from ..identification.plan import Step, plan_pulses
from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_failure, print_json, print_rows, show_bar


@declare_command(
    'find pulses that take the wall of a fitted element to every level',
    declare_option('element', metavar='FILE', help='element, as mlmem fit writes it'),
    declare_option(
        '--design',
        metavar='ELEMENT',
        help='design and settings of the instrument; by default those in the file',
    ),
    declare_option(
        '--output',
        metavar='FILE',
        help='write the element with its pulses here; by default into its own file',
    ),
    JSON_OPTION,
    text=__doc__,
)
def plan(arguments: argparse.Namespace) -> int:
    """Plan; return 0, 1 if some level has no pulse, 2 if the element cannot be read."""
    try:
        element = read_element_file(Path(arguments.element))
        intended = load_element(arguments.design) if arguments.design else element
        with show_bar(create_console(aside=True)) as report:
            found = plan_pulses(element.timed_specimen, intended, report)
        element = dataclasses.replace(element, plan=found.corrections)
        write_element_file(Path(arguments.output or arguments.element), element)
    except (DecodeError, DesignError, OSError) as error:
        return print_failure('plan', error, 2)
    rows = [_describe_step(intended, step) for step in found.steps]
    speeds = intended.settings.kick.kink_speeds
    kinks = [
        _describe_pulse(step, kick=step.correction.speed * speeds[step.level])
        for step in found.kinks
    ]
    if arguments.json:
        print_json({'steps': rows, 'kinks': kinks, 'complete': found.complete})
    else:
        console = create_console()
        print_rows(console, 'pulses', rows)
        print_rows(console, 'kicks of kinks', kinks, ('level', 'kick', 'margin'))
        if not math.isnan(found.erase):
            console.print(f'erase: margin {found.erase:.4g}')
    return 0 if found.complete else 1


def _describe_pulse(step: Step, **values: float | None) -> dict[str, Any]:
    margin = step.margin if step.margin >= 0.0 else None  # no pulse was found
    blank = dict.fromkeys(('kick', 'peak', 'ramp'))
    return {'level': step.level, **blank, **values, 'margin': margin}


def _describe_step(intended: Element, step: Step) -> dict[str, Any]:
    """Return a step of a plan as plain values: a kick, or a pulse of strain."""
    if intended.settings.is_kicked(step.level):
        return _describe_pulse(
            step,
            kick=step.correction.speed * kick_speed(*intended.design_and_settings, step.level),
        )
    limit = intended.settings.actuator.max_strain
    write = correct_write(intended.settings.write, step.correction, limit)
    peak = write.start_strain
    if step.level:
        peak = select_peak(write, intended.design.is_freed_by_compression(step.level - 1))
    return _describe_pulse(step, peak=peak, ramp=write.ramp)
