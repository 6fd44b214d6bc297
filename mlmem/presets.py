# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shipped elements, each complete: a design, and the settings of its instrument.

Table I of the paper, and elements of 1 to 13 bits. Anything not given here has the default in
`Settings`, which is for Case II. Times are in time units. docs/presets.md
describes how the schedules were found.
"""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from typing import NamedTuple

from .move_settings import ClearingPulseSettings, EraseSettings, KickSettings, WriteSettings
from .physics import CASE_I, CASE_II, Design, DesignError
from .settings import (
    ActuatorSettings,
    ProbeSettings,
    ReadSettings,
    RegisterSettings,
    Settings,
    TransducerSettings,
)


class Preset(NamedTuple):
    """An element with the settings of its instrument: `new_element(preset('bits_4'))`."""

    design: Design
    settings: Settings

    @property
    def digest(self) -> str:
        """A hash of every bit of it that is not a default, so that a new setting changes none."""
        defaults, values = Settings().as_dict(), {'design': self.design.as_dict()}
        for name, group in self.settings.as_dict().items():
            if given := {key: it for key, it in group.items() if it != defaults[name][key]}:
                values[name] = given
        text = json.dumps(values, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


DEFAULT = 'case_2'
"""The default preset."""

Peaks = tuple[float, float]
"""Peak strains: of compression, of tension."""


def hand_rate(N: int) -> float:
    """Return the strain rate in 1/time at which a strain set by hand keeps the content of N cells.

    Measured on every preset: below the strain that frees its wall, none is lost at this rate, some
    at twice the rate. A longer substrate sways longer.
    """
    return min(5e-5, float(f'{0.016 / N:.1e}'))


def _fast_actuator(N: int) -> ActuatorSettings:
    """Return an actuator of N cells that is fast in a procedure, and slow by hand."""
    return ActuatorSettings(max_strain=0.15, max_rate=5e-3, hand_rate=hand_rate(N))


LATE_KICK = 0.7
"""With nine cells a level: the end is fastest late, which widens the windows at high speeds."""

_KICK_SPEEDS_9 = (0.002, 0.0039, 0.007, 0.0106, 0.0146, 0.0191, 0.0241)
"""Speeds of kicks with eta = 1/250, to every level whose kick bears a change of at least 0.1."""


def nine_cell_kicks(levels: int) -> KickSettings:
    """Return the kicks of an element of nine cells a level with eta = 1/250, as `mlmem kicks`
    found them.
    """
    speeds = ' '.join(f'{speed:g}' for speed in _KICK_SPEEDS_9[:levels])
    return KickSettings(speeds, late=LATE_KICK, erase_settle=1600.0)


_CASE_2 = Preset(
    CASE_II,
    Settings(
        actuator=_fast_actuator(CASE_II.N),
        kick=KickSettings(
            '0.006 0.0145 0.0316 0.053 0.0793 0.1207 0.18 0.258',
            rooms='0.51 0.58 0.33 0.23 0.17 0.26 0.15 0.23',
        ),
    ),
)
"""The paper's second element, with eight levels. The ranges in which its settings work:

- `write.compression` -0.021 to beyond -0.054, `write.tension` 0.0363 to the actuator's limit:
  compression frees the wall at even levels, tension at odd ones;
- `erase.compression` -0.032 and stronger, `erase.tension` 0.016 to 0.036: beyond, it also frees
  the wall, ahead of the kink;
- the carrier of `probe` is inside the band of s2 and above that of s1. That of `probe_right` is
  inside the band of s1 and below that of s2; its pulse is short, so that it ends before the
  nearest level's echo.
"""


def _case_1() -> Preset:
    """Return the paper's first element: one defect, so blank or written.

    Its potential is six times weaker, its wall wider and its echo fainter.
    """
    settings = Settings(
        actuator=ActuatorSettings(hand_rate=hand_rate(CASE_I.N)),
        write=WriteSettings(start_strain=0.03),
        # The wall is too wide to reflect except near the band's upper edge.
        probe=ProbeSettings(omega_c=1.95, v_th=1.7e-4),
        # A longer pulse: the window between the lower band edges is narrow.
        probe_right=ProbeSettings(omega_c=0.30, sigma=16.0, v_th=1e-3, window=8.0),
    )
    return Preset(CASE_I, settings)


def _byte() -> Preset:
    """Return the paper's second element with many walls: 256 words, written without strain."""
    settings = _CASE_2.settings
    return _CASE_2._replace(
        settings=replace(
            settings,
            write=replace(settings.write, method='kick'),
            transducer=replace(settings.transducer, max_amplitude=1.2, max_speed=2.0),
            kick=KickSettings(
                speeds='0.004 0.015 0.035 0.055 0.08 0.12 0.18 0.26',
                kinks='0.004 0.011 0.025 0.04 0.055 0.08 0.11 0.15',
                settle=1000.0,
            ),
            clearing_pulse=ClearingPulseSettings(
                end='left', A=1.2, omega_c=1.6, sigma=10.0, settle=2000.0
            ),
            register=RegisterSettings(spacing=1),
        )
    )


