# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that can be set on the instrument, described and checked.

Times are in time units sqrt(m / k_r), strains are Delta l / l of the element, tension positive.
The defaults are for the paper's Case II element.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

from ..clipped import clipped
from ..described import described, problems
from .errors import SettingsError


@dataclass(frozen=True)
class Checked:
    """A group of settings that refuses values out of range when it is made."""

    def __post_init__(self) -> None:
        if found := problems(self):
            raise SettingsError('; '.join(found))


def _time(default: float, text: str, low: float = 0.0, high: float = 1e6) -> Any:
    return described(default, text, unit='time', low=low, high=high)


_speed = partial(described, unit='cells/time', low=1e-4, high=10.0)
_margin = partial(described, low=0.0, high=0.99)


@dataclass(frozen=True)
class ActuatorSettings(Checked):
    """The actuator that strains the substrate."""

    present: bool = described(
        True,
        'whether there is one: without, an element is written by kicks and pushes alone',
        listed=True,
    )
    max_strain: float = described(
        0.08, 'largest strain of either sign; a preset has its own', low=1e-6, high=0.5
    )
    max_rate: float = described(1e-4, 'highest strain rate', unit='1/time', low=1e-9, high=1.0)
    hand_rate: float = described(
        0.0,
        'highest rate of a strain set by hand: a faster one can lose the content; 0: max_rate',
        unit='1/time',
        low=0.0,
        high=1.0,
    )

    @property
    def by_hand(self) -> float:
        """Highest rate of a strain that is set by hand, in 1/time."""
        return min(self.hand_rate, self.max_rate) or self.max_rate


@dataclass(frozen=True)
class TransducerSettings(Checked):
    """What the transducers can do. A kick or a push that needs more is not made."""

    max_speed: float = described(
        1.5, 'highest speed of an end', unit='cells/time', low=1e-3, high=10.0
    )
    max_stroke: float = described(
        2.5, 'longest way of an end, as of a kick', unit='cells', low=0.0, high=10.0
    )
    max_amplitude: float = described(
        1.0, 'largest amplitude of a pulse', unit='cells', low=0.0, high=5.0
    )


@dataclass(frozen=True)
class CycleSettings(Checked):
    """One strain cycle: ramp to the peak, hold, ramp back, settle. Ramps are smooth.

    The way back can pause at a fraction of the peak: a wall that was freed quickly swings in a
    well that becomes shallow before it is released.
    """

    ramp: float = _time(1200.0, 'ramp to the peak strain', low=1.0)
    hold: float = _time(600.0, 'hold at the peak strain')
    ease: float = _time(0.0, 'ramp from the peak to the pause on the way back; 0: no pause')
    ease_to: float = described(
        0.5, 'strain of that pause, as a fraction of the peak', low=-1.0, high=1.0
    )
    release: float = _time(1200.0, 'ramp back to zero strain', low=1.0)
    settle: float = _time(1500.0, 'rest after the cycle')


@dataclass(frozen=True)
class WriteSettings(CycleSettings):
    """Launch, step and verify."""

    method: str = described(
        'strain',
        'strain: by strain cycles, as in the paper; kick: by kicks and pushes, with strain only '
        'where no kick reaches; auto: by whichever is fastest',
        choices=('strain', 'kick', 'auto'),
        listed=True,
    )
    compression: float = described(
        -0.034, 'peak strain at levels where compression frees the wall', low=-0.5, high=-1e-6
    )
    tension: float = described(
        0.048, 'peak strain at levels where tension frees the wall', low=1e-6, high=0.5
    )
    start_strain: float = described(
        0.035, 'strain under which the wall is launched', low=0.0, high=0.5
    )
    launch_speed: float = _speed(0.05, 'speed at which the boundary cell is moved')
    final_settle: float = _time(
        0.0, 'longest extra rest after the last cycle of a write, until the ends are quiet'
    )
    last_release: float = _time(
        0.0,
        'shortest ramp back to zero strain in the last cycle of a write: after a gentle end the '
        'level can be read sooner',
    )
    shaped: bool = described(
        False,
        'make each ramp of a step up in two halves, half a period of the cells at the right end '
        'apart: the cells ring less, and the level can be read sooner',
    )
    attempts: int = described(3, 'most attempts of a write', low=1, high=100, listed=True)
    escalation: float = described(
        1.1, 'factor on the peak strains at each further attempt', low=1.0, high=2.0
    )
    escalation_limit: float = described(
        1.35, 'largest such factor: a greater peak may move the wall twice', low=1.0, high=4.0
    )
    min_margin: float = _margin(0.5, 'least level margin of a written level')
    pulses: int = described(
        20,
        'pulses that a calibration tries for a step that fails; 1: only the one in the settings',
        low=1,
        high=20,
    )


