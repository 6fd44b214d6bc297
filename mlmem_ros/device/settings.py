# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that can be set on the instrument, described and checked.

Times are in time units sqrt(m / k_r), strains are Delta l / l of the element, tension positive.
The defaults are for the paper's Case II element.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ..described import described, problems
from .errors import SettingsError


@dataclass(frozen=True)
class Checked:
    """A group of settings that refuses values out of range when it is made."""

    def __post_init__(self) -> None:
        if found := problems(self):
            raise SettingsError('; '.join(found))


@dataclass(frozen=True)
class ActuatorSettings(Checked):
    """The actuator that strains the substrate."""

    max_strain: float = described(
        0.08, 'largest strain the actuator gives, either sign', low=1e-6, high=0.5
    )
    max_rate: float = described(
        1e-4, 'fastest change of strain', unit='1/time', low=1e-9, high=1.0
    )
    hand_rate: float = described(
        0.0,
        'fastest change of a strain that is set by hand, which an abrupt one would lose the '
        'content by; 0: as max_rate',
        unit='1/time',
        low=0.0,
        high=1.0,
    )

    @property
    def by_hand(self) -> float:
        """Fastest change of a strain that is set by hand."""
        return min(self.hand_rate, self.max_rate) or self.max_rate


@dataclass(frozen=True)
class CycleSettings(Checked):
    """One strain cycle: ramp to the peak, hold, ramp back, settle. Ramps are smooth.

    The way back can pause at a share of the peak, so that a wall set free in haste swings in a
    well that becomes shallow before it is let go.
    """

    ramp: float = described(1200.0, 'ramp to the peak strain', unit='time', low=1.0, high=1e6)
    hold: float = described(600.0, 'hold at the peak strain', unit='time', low=0.0, high=1e6)
    ease: float = described(
        0.0,
        'ramp from the peak to the pause on the way back; 0: none',
        unit='time',
        low=0.0,
        high=1e6,
    )
    ease_to: float = described(
        0.5, 'strain of that pause, as a share of the peak', low=-1.0, high=1.0
    )
    release: float = described(1200.0, 'ramp back to no strain', unit='time', low=1.0, high=1e6)
    settle: float = described(1500.0, 'rest after the cycle', unit='time', low=0.0, high=1e6)


@dataclass(frozen=True)
class WriteSettings(CycleSettings):
    """Start, step and verify."""

    compression: float = described(
        -0.034, 'peak strain that frees the wall where compression does', low=-0.5, high=-1e-6
    )
    tension: float = described(
        0.048, 'peak strain that frees the wall where tension does', low=1e-6, high=0.5
    )
    start_strain: float = described(
        0.035, 'strain under which the wall is launched', low=0.0, high=0.5
    )
    launch_speed: float = described(
        0.05, 'speed at which the boundary cell is moved', unit='cells/time', low=1e-4, high=10.0
    )
    final_settle: float = described(
        0.0,
        'longest further rest after the last cycle of a write: until the ends are quiet',
        unit='time',
        low=0.0,
        high=1e6,
    )
    last_release: float = described(
        0.0,
        'least ramp back to no strain of the last cycle of a write: a gentle end is read sooner',
        unit='time',
        low=0.0,
        high=1e6,
    )
    shaped: bool = described(
        False,
        'ramps of a step up in two half steps, half a period of the cells at the right end apart: '
        'they ring less, and are read sooner',
    )
    attempts: int = described(3, 'bound on the tries of a write', low=1, high=100)
    escalation: float = described(
        1.1, 'factor on the peak strains with every further try of a write', low=1.0, high=2.0
    )
    escalation_limit: float = described(
        1.35,
        'bound on that factor in all: beyond, a peak may move the wall twice',
        low=1.0,
        high=4.0,
    )
    min_margin: float = described(
        0.5, 'least level margin with which a level counts as written', low=0.0, high=0.99
    )
    pulses: int = described(
        20,
        'pulses that a calibration tries for a step that fails, to learn one; 1: that of the '
        'settings alone',
        low=1,
        high=20,
    )


