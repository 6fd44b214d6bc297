# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem plan`: find pulses for one element, level by level, with their distance to failure.

Steps up get a peak and times, kicks a speed.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from mlmem import ELEMENT_NAMES, Element, load_element
from mlmem.element_file import ElementFileError, read_element_file, write_element_file
from mlmem.move_settings import select_peak
from mlmem.moves.corrections import apply_correction, is_kicked
from mlmem.moves.kick import kick_speed
from mlmem.parsing import DecodeError
from mlmem.physics import Design, DesignError

from ..identification.plan import Step, plan_pulses
from .command import JSON_OPTION, declare_command, declare_option
from .output import ProgressBar, create_console, print_failure, print_json


@declare_command(
    'find pulses that take the wall of a fitted element to every level',
    declare_option('element', metavar='FILE', help='element, as mlmem fit writes it'),
    declare_option('--design', metavar='ELEMENT',
           help='design and settings of the instrument; by default the shipped one that fits'),
    declare_option('--output', metavar='FILE',
        help='write the element with its pulses here; by default '
           'into its own file'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def plan(arguments: argparse.Namespace) -> int:
    """Plan; return 0, 1 if some level has no pulse, 2 if the element cannot be read."""
    try:
        element = read_element_file(Path(arguments.element))
        design = element.specimen.design
        preset = load_element(arguments.design) if arguments.design else matching_preset(design)
        with ProgressBar(create_console(aside=True)) as report:
            found = plan_pulses(element.timed_specimen, preset, report)
        element = dataclasses.replace(element, plan=found.corrections)
        write_element_file(Path(arguments.output or arguments.element), element)
    except (DecodeError, DesignError, OSError) as error:
        return print_failure('plan', error, 2)
    rows = [_describe_step(preset, step) for step in found.steps]
    speeds = preset.settings.kick.kink_speeds
    kinks = [_describe_kink(step, speeds[step.level]) for step in found.kinks]
    if arguments.json:
        print_json({'steps': rows, 'kinks': kinks, 'complete': found.complete})
    else:
        for row in rows:
            told = (
                f'kick {row["kick"]:.4g}'
                if row['kick']
                else f'peak {row["peak"]:+.4f}, ramp {row["ramp"]:5.0f}'
            )
            print(f'level {row["level"]:3}: {told}, {_describe_margin(row)}')
        for row in kinks:
            print(
                f'level {row["level"]:3}: kick of a kink {row["kick"]:.4g}, '
                f'{_describe_margin(row)}'
            )
        if not math.isnan(found.erase):
            told = f'with its speed {found.erase:.0%} off' if found.erase else 'it leaves a wall'
            print(f'erase: {told}')
    return 0 if found.complete else 1


def matching_preset(design: Design) -> Element:
    """Return the preset whose levels a design has.

    Raises:
        ElementFileError: There is none, or several: pulses of one do not serve another.
    """
    shipped = {name: load_element(name) for name in ELEMENT_NAMES}
    one_wall = {name: one for name, one in shipped.items() if not one.settings.register.spacing}
    fit = {name: one for name, one in one_wall.items() if one.design.cells == design.cells}
    exact = {name: one for name, one in fit.items() if one.design == design}
    fit = exact or fit
    if not fit:
        raise ElementFileError('no preset has the levels of this element: give --design')
    first, *others = fit.values()
    if any(other.settings != first.settings for other in others):
        names = ', '.join(fit)
        raise ElementFileError(f'{names} have the levels of this element: give one as --design')
    return first


def _describe_margin(row: Mapping[str, Any]) -> str:
    margin = row['margin']
    if margin is None:
        return 'no pulse found'
    if row['kick']:
        return f'arrives {1.0 + margin:.2f} times as fast or as slow'
    return f'arrives with peaks {margin:.0%} off' if margin else 'arrives, with nothing off'


def _describe_kink(step: Step, speed: float) -> dict[str, Any]:
    """Return a kick of a kink as plain values."""
    margin = step.margin if step.margin >= 0.0 else None
    return {'level': step.level, 'kick': step.correction.speed * speed, 'margin': margin}


def _describe_step(preset: Element, step: Step) -> dict[str, Any]:
    """Return a step of a plan as plain values: a kick, or a pulse of strain."""
    found = {
        'level': step.level,
        'kick': None,
        'margin': step.margin if step.margin >= 0 else None,
    }
    if is_kicked(preset.settings, step.level):
        return found | {
            'kick': step.correction.speed * kick_speed(*preset.design_and_settings, step.level)
        }
    write = apply_correction(preset.settings, step.correction).write
    peak = write.start_strain
    if step.level:
        peak = select_peak(write, preset.design.is_freed_by_compression(step.level - 1))
    return found | {'peak': peak, 'ramp': write.ramp}
