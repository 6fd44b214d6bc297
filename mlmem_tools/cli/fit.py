# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem fit`: fit an element, cell by cell, to the pulses of a survey.

Record a session while `mlmem survey` runs. CSV files of single shots need --design. Nothing is
written if the model does not describe the element.
"""

from __future__ import annotations

import argparse
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from mlmem import Element, Shot, as_designed, load_element
from mlmem.element_file import TransducerValues, write_element_file
from mlmem.parsing import DecodeError
from mlmem.physics import DesignError
from mlmem_ros.bag.errors import BagError
from mlmem_ros.session.data import load_session

from ..identification import csv_shots
from ..identification.fit import Misfitting, fit_element
from ..identification.fitted import TERM_DESCRIPTIONS, Fit
from ..identification.unknowns import CELL_TERMS, SHARED_UNKNOWNS
from .command import JSON_OPTION, declare_command, declare_option
from .output import create_console, print_failure, print_json, show_bar


@declare_command(
    'fit an individual element, cell by cell, to the shots of a survey',
    declare_option('source', nargs='+', metavar='SESSION',
        help='session with a survey, or CSV of a shot'),
    declare_option('--output', metavar='FILE', help='write the element to this file'),
    declare_option('--design', metavar='ELEMENT',
        help='design as built; a session has its own'),
    declare_option('--scatter', type=float, metavar='X', default=0.02,
           help='expected scatter of alpha, relative'),
    JSON_OPTION,
    text=__doc__,
)  # fmt: skip
def fit(arguments: argparse.Namespace) -> int:
    """Fit; return 0, 1 if the data cannot be fitted, 2 if they cannot be read."""
    try:
        known, shots, simulated = _read_inputs(arguments)
        design, settings = known.design_and_settings
    except (BagError, DecodeError, DesignError, Misfitting) as error:
        return print_failure('fit', error, 2)
    console = create_console(aside=True)
    try:
        with show_bar(console) as report:
            found = fit_element(
                design, shots, scatter=arguments.scatter, simulated=simulated, report=report
            )  # fmt: skip
        element = dataclasses.replace(build_element(found), settings=settings)
        if arguments.output:
            write_element_file(Path(arguments.output), element)
    except (Misfitting, OSError) as error:
        if arguments.json:
            print_json({'error': str(error)})
        return print_failure('fit', error, 1)
    if arguments.json:
        print_json(_as_dict(found))
    else:
        _describe_fit(found, arguments.output)
    return 0


def build_element(found: Fit) -> Element:
    """Return a fit as the element of a file."""
    unknowns, ends = found.unknowns, {}
    for name in (each.name for each in dataclasses.fields(TransducerValues)):
        left, right = unknowns.end_values(found.x, name)
        ends[name] = float(left), float(right)
    time_unit = float(found.x[unknowns.shared('time_unit')])
    return Element(
        found.specimen, found.deviations[unknowns.alpha], time_unit, TransducerValues(**ends),
        found.chi2, found.data, found.undetermined,
    )  # fmt: skip


def _read_inputs(arguments: argparse.Namespace) -> tuple[Element, list[Shot], bool]:
    """Return design and settings, shots, and whether all are of a simulated element."""
    known = load_element(arguments.design) if arguments.design else None
    shots: list[Shot] = []
    simulated = True
    for source in arguments.source:
        if source.endswith('.csv'):
            shots.append(csv_shots.load_shot(Path(source)))
            simulated = False
            continue
        session = load_session(source)
        if not session.shots:
            raise Misfitting(f'{source} holds no shots: run `mlmem survey` while it is recorded')
        header = session.header
        known = known or as_designed(header.design, header.settings)
        if header.design != known.design:
            raise Misfitting(f'{source} is of another design')
        shots += session.shots
        simulated = simulated and header.simulated
    if known is None:
        raise Misfitting('CSV files do not tell the design: give --design')
    return known, shots, simulated


def _as_dict(found: Fit) -> dict[str, Any]:
    unknowns, deviations = found.unknowns, found.deviations
    told: dict[str, Any] = {
        'alpha': found.x[unknowns.alpha],
        'alpha_std': deviations[unknowns.alpha],
        'shared': {
            name: {
                'value': float(found.x[unknowns.shared(name)]),
                'std': float(deviations[unknowns.shared(name)]),
            }
            for name in SHARED_UNKNOWNS
        },
        'walls': sorted({shot.wall for shot in found.misfit.shots if shot.wall}),
        'noise': found.noise,
        'chi2': found.chi2,
        'in_band': found.in_band,
        'data': found.data,
        'held_out': list(found.held_out),
        'added': found.added_terms,
        'scatter': {CELL_TERMS[term]: value for term, value in found.misfit.scatter.items()},
        'undetermined': list(found.undetermined),
    }
    for term, where in unknowns.cells.items():
        if term in unknowns.terms:
            name = CELL_TERMS[term]
            told |= {name: found.x[where], f'{name}_std': deviations[where]}
    return told


def _describe_fit(found: Fit, output: str | None) -> None:
    """Print what was found in some lines."""
    unknowns = found.unknowns
    nominal = unknowns.design.alpha
    alpha, deviation = (each[unknowns.alpha] for each in (found.x, found.deviations))
    worst = int(np.argmax(np.abs(alpha / nominal - 1.0)))
    print(
        f'alpha of {len(alpha)} cells, each within {100 * np.median(deviation / alpha):.2g} % '
        f'(1 s.d.); they scatter by {100 * np.std(alpha / nominal):.2g} % about the design'
    )
    print(
        f'farthest: cell {worst + 1}, {100 * (alpha[worst] / nominal[worst] - 1.0):+.2f} %; '
        f'misfit per datum {found.chi2:.3f} of {found.data} data'
    )
    print(
        f'each pulse, predicted from the others: misfit per datum {min(found.held_out):.3f} to '
        f'{max(found.held_out):.3f}'
    )
    for term in found.added_terms:
        print(f'fitted, too, as the data ask for it: {TERM_DESCRIPTIONS[term]}')
    for words in found.undetermined:
        print(f'not determined: {words}')
    if output:
        print(f'written to {output}')