@dataclass(frozen=True)
class EraseSettings(CycleSettings):
    """The kink that is driven across: it answers to the opposite strain of the wall.

    The tension frees the kink but not the wall, so that the kink catches up with it.
    """

    method: str = described(
        'kink',
        'kink: as here; pulse: by a throw, and by a kink where that fails',
        choices=('kink', 'pulse'),
    )
    compression: float = described(
        -0.042, 'peak strain that frees the kink where compression does', low=-0.5, high=-1e-6
    )
    tension: float = described(
        0.026, 'peak strain that frees the kink where tension does', low=1e-6, high=0.5
    )
    start_strain: float = described(
        -0.03, 'strain under which the kink is launched', low=-0.5, high=0.0
    )
    launch_speed: float = described(
        0.05, 'speed at which the boundary cell is moved', unit='cells/time', low=1e-4, high=10.0
    )
    trust_reading: bool = described(
        False, 'listen for a blank element only once the kink is where the wall was read'
    )


@dataclass(frozen=True)
class StrokeSettings(CycleSettings):
    """A cycle that draws the substrate from under the wall, which is then at another level.

    Slowly up, swung over in haste (`ease`), and slowly let go. The same stroke moves a wall
    farther at a farther site, so that its peak falls with the site. One sign takes it down, the
    other up.
    """

    peak: float = described(
        0.0, 'peak strain for the last level, either sign; 0: no such stroke', low=-0.5, high=0.5
    )
    growth: float = described(
        0.0, 'exponent with which the peak grows towards the first site', low=0.0, high=3.0
    )
    levels: int = described(1, 'levels that the wall goes', low=1, high=255)
    lowest: int = described(1, 'lowest level that it starts from', low=1, high=10_000)


@dataclass(frozen=True)
class ThrowSettings(CycleSettings):
    """A pulse that throws the wall out at the left end, from any level.

    What one leaves, the next one takes, which is weaker or has the other sign.
    """

    peak: float = described(0.0, 'peak strain, either sign; 0: no throw', low=-0.5, high=0.5)
    mirrored: float = described(
        -0.65, 'peak of every second pulse, over that of the others', low=-1.0, high=1.0
    )
    pulses: int = described(5, 'bound on the pulses until the element is blank', low=1, high=100)
    levels: int = described(
        10_000,
        'how many levels, from 0 on, one pulse takes the wall out from; a write, which does not '
        'listen in between, makes one more for every so many',
        low=1,
        high=10_000,
    )


def peak(cycles: WriteSettings | EraseSettings, compress: bool) -> float:
    """Return the peak strain that frees a wall or a kink where compression does, or tension."""
    return cycles.compression if compress else cycles.tension


@dataclass(frozen=True)
class ProbeSettings(Checked):
    """The pulse and the echo detector of one end.

    The threshold is compared with v_c exp(gain_decay t): a time-gain compensation for the
    damping, exp(-eta t / 2), that every wave suffers. A decay of 0 is the paper's plain rule.
    """

    omega_c: float = described(2.1, 'carrier frequency', unit='rad/time', low=1e-3, high=10.0)
    A: float = described(0.01, 'pulse amplitude', unit='cells', low=1e-9, high=0.5)
    sigma: float = described(
        8.0, 'standard deviation of the envelope', unit='time', low=0.1, high=1e4
    )
    v_th: float = described(
        1.6e-4, 'threshold of the compensated v_c', unit='cells', low=1e-12, high=1.0
    )
    gain_decay: float = described(
        0.002, 'decay that the gain makes up for: eta / 2', unit='1/time', low=0.0, high=1.0
    )
    window: float = described(
        8.0,
        'width of the window that v_c averages over',
        unit='carrier periods',
        low=0.1,
        high=100.0,
    )


@dataclass(frozen=True)
class ReadSettings(Checked):
    """How an echo is waited for and judged."""

    end: str = described(
        'left', 'end that a read probes from, or both', choices=('left', 'right', 'both')
    )
    quiet: float = described(
        0.1, 'share of the threshold below which the element counts as quiet', low=0.01, high=1.0
    )
    patience: float = described(
        6000.0, 'longest wait for the element to be quiet', unit='time', low=0.0, high=1e6
    )
    rest: float = described(
        0.0,
        'wait before a pulse in a quiet element, for the motion far from its ends to die away',
        unit='time',
        low=0.0,
        high=1e6,
    )
    min_margin: float = described(
        0.2,
        'least level margin (1 on the calibrated delay, 0 half-way to the next)',
        low=0.0,
        high=0.99,
    )
    shaken_margin: float = described(
        0.5, 'least level margin while the base shakes', low=0.0, high=0.99
    )
    attempts: int = described(
        4,
        'bound on the pulses from an end while the base shakes, until two say the same',
        low=2,
        high=100,
    )
    noise_factor: float = described(
        1.5, 'least threshold of v_c, over what the measured noise gives', low=1.1, high=100.0
    )