def _register(
    *,
    levels: int,
    J: int,
    beta: float,
    eta: float,
    register: RegisterSettings,
    clearing_pulse: ClearingPulseSettings,
    kick: KickSettings,
) -> Preset:
    """Return an element for many walls, written without strain.

    A deeper potential makes walls narrower, and deeper defects keep neighbours apart with fewer
    cells a level than in the paper's second element. A kick has a speed for each level.
    """
    design = Design(
        N=(levels + 1) * J + 1, gamma=-1.3e-4, beta=beta, J=J, J_s=2 * J, j_0=0.7 * J, d=0.05,
        eta=eta, tail=J,
    )  # fmt: skip
    settings = Settings(
        actuator=ActuatorSettings(present=False),
        write=WriteSettings(method='kick'),
        transducer=TransducerSettings(max_amplitude=1.2, max_speed=2.0),
        kick=kick,
        clearing_pulse=clearing_pulse,
        probe=ProbeSettings(v_th=4e-4, gain_decay=eta / 2),
        probe_right=replace(Settings().probe_right, gain_decay=eta / 2),
        read=ReadSettings(patience=50.0 / eta),
        register=register,
    )
    return Preset(design, settings)


def _nine_cells(
    *,
    N: int,
    write: WriteSettings,
    erase: EraseSettings,
    right: tuple[float, float, float],
    patience: float,
    eta: float = 1 / 250,
    kick: KickSettings | None = None,
) -> Preset:
    """Return an element found by `mlmem_lab.designer`: Case II's cells, nine per level."""
    omega_c, sigma, v_th = right
    design = Design(
        N=N, gamma=-3e-5, beta=-1 / 20, J=9, J_s=18, j_0=6.84, d=0.0380, eta=eta, tail=54
    )
    settings = Settings(
        actuator=_fast_actuator(N),
        write=write,
        erase=erase,
        kick=kick or nine_cell_kicks(design.levels),
        # A short pulse: of all levels only the first is so near that its delay says no more.
        probe=ProbeSettings(omega_c=2.039, sigma=6.0, v_th=1.2e-4, gain_decay=eta / 2),
        probe_right=replace(
            Settings().probe_right, omega_c=omega_c, sigma=sigma, v_th=v_th, gain_decay=eta / 2
        ),
        read=ReadSettings(end='right', patience=patience),
    )
    return Preset(design, settings)


def _write(
    ramp: float, hold: float, ease: float, release: float, peaks: Peaks, ease_to: float = 0.03
) -> WriteSettings:
    """Return a write that eases nearly all the way back and so places the wall gently."""
    return WriteSettings(
        ramp=ramp, hold=hold, ease=ease, ease_to=ease_to, release=release, settle=0.0,
        final_settle=1000.0, last_release=60.0, compression=peaks[0], tension=peaks[1],
        start_strain=0.02, launch_speed=0.002, shaped=True,
    )  # fmt: skip


def _erase(ramp: float, hold: float, settle: float, peaks: Peaks) -> EraseSettings:
    """Return an erase that first listens when the kink is where the wall was read."""
    return EraseSettings(
        ramp=ramp, hold=hold, release=ramp, settle=settle, compression=peaks[0], tension=peaks[1],
        start_strain=-0.02, launch_speed=0.002, trust_reading=True,
    )  # fmt: skip


def written_by_kicks(element: Preset) -> Preset:
    """Return an element that is written without strain."""
    write = replace(element.settings.write, method='kick')
    return element._replace(settings=replace(element.settings, write=write))


