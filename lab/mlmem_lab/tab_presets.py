# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What presets do, for a page without the product: python3 -m mlmem_lab.tab_presets [FOLDER].

A page that has the loop alone needs an element's cells, and what its instrument does in every
write and erase. That is watched here: the strains and the driven ends of each way from one level
to another, up to the read that verifies it. Played back they are an open loop, with no procedure
that could mend what goes wrong. A recorded session becomes what `mlmem view` sends to a page.
"""

from __future__ import annotations

import gzip
import json
import sys
from itertools import permutations
from pathlib import Path
from typing import Any

from mlmem import Erase, MemoryElement, Write, load_element
from mlmem.element_file import Element
from mlmem.instrument.echo import blanking_time, compute_weights, listening_time, window_width
from mlmem.instrument.end import BoundaryMotion, End, EndMove, Pulse
from mlmem.instrument.motion import Motion, Profile, Ramp
from mlmem.moves.kick import KickMotion
from mlmem.physics import Chain
from mlmem.physics.values import Array
from mlmem.readers.reading import BLANK
from mlmem.settings import ProbeSettings, Settings
from mlmem_tools.view.about import About
from mlmem_tools.view.session_frame import load_frame

from .results import CHECKOUT_ROOT

Event = dict[str, Any]
"""A move of the actuator or of an end, and the time `at` which it begins."""


def describe_cells(chain: Chain) -> dict[str, Any]:
    """Return what the loop needs of a chain, as `docs/try/material.js` takes it; a list of one
    number stands for all cells.
    """
    n, cells, constants = chain.design.N, chain._cells, chain._constants
    height, a, b = cells.law
    return {
        'n': n,
        'v': _shorten_values(chain.v),
        'height': _shorten_values(height),
        'origin': _shorten_values(cells.origin),
        'mobility': _shorten_values(cells.mobility),
        'under': _shorten_values(cells.substrate),
        **{
            name: [_shorten_values(row[:n]) for row in getattr(constants, name)]
            for name in ('decay', 'kick', 'push')
        },
        'drifts': constants.drifts.tolist(),
        'a': a,
        'b': b,
        'stuck': cells.stuck.tolist(),
    }


def _shorten_values(values: Array) -> list[float]:
    told: list[float] = values.tolist()
    return told[:1] if len(set(told)) == 1 else told


def describe_preset(name: str, text: str, content: int) -> dict[str, Any]:
    """Return all that the page knows of a preset.

    Args:
        text: What the page says of it.
        content: What it holds when the page is opened.
    """
    shipped = load_element(name)
    design, settings = shipped.design_and_settings
    element = MemoryElement(shipped)
    about = About(design, settings, name).json | {'faults': {}}
    about['procedures'] = {key: {'changes': True} for key in ('write', 'erase')}
    many = settings.holds_words
    found: dict[str, Any] = {
        'text': text,
        'about': about,
        'dt': element.chain.dt,
        'nodes': element.driver.nodes,
        'length': design.end_displacement(1.0),
        'unit': settings.scale.time,
        'rate': settings.actuator.hand_rate_limit,
        'phases': [design.D_s1, design.D_s2],
        'probes': _describe_probes(element, many),
    }
    if many:
        found['register'] = _describe_register(settings)
    else:
        # from one content to another
        found['ways'] = {
            f'{start} {target}': record_transition(shipped, start, target)
            for start, target in permutations(range(BLANK, design.levels), 2)
        }
    found['begun'] = content
    element.perform(Write(content))
    found['cells'] = describe_cells(element.chain)
    return found


def _describe_probes(element: MemoryElement, many: bool) -> dict[str, Any]:
    """Return pulse and detector of both ends."""
    settings, dt = element.settings, element.chain.dt
    probes = {}
    for end in End:
        probe: ProbeSettings = settings.register.probe if many else end.select_probe(settings)
        listen = settings.register.listen if many else listening_time(element.design, probe, end)
        probes[end.value] = {
            **{key: getattr(probe, key) for key in ('A', 'omega_c', 'sigma', 'v_th')},
            'gain': probe.gain_decay,
            'weights': compute_weights(probe, dt).tolist(),
            'half': max(1, round(0.5 * window_width(probe) / dt)),
            'blanking': blanking_time(probe),
            'listen': listen,
            'delays': [] if many else list(element.calibration.table(end).delays),
        }
    return probes


def _describe_register(settings: Settings) -> dict[str, Any]:
    """Return how a byte is written: see `procedures.writing.go_to_level`."""
    kick = settings.kick
    pulse = settings.clearing_pulse
    return {
        'clearing_pulse': {'end': pulse.end, **_describe_motion(Pulse(0.0, pulse))},
        'speeds': [kick.wall_speeds, kick.kink_speeds],
        'late': kick.late,
        'hold': kick.hold,
        'settle': kick.settle,
        'cleared': pulse.settle,
    }


def record_transition(shipped: Element, start: int, target: int) -> dict[str, Any]:
    """Return what an instrument does to bring an element from one content to another: all that it
    does in one attempt or more.

    Raises:
        ValueError: The element did not follow.
    """
    element = MemoryElement(shipped)
    if start != BLANK:
        element.perform(Write(start))
    events: list[Event] = []
    known: list[Motion | BoundaryMotion] = [element.actuator.motion]

    def note_new_motions() -> None:
        begun: list[tuple[Motion | BoundaryMotion, Event]] = [(element.actuator.motion, {})]
        if (held := element.transducer.held) is not None:
            begun.append((held.motion, {'end': 'left' if held.site == 1 else 'right'}))
        for motion, end in begun:
            if all(motion is not each for each in known):
                known.append(motion)
                now = element.ticks * element.tick
                events.append({'at': now, **end, **_describe_motion(motion)})

    command = Erase() if target == BLANK else Write(target)
    outcome = element.perform(command, between=note_new_motions)
    if not outcome.success:
        raise ValueError(f'{start} to {target}: {outcome}')
    moves = [event for event in events if event.get('kind') != 'pulse']
    begun, last = moves[0]['at'], moves[-1]['at']
    probed = [event['at'] for event in events if event['at'] > last]
    played = [{**event, 'at': event['at'] - begun} for event in moves]
    return {'events': played, 'duration': probed[0] - begun}


def _describe_motion(motion: Motion | BoundaryMotion) -> Event:
    match motion:
        case Ramp(start, target, duration):
            strains = [start, target]
            return {'times': [0.0, duration], 'strains': strains, 'rates': [0.0, 0.0]}
        case Profile():
            return {'times': motion.times, 'strains': motion.strains, 'rates': motion.rates}
        case Pulse(_, probe):
            kept = {key: getattr(probe, key) for key in ('A', 'omega_c', 'sigma')}
            return {'kind': 'pulse', 'duration': motion.duration, **kept}
        case EndMove(_, target, speed):
            return {'kind': 'move', 'target': target, 'speed': speed}
    assert isinstance(motion, KickMotion)
    shape = {'late': motion.shape.late, 'hold': motion.shape.hold}
    return {'kind': 'kick', 'target': motion.target, 'speed': motion.speed, **shape}


def round_numbers(value: Any) -> Any:
    """Return a JSON value whose numbers have nine significant digits."""
    return json.loads(json.dumps(value), parse_float=lambda text: float(f'{float(text):.9g}'))


def main(folder: Path) -> None:
    """Write what the page knows."""
    file, recorded = folder / 'presets.json', folder / 'session.gz'
    # what the page says of each, and what it holds when the page is opened
    presets = {
        'case_2': ("by strain: the paper's element with eight levels", 3),
        'kick_2': ('by kicks: four levels, written without strain', 3),
        'byte': ('a byte: as many walls as there are ones', 0b1100),
    }
    described = {
        name: round_numbers(describe_preset(name, *shown)) for name, shown in presets.items()
    }
    text = json.dumps(described, separators=(',', ':'))
    file.write_text(text + '\n', encoding='utf-8')
    recorded.write_bytes(
        gzip.compress(load_frame(CHECKOUT_ROOT / 'test' / 'data' / 'life'), 9, mtime=0)
    )
    for made in (file, recorded):
        print(f'{made}: {made.stat().st_size} bytes')


if __name__ == '__main__':
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else CHECKOUT_ROOT / 'docs' / 'try')
