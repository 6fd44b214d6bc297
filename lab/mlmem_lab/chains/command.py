# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""`mlmem chain`: what slows a chain of measured elements, from a film of a transition wave.

LAW.yaml is the on-site law, as `mlmem law` writes it. The coupling is either --coupling, a CSV
of the repulsion of two elements over their distance (`distance_mm,force_N`), or --spring.
The film has the displacements of some elements, the first of the chain being pushed over:
`t_ms,u8_mm,u9_mm` for the elements 8 and 9, the driven one being 1. docs/reference/csv.md has the
formats.

Found are viscous damping, dry friction, and the time of the push. The last tracked element is left
out once, and its arrival predicted. --predict tells the waves of chains with other spacings. With
--output a report with pictures is written.

Exit status 0: found; 1: the chain does not move so, or a file could not be written; 2: a file or
an argument is wrong.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from mlmem_tools.cli.command import JSON_OPTION, declare_command, declare_option
from mlmem_tools.cli.output import create_console, create_table, print_failure, print_json

if TYPE_CHECKING:
    from .tracked import Chain, Film, Found

EXPECTED_WAVES = 110
"""About how many waves a fit takes."""


@declare_command(
    'what slows a chain of measured elements, from a film',
    declare_option('law', metavar='LAW.yaml', type=Path, help='on-site law'),
    declare_option(
        '--track', metavar='FILM.csv', type=Path, required=True, help='tracked displacements'
    ),
    declare_option('--coupling', metavar='CSV', type=Path, help='repulsion over distance'),
    declare_option('--spring', type=float, metavar='N/M', help='stiffness of springs instead'),
    declare_option(
        '--spacing', type=float, metavar='M', required=True, help='distance of neighbours'
    ),
    declare_option('--mass', type=float, metavar='KG', required=True, help='of an element'),
    declare_option('--elements', type=int, default=25, help='in the chain; one more is held'),
    declare_option(
        '--predict', type=float, metavar='M', nargs='*', default=(), help='other spacings'
    ),
    declare_option('--output', type=Path, metavar='FOLDER', help='folder for the report'),
    JSON_OPTION,
    text=__doc__,
)
def chain(arguments: argparse.Namespace) -> int:
    """Fit, predict, report; return the exit status."""
    from rich.progress import Progress

    from mlmem.law_file import read_law_file
    from mlmem.parsing import DecodeError
    from mlmem.physics import DesignError
    from mlmem.physics.potential import StateError
    from mlmem_tools.law.curves import CurveError

    from .tracked import Chain, fit_chain, load_coupling, load_film

    lengths = (arguments.spacing, *arguments.predict)
    spring = [] if arguments.spring is None else [arguments.spring]
    given = [*lengths, arguments.mass, *spring]
    if not all(0.0 < each < math.inf for each in given):
        return print_failure('chain', 'spacings, mass and spring must be above 0 and finite', 2)
    if not 3 <= arguments.elements <= 1000:
        return print_failure('chain', f'--elements must be 3 to 1000; got {arguments.elements}', 2)
    if (arguments.coupling is None) == (arguments.spring is None):
        return print_failure('chain', 'give one of --coupling and --spring', 2)
    try:
        coupling = spring[0] if spring else load_coupling(arguments.coupling)
        film, law = load_film(arguments.track), read_law_file(arguments.law)
        made = Chain(law, coupling, arguments.spacing, arguments.mass, arguments.elements)
        _ = made.way
    except (DecodeError, DesignError) as error:
        return print_failure('chain', error, 2)
    console = create_console(aside=arguments.json)
    try:
        with Progress(console=console, transient=True) as bar:
            told = _progress_bars(bar)
            found = fit_chain(made, film, told('fitting'))
            unseen = None
            if len(film.sites) > 2:
                seen = replace(film, u=film.u[:-1], sites=film.sites[:-1])
                unseen = fit_chain(made, seen, told('leaving the last element out'))
        result = as_dict(made, film, found, unseen)
        result['predictions'] = [
            _summarise_prediction(made, found, each) for each in arguments.predict
        ]
    except (CurveError, StateError) as error:
        return print_failure('chain', error, 1)
    lines = [*describe_result(result)]
    for line in lines:
        console.print(line, soft_wrap=True)
    if result['predictions']:
        table = create_table('Other spacings', '>spacing, m', '>speed, m/s', '>elements passed')
        for row in result['predictions']:
            speed = 'none' if row['speed'] is None else f'{row["speed"]:.3g}'
            table.add_row(f'{row["spacing"]:g}', speed, f'{row["passed"]}')
        console.print(table)
    if arguments.output is not None:
        try:
            written = write_report(made, film, found, lines, result, arguments.output)
        except OSError as error:
            return print_failure('chain', f'a file could not be written; {error}', 1)
        console.print('  '.join(map(str, written)), soft_wrap=True)
    if arguments.json:
        print_json(result)
    return 0


def _progress_bars(bar: Any) -> Callable[[str], Callable[[int, float], None]]:
    """Return what makes a line of a bar of every fit."""

    def start_bar(what: str) -> Callable[[int, float], None]:
        task = bar.add_task(what, total=EXPECTED_WAVES)

        def report_progress(count: int, misfit: float) -> None:
            text = f'{what}: misfit {misfit:.3g}'
            bar.update(task, completed=min(count, EXPECTED_WAVES - 1), description=text)

        return report_progress

    return start_bar


