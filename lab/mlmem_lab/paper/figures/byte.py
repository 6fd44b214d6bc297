# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a byte in the paper's element: how it is written, and what each wall answers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import Write, new_element
from mlmem.instrument.end import End
from mlmem.physics import Specimen
from mlmem.presets import preset
from mlmem.readers.echo import EchoDetector
from mlmem.readers.register import forecasts_of, resting

from ...studies import style
from ..figure import Data, Figure, Quality

FIGURE = Figure('byte', 'Many walls in one element: a byte is written and heard', seconds=60)

WORD = 0xA7

HEARD = (0x00, 0x80, WORD)
"""Words whose echoes are drawn: no wall, the farthest alone, five."""


@FIGURE.data
def compute(quality: Quality) -> Data:
    """Write a word into a blank byte, listen in three words, and try other carriers.

    Returns:
        `t`, `field` (m x N) and `v_1` of the write; `heard_t` and `heard` (v_c of each word);
        `carrier` and `apart`: least difference between two words, over the pulse.
    """
    byte = preset('byte')
    element = new_element(byte)
    register = forecasts_of(Specimen(byte.design), byte.settings)
    t, field = [], []

    def follow() -> None:
        t.append(element.ticks * element.tick)
        field.append(element.chain.configuration.astype(np.float32))

    element.perform(Write(WORD), between=follow)
    heard = []
    for word in HEARD:
        element.chain.place(resting(Specimen(byte.design), register.code.walls(word)))
        element.transducer.assume_rest()
        probe = byte.settings.register.probe
        recorder = element.transducer.shoot(End.LEFT, probe)
        element.pass_ticks(register.listener.ticks)
        element.transducer.release()
        shot = recorder.shot(0.0, 0.0, element.driver.dt)
        detector = EchoDetector(probe, shot.dt)
        detector.feed(shot.samples[0] - shot.rest[0])
        echo = detector.echo(End.LEFT)
        heard.append(echo.v_c)
    carrier = quality.pick(np.array([1.2, 1.7]), np.round(np.arange(0.8, 2.05, 0.1), 2))
    return {
        't': np.array(t),
        'field': np.array(field),
        'v_1': np.array(field)[:, 0],
        'heard_t': echo.t,
        'heard': np.array(heard),
        'carrier': carrier,
        'apart': np.array([_apart(byte, float(omega)) for omega in carrier]),
    }


def _apart(byte: Any, omega: float) -> float:
    register = dataclasses.replace(byte.settings.register, omega_c=omega)
    settings = dataclasses.replace(byte.settings, register=register)
    found = forecasts_of(Specimen(byte.design), settings)
    return float(found.nearest.min() / np.linalg.norm(found.parts[0]))


@FIGURE.drawing
def draw(data: Data) -> Any:
    """Draw the write over the motion of the left end, the echoes, and the carriers."""
    design = preset('byte').design
    figure = style.new_figure(6.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.5, 1.0))
    (above,), (below,) = style.stacked(upper)
    t = 1e-3 * data['t']
    mesh = style.contour(above, t, design.sites, data['field'])
    places = [design.defect(level) for level in range(design.levels)]
    above.set_yticks(places, [f'{level}' for level in range(design.levels)])
    above.set(ylabel='level')
    style.phase_bar(upper, mesh, above, (design.D_s1, design.D_s2))
    style.label(above, 'a', f'{WORD:#04x} is written: five kicks, the farthest first, and a pulse')
    below.plot(t, data['v_1'], color=style.INK, lw=1.0)
    below.set(ylabel='$v_1$', xlabel=style.TIME, xlim=(t[0], t[-1]))
    echo, carriers = style.axes_grid(lower, 1, 2)[0]
    colors = (style.FAINT, style.S1, style.S2)
    for word, v_c, color in zip(HEARD, data['heard'], colors, strict=True):
        echo.semilogy(data['heard_t'], np.maximum(v_c, 1e-7), color=color, label=f'{word:#04x}')
    echo.set(xlabel='time after the pulse began', ylabel='$v_c$', ylim=(1e-6, None))
    echo.legend(loc='upper right')
    style.label(echo, 'b', 'an echo of every wall')
    carriers.plot(data['carrier'], 100.0 * data['apart'], 'o-', color=style.INK, ms=4)
    carriers.axvline(preset('byte').settings.register.omega_c, color=style.MARK, ls='--')
    carriers.set(xlabel=r'carrier $\omega_c$', ylabel='least difference, %', ylim=(0.0, None))
    style.label(carriers, 'c', 'which carrier tells all words apart')
    return figure