PRESETS = {
    'case_1': _case_1(),
    'case_2': _CASE_2,
    'byte': _byte(),
    'bits_1': _nine_cells(
        N=81, right=(0.693, 16.0, 8.9e-4), patience=6200.0,
        write=_write(120.0, 60.0, 300.0, 20.0, (-0.024, 0.021), ease_to=0.06),
        erase=_erase(600.0, 200.0, 600.0, (-0.0229, 0.0112)),
    ),
    'bits_2': _nine_cells(
        N=99, right=(0.693, 16.0, 8.7e-4), patience=6200.0,
        write=_write(140.0, 20.0, 440.0, 20.0, (-0.0219, 0.0254)),
        erase=_erase(600.0, 200.0, 600.0, (-0.0229, 0.0111)),
    ),
    'bits_4': _nine_cells(
        N=207, right=(0.691, 16.0, 7.9e-4), patience=6500.0,
        write=_write(280.0, 40.0, 460.0, 20.0, (-0.0165, 0.026)),
        erase=_erase(600.0, 200.0, 600.0, (-0.0226, 0.011)),
    ),
}  # fmt: skip
PRESETS |= {
    'register_4': _register(
        levels=11, J=20, beta=-0.16, eta=1 / 360,
        register=RegisterSettings(spacing=1, sigma=12.0, listen=1200.0),
        clearing_pulse=ClearingPulseSettings(
            end='left', A=0.9, omega_c=1.6, sigma=20.0, settle=3000.0
        ),
        kick=KickSettings(
            '0.0018 0.0061 0.0116 0.0185 0.0265 0.0357 0.047 0.0617 0.0821 0.125 0.3009',
            kinks='0.0017 0.0044 0.0087 0.0137 0.0195 0.0267 0.0349 0.0447 0.0576 0.0754 0.15',
            late=0.85, settle=1200.0,
        ),
    ),
    'register_5': _register(
        levels=13, J=22, beta=-0.14, eta=1 / 475,
        register=RegisterSettings(spacing=1, omega_c=1.75, sigma=16.0, listen=1500.0),
        clearing_pulse=ClearingPulseSettings(
            end='left', A=0.9, omega_c=1.6, sigma=20.0, settle=4500.0
        ),
        kick=KickSettings(
            '0.0015 0.0036 0.0072 0.0112 0.0162 0.0219 0.0281 0.0357 0.0447 0.0559 0.072 0.1023 '
            '0.2472',
            kinks='0.0014 0.0028 0.0051 0.0082 0.0119 0.0159 0.0208 0.0261 0.0328 0.0403 0.0492 '
            '0.0639 0.15',
            late=1.0, settle=1500.0,
        ),
    ),
    'kick_2': written_by_kicks(_nine_cells(
        N=99, eta=1 / 100, right=(0.692, 16.0, 1.1e-3), patience=2700.0,
        write=_write(160.0, 20.0, 240.0, 20.0, (-0.0196, 0.026)),
        erase=_erase(500.0, 80.0, 240.0, (-0.0227, 0.0111)),
        kick=KickSettings(
            '0.0031 0.0103 0.0222 0.0367', rooms='0.55 0.6 0.33 0.23', late=LATE_KICK,
            settle=400.0, erase_settle=600.0,
        ),
    )),
    'kick_4': written_by_kicks(_nine_cells(
        N=207, eta=1 / 168, right=(0.691, 16.0, 8.7e-4), patience=4500.0,
        write=_write(280.0, 40.0, 460.0, 20.0, (-0.0165, 0.026)),
        erase=_erase(600.0, 200.0, 600.0, (-0.0226, 0.011)),
        kick=KickSettings(
            '0.0024 0.0057 0.0112 0.0177 0.0251 0.0335 0.043 0.0539 '
            '0.0664 0.0811 0.0989 0.1213 0.1488 0.1845 0.24 0.3981',
            rooms='0.2 0.51 0.29 0.21 0.16 0.14 0.12 0.11 '
            '0.1 0.1 0.1 0.1 0.1 0.12 0.15 0.2',
            late=LATE_KICK,
        ),
    )),
}  # fmt: skip
"""By name: `bits_n` and `kick_n` store n bits. docs/reference/presets.md has all schedules."""


def preset(name: str) -> Preset:
    """Return a shipped element by its name in `PRESETS`.

    Raises:
        DesignError: There is no such preset.
    """
    try:
        return PRESETS[name]
    except KeyError:
        raise DesignError(f'preset must be one of {", ".join(PRESETS)}; got {name!r}') from None