def _wave_speed(spacing: float, arrivals: Any) -> float | None:
    """Return the speed over the second half of the elements that a wave passes, m/s."""
    at = np.flatnonzero(np.isfinite(arrivals))
    at = at[len(at) // 2 :]
    if len(at) < 2:
        return None
    return float(spacing * (at[-1] - at[0]) / (arrivals[at[-1]] - arrivals[at[0]]))


def _summarise_prediction(made: Chain, found: Found, spacing: float) -> dict[str, Any]:
    other = replace(made, spacing=spacing)
    wave = other.wave(found.damping, found.friction, found.hand, made.elements)
    passes = wave.arrivals()
    passed = int(np.isfinite(passes).sum())
    speed = _wave_speed(spacing, passes) if passed > made.elements // 2 else None
    return {'spacing': spacing, 'speed': speed, 'passed': passed}


def as_dict(made: Chain, film: Film, found: Found, unseen: Found | None) -> dict[str, Any]:
    """Return what was found as plain values, in SI units."""
    from ..measured.runs import first_crossing

    law, (low, high) = made.law, made.law.ground_states[:2]
    way, sites = made.way, np.array(film.sites) - 1
    result: dict[str, Any] = {
        name: {'value': value, 'std': std}
        for name, value, std in zip(
            ('damping', 'friction', 'hand'), (found.damping, found.friction, found.hand),
            found.deviations, strict=True,
        )
    }  # fmt: skip
    passes = found.wave.arrivals()
    result |= {
        'misfit': found.misfit,
        'set_free': float(law.energy(low) - law.energy(high)),
        'speed': _wave_speed(made.spacing, passes),
        'passed': int(np.isfinite(passes).sum()),
        'arrivals': [
            {'element': site + 1, 'measured': first_crossing(film.t, u, 0.5 * way), 'fitted': at}
            for site, u, at in zip(
                sites.tolist(), film.u, (passes[sites] + found.begin).tolist(), strict=True
            )
        ],
    }
    if unseen is not None:
        last = sites[-1]
        before = sites[-2]
        given = result['arrivals']
        result['unseen'] = {
            'element': int(last) + 1,
            'measured': given[-1]['measured'] - given[-2]['measured'],
            'predicted': float(np.diff(unseen.wave.arrivals()[[before, last]])[0]),
        }
    return result


def describe_result(result: dict[str, Any]) -> list[str]:
    """Return what was found in sentences."""
    units = ('damping', '1/s'), ('friction', 'N'), ('hand', 's')
    found = ', '.join(
        f'{name} {result[name]["value"]:.3g} +- {result[name]["std"]:.2g} {unit}'
        for name, unit in units
    )
    speed = '' if result['speed'] is None else f', in the end at {result["speed"]:.3g} m/s'
    lines = [
        found,
        f'misfit {result["misfit"]:.3g} per datum',
        f'each passage sets {1e3 * result["set_free"]:.3g} mJ free',
        f'the wave passes {result["passed"]} elements{speed}',
    ]
    if 'unseen' in result:
        left = result['unseen']
        lines.append(
            f'element {left["element"]}, left out: {1e3 * left["predicted"]:.3g} ms after the one '
            f'before it; measured {1e3 * left["measured"]:.3g} ms'
        )
    return lines


def write_report(
    made: Chain, film: Film, found: Found, lines: list[str], result: dict[str, Any], folder: Path
) -> list[Path]:
    """Write report, result and pictures; return their files.

    Raises:
        OSError: One cannot be written.
    """
    import json

    from mlmem_tools.cli.output import to_json_value

    folder.mkdir(parents=True, exist_ok=True)
    pictures = draw_fronts(made, film, found, folder)
    values, text = folder / 'chain.json', folder / 'chain.md'
    values.write_text(json.dumps(to_json_value(result), indent=1) + '\n', encoding='utf-8')
    said = '\n'.join(f'- {line}' for line in lines)
    rows = ''.join(
        f'- at a spacing of {row["spacing"]:g} m: '
        + (f'{row["speed"]:.3g} m/s' if row['speed'] else 'no wave to the end')
        + f', {row["passed"]} elements passed\n'
        for row in result['predictions']
    )
    other = f'\n## Other spacings\n\n{rows}' if rows else ''
    shown = '\n'.join(
        f'![{each.stem}]({each.name})\n' for each in pictures if each.suffix == '.png'
    )
    text.write_text(f'# What slows this chain\n\n{said}\n{other}\n{shown}', encoding='utf-8')
    return [text, values, *pictures]


def draw_fronts(made: Chain, film: Film, found: Found, folder: Path) -> list[Path]:
    """Draw the fronts, measured and fitted, and the whole wave; return the files."""
    from ..studies import style

    colours = (style.ACTIVE_COLOUR, style.MARK_COLOUR, '#009e73', '#cc79a7')
    with style.style_context():
        figure = style.new_figure(3.2)
        fronts, whole = style.axes_grid(figure, 1, 2)[0]
        for k, (site, u) in enumerate(zip(film.sites, film.u, strict=True)):
            colour = colours[k % len(colours)]
            fronts.plot(1e3 * film.t, 1e3 * u, color=colour, lw=1.0, label=f'element {site}')
            at = 1e3 * (found.wave.t + found.begin)
            fronts.plot(at, 1e3 * found.wave.u[:, site - 1], '--', color=style.INK_COLOUR, lw=0.8)
        fronts.set_xlim(1e3 * film.t[0], 1e3 * film.t[-1])
        fronts.set_xlabel('time (ms); dashed: fitted')
        fronts.set_ylabel('displacement (mm)')
        fronts.legend(fontsize=style.SMALL_FONT_SIZE - 2)
        mesh = whole.pcolormesh(
            1e3 * found.wave.t, np.arange(1, made.elements + 1), 1e3 * found.wave.u.T,
            shading='nearest', rasterized=True,
        )  # fmt: skip
        figure.colorbar(mesh, ax=whole, label='displacement (mm)')
        whole.set_xlabel('time since the push (ms)')
        whole.set_ylabel('element')
        return style.save_figure(figure, folder / 'chain')