@dataclass(frozen=True)
class EraseSettings(CycleSettings):
    """The kink that is driven across: a wall and a kink need opposite strains.

    The tension frees the kink but not the wall, so that the kink catches up with it.
    """

    method: str = described(
        'kink',
        'kink: drive a kink across; pulse: throw the wall out, with a kink if that fails',
        choices=('kink', 'pulse'),
        listed=True,
    )
    compression: float = described(
        -0.042, 'peak strain at levels where compression frees the kink', low=-0.5, high=-1e-6
    )
    tension: float = described(
        0.026, 'peak strain at levels where tension frees the kink', low=1e-6, high=0.5
    )
    start_strain: float = described(
        -0.03, 'strain under which the kink is launched', low=-0.5, high=0.0
    )
    launch_speed: float = _speed(0.05, 'speed at which the boundary cell is moved')
    trust_reading: bool = described(
        False, 'start to listen for a blank element once the kink is at the level last read'
    )


@dataclass(frozen=True, kw_only=True)
class JerkSettings(CycleSettings):
    """A cycle whose fast part throws the wall back."""

    not_from: str = described(
        '', 'levels from which a write does not use it, such as "1 7": there its window is narrow'
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if not all(word.isdecimal() and len(word) < 6 for word in self.not_from.split()):
            raise SettingsError(
                f'not_from must be levels separated by spaces; got {clipped(self.not_from)}'
            )

    @cached_property
    def barred(self) -> frozenset[int]:
        """Levels from which a write does not use it."""
        return frozenset(int(word) for word in self.not_from.split())


@dataclass(frozen=True)
class StrokeSettings(JerkSettings):
    """A cycle that pulls the substrate from under the wall and so changes its level.

    The strain rises slowly, swings over fast (`ease`) and is released slowly. One sign takes the
    wall down, the other up. The farther the site, the farther the same stroke moves a wall, so the
    peak falls with the site.
    """

    peak: float = described(
        0.0, 'peak strain at the last level, either sign; 0: no such stroke', low=-0.5, high=0.5
    )
    growth: float = described(
        0.0, 'exponent with which the peak grows towards the first site', low=0.0, high=3.0
    )
    levels: int = described(1, 'levels that the wall moves', low=1, high=255)
    lowest: int = described(1, 'lowest level that it starts from', low=1, high=10_000)


@dataclass(frozen=True)
class ThrowSettings(JerkSettings):
    """A pulse that throws the wall out at the left end, from any level.

    If one pulse fails, the next one, weaker or of the other sign, may succeed.
    """

    peak: float = described(0.0, 'peak strain, either sign; 0: no throw', low=-0.5, high=0.5)
    mirrored: float = described(
        -0.65, 'peak of every second pulse, relative to the others', low=-1.0, high=1.0
    )
    pulses: int = described(5, 'most pulses until the element is blank', low=1, high=100)
    levels: int = described(
        10_000,
        'levels, from 0 on, that one pulse throws the wall out of; a write, which does not listen '
        'in between, adds a pulse for each further group of so many',
        low=1,
        high=10_000,
    )


@dataclass(frozen=True)
class KickSettings(Checked):
    """The motion of the left end that sends a wall from blank to the level its speed selects."""

    speeds: str = described(
        '',
        'mean speed in cells per time unit for every level from 0 on, separated by spaces; 0: no '
        'kick to this level',
    )
    kinks: str = described(
        '',
        'the same for a kink, behind a wall that rests already; only a register needs it',
    )
    rooms: str = described(
        '',
        'relative change of its speed that the kick to every level bears, separated by spaces; '
        'with less than 0.1 it is not used. Empty: all are used',
    )
    late: float = described(
        0.0,
        'how late in the motion the end is fastest: 0 half-way, towards 1 later; then a level '
        'needs its speed less exactly',
        low=0.0,
        high=1.0,
    )
    hold: float = _time(20.0, 'hold at the other ground state')
    settle: float = _time(800.0, 'rest in which the wall comes to its level')

    def __post_init__(self) -> None:
        super().__post_init__()
        for name, least in (('speeds', '1e-4'), ('kinks', '1e-4'), ('rooms', '0')):
            given = getattr(self, name)
            try:
                sound = all(not each or float(least) <= each <= 10.0 for each in _numbers(given))
            except ValueError:
                sound = False
            if not sound:
                raise SettingsError(
                    f'{name} must be 0 or from {least} to 10, separated by spaces; got '
                    f'{clipped(given)}'
                )

    @cached_property
    def fastest(self) -> float:
        """Highest speed of a kick, relative to its mean: 1.5 if it is fastest half-way."""
        if not self.late:
            return 1.5
        s = [k / 1000.0 for k in range(1001)]
        x = [each + self.late * each * (each - 1.0) for each in s]
        return max(
            6.0 * y * (1.0 - y) * (1.0 + self.late * (2.0 * each - 1.0))
            for each, y in zip(s, x, strict=True)
        )

    @cached_property
    def by_level(self) -> tuple[float, ...]:
        """Mean speeds of walls by level; 0 where there is no kick."""
        return _numbers(self.speeds)

    def room(self, level: int) -> float:
        """Relative change of the speed that the kick to a level bears; 1 if that is not known."""
        rooms = _numbers(self.rooms)
        return rooms[level] if level < len(rooms) else 1.0

    @cached_property
    def of_kinks(self) -> tuple[float, ...]:
        """Mean speeds of kinks by level."""
        return _numbers(self.kinks)


def _numbers(text: str) -> tuple[float, ...]:
    return tuple(map(float, text.split()))


@dataclass(frozen=True)
class PushSettings(Checked):
    """The loud pulse that pushes the wall out at the left end, from any level."""

    end: str = described('right', 'end that is driven', choices=('left', 'right'))
    omega_c: float = described(0.8, 'carrier frequency', unit='rad/time', low=1e-3, high=10.0)
    A: float = described(0.0, 'amplitude; 0: no push', unit='cells', low=0.0, high=5.0)
    sigma: float = _time(5.0, 'standard deviation of the envelope', low=0.1, high=1e4)
    patience: float = _time(1200.0, 'longest wait for the wall to leave')
    settle: float = _time(200.0, 'rest before a kick, once the wall has left')
    pulses: int = described(3, 'most pulses until the wall has left', low=1, high=100)
    after: float = described(
        1.0,
        'factor on the speed of a kick that follows: waves of the pulse, still under way, brake '
        'the wall',
        low=0.5,
        high=2.0,
    )
    room: float = described(
        1.0,
        'relative change that amplitude, carrier and length bear each, from every level, with up '
        'to `pulses`; with less than 0.1 the push is not used',
        low=0.0,
        high=1.0,
    )

    @property
    def speed(self) -> float:
        """About the highest speed of the end."""
        return self.A * self.omega_c


def peak(cycles: WriteSettings | EraseSettings, compress: bool) -> float:
    """Return the peak strain that frees a wall or a kink by compression, or by tension."""
    return cycles.compression if compress else cycles.tension


@dataclass(frozen=True)
class ProbeSettings(Checked):
    """The pulse and the echo detector of one end.

    The threshold is compared with v_c exp(gain_decay t). This time-gain compensation makes up for
    the damping of every wave, exp(-eta t / 2). A decay of 0 is the paper's plain rule.
    """

    omega_c: float = described(2.1, 'carrier frequency', unit='rad/time', low=1e-3, high=10.0)
    A: float = described(0.01, 'pulse amplitude', unit='cells', low=1e-9, high=0.5)
    sigma: float = _time(8.0, 'standard deviation of the envelope', low=0.1, high=1e4)
    v_th: float = described(
        1.6e-4, 'threshold of the compensated v_c', unit='cells', low=1e-12, high=1.0
    )
    gain_decay: float = described(
        0.002, 'decay that the gain compensates: eta / 2', unit='1/time', low=0.0, high=1.0
    )
    window: float = described(
        8.0, 'averaging window of v_c', unit='carrier periods', low=0.1, high=100.0
    )


@dataclass(frozen=True)
class ReadSettings(Checked):
    """When an end is probed, and how its echo is judged."""

    end: str = described(
        'left',
        'end that a read probes from, or both',
        choices=('left', 'right', 'both'),
        listed=True,
    )
    quiet: float = described(
        0.33,
        'waves still under way up to which an element is quiet, as a fraction of the threshold',
        low=0.01,
        high=1.0,
    )
    patience: float = _time(6000.0, 'longest wait for the element to be quiet')
    rest: float = _time(
        0.0, 'wait before a pulse in a quiet element, until motion far from its ends has decayed'
    )
    min_margin: float = _margin(
        0.5, 'least level margin (1 at the calibrated delay, 0 half-way to the next)'
    )
    shaken_margin: float = _margin(0.5, 'least level margin while the base shakes')
    attempts: int = described(
        4, 'most pulses from one end while the base shakes, until two agree', low=2, high=100
    )
    noise_factor: float = described(
        1.5, 'least threshold of v_c, relative to the measured noise', low=1.1, high=100.0
    )


@dataclass(frozen=True)
class RegisterSettings(Checked):
    """Many walls in one element, of alternating kind, heard in one pulse of the left end."""

    spacing: int = described(
        0, 'least distance of two walls in levels; 0: the element holds one wall', low=0, high=255
    )
    shifted: bool = described(
        False,
        'walls enter at level 0, and cycles of strain shift all of them on: they rest at odd '
        'distances, and are read from both ends inward',
    )
    omega_c: float = described(
        1.7, 'carrier at which a wall returns a part and passes the rest', unit='rad/time',
        low=1e-3, high=10.0,
    )  # fmt: skip
    A: float = described(0.01, 'amplitude of the pulse', unit='cells', low=1e-9, high=0.5)
    sigma: float = _time(16.0, 'standard deviation of its envelope', low=0.1, high=1e4)
    listen: float = _time(900.0, 'time for which both ends are recorded after it', high=1e5)
    min_margin: float = _margin(
        0.5, 'least margin: 1 for the forecast of a word, 0 half-way to that of another'
    )

    @property
    def probe(self) -> ProbeSettings:
        """The pulse of a read."""
        return ProbeSettings(omega_c=self.omega_c, A=self.A, sigma=self.sigma)


@dataclass(frozen=True)
class ElementSettings(Checked):
    """What is known of this one element and not of its design."""

    bad_cells: str = described(
        '',
        'cells known to be bad, separated by spaces: 217 is stuck as in a blank element, 61:0.5 '
        'has half of its on-site stiffness; empty: none',
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            sound = all(
                1 < site < 100_000 and (factor is None or 0.01 <= factor <= 100.0)
                for site, factor in _cells(self.bad_cells)
            )
        except ValueError:
            sound = False
        if not sound:
            raise SettingsError(
                'bad_cells must be cells from 2 on, such as 217, or 61:0.5 with a stiffness from '
                f'0.01 to 100 times the nominal one, separated by spaces; got '
                f'{clipped(self.bad_cells)}'
            )

    @cached_property
    def stuck(self) -> tuple[int, ...]:
        """Sites of the stuck cells, from the left."""
        return tuple(sorted({site for site, factor in _cells(self.bad_cells) if factor is None}))

    @cached_property
    def weak(self) -> dict[int, float]:
        """On-site stiffness of the others over the nominal one, by site."""
        return {site: factor for site, factor in _cells(self.bad_cells) if factor is not None}

    def blocked(self, site: int) -> str:
        """Return why no wall reaches a site from the left; empty if one does."""
        first = min(self.stuck, default=site + 1)
        return f'cell {first} is stuck' if first <= site else ''


def _cells(text: str) -> list[tuple[int, float | None]]:
    """Return the sites of bad cells, each with the factor on its stiffness, or None if stuck."""
    parts = [word.partition(':') for word in text.split()]
    return [(int(site), float(factor) if colon else None) for site, colon, factor in parts]


@dataclass(frozen=True)
class DisturbanceSettings(Checked):
    """Limits of the base acceleration, in lattice constants per time unit squared."""

    max_acceleration: float = described(
        0.01,
        'largest accepted acceleration of the base, either sign',
        unit='cells/time^2',
        low=1e-9,
        high=0.05,
    )
    harmless: float = described(
        1e-4,
        'acceleration that moves no wall at any frequency: up to it the content stays known',
        unit='cells/time^2',
        low=0.0,
        high=0.05,
    )
    timeout: float = _time(
        1000.0, 'time without messages after which the base is at rest', low=1.0, high=1e9
    )


@dataclass(frozen=True)
class TimeSettings(Checked):
    """Length of a tick, and the integrator."""

    tick: float = _time(
        20.0, 'length of a tick; commands take effect between ticks', low=0.1, high=1e4
    )
    integrator: str = described(
        'pefrl',
        "pefrl, whose echoes arrive when a real element's do; or noh_bathe, the paper's",
        choices=('noh_bathe', 'pefrl'),
    )


@dataclass(frozen=True)
class ScaleSettings(Checked):
    """The dimensionless units in SI."""

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

    actuator: ActuatorSettings = ActuatorSettings()
    write: WriteSettings = WriteSettings()
    erase: EraseSettings = EraseSettings()
    down_even: StrokeSettings = StrokeSettings()
    down_odd: StrokeSettings = StrokeSettings()
    up_even: StrokeSettings = StrokeSettings()
    up_odd: StrokeSettings = StrokeSettings()
    throw: ThrowSettings = ThrowSettings()
    kick: KickSettings = KickSettings()
    push: PushSettings = PushSettings()
    transducer: TransducerSettings = TransducerSettings()
    probe: ProbeSettings = ProbeSettings()
    probe_right: ProbeSettings = ProbeSettings(omega_c=0.7, sigma=5.0, v_th=7e-4, window=4.0)
    read: ReadSettings = ReadSettings()
    register: RegisterSettings = RegisterSettings()
    element: ElementSettings = ElementSettings()
    disturbance: DisturbanceSettings = DisturbanceSettings()
    time: TimeSettings = TimeSettings()
    scale: ScaleSettings = ScaleSettings()

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
        if self.element.bad_cells and self.register.spacing:
            raise SettingsError(
                'element.bad_cells must be empty for an element with many walls '
                f'(register.spacing); got {clipped(self.element.bad_cells)}'
            )

    @property
    def tick_seconds(self) -> float:
        """Real time of a tick at speed 1, in seconds."""
        return self.time.tick * self.scale.time

    def with_stuck(self, sites: Iterable[int]) -> Settings:
        """Return settings that know more stuck cells."""
        bad = ' '.join((self.element.bad_cells, *map(str, sites))).strip()
        return dataclasses.replace(self, element=ElementSettings(bad))

    def groups(self) -> dict[str, Checked]:
        """Return the groups by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(self)}

    def as_dict(self) -> dict[str, dict[str, Any]]:
        """Return all settings by group and name."""
        return dataclasses.asdict(self)
