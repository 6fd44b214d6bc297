# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Ours: a byte in the paper's element: how it is written, and what each wall answers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from mlmem import MemoryElement, Write, load_element
from mlmem.physics import Specimen
from mlmem.readers.register import forecast_words, pin_walls

from ...studies import style
from ..echoes import probe_element
from ..figure import Data, Figure, Quality

definition = Figure('byte', 'Many walls in one element: a byte is written and heard', seconds=60)


@definition.register_data
def compute_data(quality: Quality) -> Data:
    """Write a word into a blank byte, listen in three words, and try other carriers.

    Returns:
        `t` and `field` (m x N) of the write of the last of some `words`: no wall, the farthest
        alone, five; `heard_t` and `heard` (v_c of each word);
        `carrier` and `apart`: least difference between two words, over the pulse.
    """
    byte, words = load_element('byte'), (0x00, 0x80, 0xA7)
    element = MemoryElement(byte)
    register = forecast_words(Specimen(byte.design), byte.settings)
    t, field = [], []

    def follow_wall() -> None:
        t.append(element.ticks * element.tick)
        field.append(element.chain.configuration.astype(np.float32))

    element.perform(Write(words[-1]), between=follow_wall)
    heard, listen_time = [], register.listener.ticks * element.tick
    for word in words:
        v = pin_walls(Specimen(byte.design), register.code.walls(word))
        echo = probe_element(byte.design, v, byte.settings.register.probe, duration=listen_time)
        heard.append(echo.v_c)
    carrier = quality.pick(np.array([1.2, 1.7]), np.round(np.arange(0.8, 2.05, 0.1), 2))
    return {
        't': np.array(t),
        'field': np.array(field),
        'words': np.array(words),
        'heard_t': echo.t,
        'heard': np.array(heard),
        'carrier': carrier,
        'apart': np.array([_word_separation(byte, float(omega)) for omega in carrier]),
    }


def _word_separation(byte: Any, omega: float) -> float:
    register = dataclasses.replace(byte.settings.register, omega_c=omega)
    settings = dataclasses.replace(byte.settings, register=register)
    found = forecast_words(Specimen(byte.design), settings)
    return float(found.nearest_distances.min() / np.linalg.norm(found.parts[0]))


@definition.register_drawing
def draw_figure(data: Data) -> Any:
    """Draw the write over the motion of the left end, the echoes, and the carriers."""
    byte = load_element('byte')
    design = byte.design
    figure = style.new_figure(6.4)
    upper, lower = figure.subfigures(2, 1, height_ratios=(1.5, 1.0))
    (above,), (below,) = style.stacked_axes(upper)
    t = 1e-3 * data['t']
    mesh = style.draw_contour(above, t, design.sites, data['field'])
    places = [design.defect_site(level) for level in range(design.levels)]
    above.set_yticks(places, [f'{level}' for level in range(design.levels)])
    above.set(ylabel='level')
    style.phase_bar(upper, mesh, above, (design.D_s1, design.D_s2))
    style.label_panel(
        above,
        'a',
        f'{data["words"][-1]:#04x} is written: five kicks, the farthest first, and a pulse',
    )
    below.plot(t, data['field'][:, 0], color=style.Colour.INK, lw=1.0)
    below.set(ylabel='$v_1$', xlabel=style.Label.TIME, xlim=(t[0], t[-1]))
    echo, carriers = style.axes_grid(lower, 1, 2)[0]
    colors = (style.Colour.FAINT, style.Colour.INACTIVE, style.Colour.ACTIVE)
    for word, v_c, color in zip(data['words'], data['heard'], colors, strict=True):
        echo.semilogy(data['heard_t'], np.maximum(v_c, 1e-7), color=color, label=f'{word:#04x}')
    echo.set(xlabel='time after the pulse began', ylabel='$v_c$', ylim=(1e-6, None))
    echo.legend(loc='upper right')
    style.label_panel(echo, 'b', 'an echo of every wall')
    carriers.plot(data['carrier'], 100.0 * data['apart'], 'o-', color=style.Colour.INK, ms=4)
    carriers.axvline(byte.settings.register.omega_c, color=style.Colour.MARK, ls='--')
    carriers.set(xlabel=r'carrier $\omega_c$', ylabel='least difference, %', ylim=(0.0, None))
    style.label_panel(carriers, 'c', 'which carrier tells all words apart')
    return figure