@dataclass(frozen=True)
class DisturbanceSettings(Checked):
    """How the acceleration of the base is taken; in lattice constants per time unit squared."""

    max_acceleration: float = described(
        0.01,
        'largest acceleration of the base that is taken, either sign',
        unit='cells/time^2',
        low=1e-9,
        high=0.05,
    )
    harmless: float = described(
        1e-4,
        'acceleration up to which the content counts as known: no frequency of it moves a wall',
        unit='cells/time^2',
        low=0.0,
        high=0.05,
    )
    timeout: float = described(
        1000.0,
        'time without a message after which the base is at rest',
        unit='time',
        low=1.0,
        high=1e9,
    )


@dataclass(frozen=True)
class TimeSettings(Checked):
    """How the material's time is cut."""

    tick: float = described(
        20.0, 'one tick: commands take effect between ticks', unit='time', low=0.1, high=1e4
    )
    integrator: str = described(
        'noh_bathe',
        "noh_bathe, the paper's, or pefrl: as fast, and an echo is not damped by the method",
        choices=('noh_bathe', 'pefrl'),
    )


@dataclass(frozen=True)
class ScaleSettings(Checked):
    """What the dimensionless units are in SI."""

    time: float = described(1e-4, 'one time unit sqrt(m / k_r)', unit='s', low=1e-9, high=1e3)
    length: float = described(1e-2, 'one lattice constant', unit='m', low=1e-12, high=1e3)
    stiffness: float = described(
        1e6, 'k_r: of the spring between two cells', unit='N/m', low=1e-12, high=1e15
    )

    @property
    def acceleration(self) -> float:
        """One lattice constant per time unit squared, in m/s^2."""
        return self.length / self.time**2


@dataclass(frozen=True)
class Settings:
    """All settings of the instrument."""

    actuator: ActuatorSettings = field(default_factory=ActuatorSettings)
    write: WriteSettings = field(default_factory=WriteSettings)
    erase: EraseSettings = field(default_factory=EraseSettings)
    down_even: StrokeSettings = field(default_factory=StrokeSettings)
    down_odd: StrokeSettings = field(default_factory=StrokeSettings)
    up_even: StrokeSettings = field(default_factory=StrokeSettings)
    up_odd: StrokeSettings = field(default_factory=StrokeSettings)
    throw: ThrowSettings = field(default_factory=ThrowSettings)
    probe: ProbeSettings = field(default_factory=ProbeSettings)
    probe_right: ProbeSettings = field(
        default_factory=lambda: ProbeSettings(omega_c=0.7, sigma=5.0, v_th=7e-4, window=4.0)
    )
    read: ReadSettings = field(default_factory=ReadSettings)
    disturbance: DisturbanceSettings = field(default_factory=DisturbanceSettings)
    time: TimeSettings = field(default_factory=TimeSettings)
    scale: ScaleSettings = field(default_factory=ScaleSettings)

    def __post_init__(self) -> None:
        limit = self.actuator.max_strain
        peaks = ('compression', 'tension', 'start_strain', 'peak')
        for name, group in self.groups().items():
            for peak in filter(group.__dict__.__contains__, peaks):
                if abs(value := getattr(group, peak)) > limit:
                    raise SettingsError(
                        f'{name}.{peak} must be within actuator.max_strain = {limit:g}; '
                        f'got {value:g}'
                    )

    def groups(self) -> dict[str, Checked]:
        """Return the groups by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Return all settings by group and name."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, data: Mapping[str, Mapping[str, Any]]) -> Settings:
        """Return the settings that `as_dict` gave.

        Raises:
            SettingsError: A group or a setting is not known, or out of range.
        """
        default = cls()
        try:
            groups = {name: type(getattr(default, name))(**data[name]) for name in data}
        except (AttributeError, TypeError) as error:
            raise SettingsError(f'these are no settings of a device: {error}') from error
        return cls(**groups)
