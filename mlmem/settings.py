# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Everything that can be set on the instrument, described and checked.

Times are in time units sqrt(m / k_r), strains are Delta l / l of the element, tension positive.
The defaults are for the paper's Case II element.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property

from .errors import Checked, ErrorCode, SettingsError
from .instrument.end import End
from .moves.clearing_pulse import ClearingPulseSettings
from .moves.kick import KickSettings
from .moves.strain_cycle import EraseSettings, WriteSettings
from .schema import Problem, describe_field, describe_time, make_field_factory

_rate = make_field_factory('1/time', 0.0, 1.0)
_carrier = make_field_factory('rad/time', 1e-3, 10.0)
_length = make_field_factory('cells', 0.0, 10.0)
_acceleration = make_field_factory('cells/time^2', 0.0, 0.05)
_margin = make_field_factory('', 0.0, 0.99)


@dataclass(frozen=True)
class ActuatorSettings(Checked):
    """The actuator that strains the substrate."""

    present: bool = describe_field(
        True,
        'whether the element has an actuator; without one only kicks write it',
    )
    max_strain: float = describe_field(0.08, 'largest strain of either sign', low=1e-6, high=0.5)
    max_rate: float = _rate(1e-4, 'highest strain rate', low=1e-9)
    hand_rate: float = _rate(
        0.0, 'highest rate of a strain set by hand: a faster one can lose the content; 0: max_rate'
    )

    @property
    def hand_rate_limit(self) -> float:
        """Highest rate of a strain that is set by hand, in 1/time."""
        return min(self.hand_rate, self.max_rate) or self.max_rate


@dataclass(frozen=True)
class TransducerSettings(Checked):
    """What the transducers can do. A kick that needs more is not made."""

    max_speed: float = describe_field(
        1.5, 'highest speed of an end', unit='cells/time', low=1e-3, high=10.0
    )
    max_stroke: float = _length(
        2.5, 'longest displacement of an end in one motion, such as a kick'
    )
    max_amplitude: float = _length(1.0, 'largest amplitude of a pulse', high=5.0)


@dataclass(frozen=True)
class ProbeSettings(Checked):
    """The pulse and the echo detector of one end.

    The threshold is compared with v_c exp(gain_decay t). This time-gain compensation makes up for
    the damping of every wave, exp(-eta t / 2). A decay of 0 is the paper's plain rule.
    """

    omega_c: float = _carrier(2.1, 'carrier frequency')
    A: float = _length(0.01, 'pulse amplitude', low=1e-9, high=0.5)
    sigma: float = describe_time(8.0, 'standard deviation of the envelope', low=0.1, high=1e4)
    v_th: float = _length(1.6e-4, 'threshold of the compensated v_c', low=1e-12, high=1.0)
    gain_decay: float = _rate(0.002, 'decay that the gain compensates: eta / 2')
    window: float = describe_field(
        8.0, 'averaging window of v_c', unit='carrier periods', low=0.1, high=100.0
    )


@dataclass(frozen=True)
class ReadSettings(Checked):
    """When an end is probed, and how its echo is judged."""

    end: str = describe_field(
        'left',
        'end, or both, from which a read probes',
        choices=('left', 'right', 'both'),
    )
    method: str = describe_field(
        'delay',
        'how one wall is read: by its echo delay; by the waveform of the pulse of `register`; or '
        'by records, the waveforms of the left end that a calibration heard',
        choices=('delay', 'waveform', 'records'),
    )
    wave_limit: float = describe_field(
        0.33,
        'amplitude of waves below which a read may begin, as a fraction of the threshold',
        low=0.01,
        high=1.0,
    )
    settle_timeout: float = describe_time(6000.0, 'longest wait for waves to fade before a read')
    rest: float = describe_time(0.0, 'additional wait before a pulse')
    min_margin: float = _margin(0.5, 'least level margin')
    shaken_margin: float = _margin(0.5, 'least level margin while the base shakes')
    attempts: int = describe_field(
        4,
        'largest number of pulses from one end while the base shakes, until two agree',
        low=2,
        high=100,
    )
    noise_factor: float = describe_field(
        1.5, 'least threshold of v_c, relative to the measured noise', low=1.1, high=100.0
    )
    kicked_gain: float = describe_field(
        5.0,
        'factor on amplitude and threshold of both pulses while `write.method` is not strain',
        low=1.0,
        high=100.0,
    )

    @property
    def primary_end(self) -> End:
        """The end whose echo names the level; the other end must confirm it."""
        return End.RIGHT if self.end == End.RIGHT else End.LEFT

    def amplify_probe(self, probe: ProbeSettings) -> ProbeSettings:
        """Return a pulse, and its threshold, times `kicked_gain`; raises `SettingsError`."""
        gain = self.kicked_gain
        return dataclasses.replace(probe, A=gain * probe.A, v_th=gain * probe.v_th)


@dataclass(frozen=True)
class RegisterSettings(Checked):
    """Many walls in one element, of alternating kind, heard in one pulse of the left end."""

    spacing: int = describe_field(
        0, 'least distance of two walls in levels; 0: the element holds one wall', low=0, high=255
    )
    omega_c: float = _carrier(1.7, 'carrier at which a wall returns a part and passes the rest')
    A: float = _length(0.01, 'amplitude of the pulse', low=1e-9, high=0.5)
    sigma: float = describe_time(16.0, 'standard deviation of its envelope', low=0.1, high=1e4)
    listen: float = describe_time(
        900.0, 'time for which both ends are recorded after it', high=1e5
    )
    min_margin: float = _margin(0.5, 'least margin between the forecasts of two words')
    max_residual: float = describe_field(
        0.5,
        'largest residual of the nearest forecast of one wall, relative to the blank response',
        low=0.01,
        high=2.0,
    )

    @property
    def probe(self) -> ProbeSettings:
        """The pulse of a read."""
        return ProbeSettings(omega_c=self.omega_c, A=self.A, sigma=self.sigma)


def _parse_bad_cell(text: str) -> tuple[int, float | None]:
    """Return the site of a bad cell, with the factor on its stiffness, or None if it is stuck."""
    site, colon, factor = text.partition(':')
    return int(site), float(factor) if colon else None


def _is_bad_cell(text: str) -> bool:
    site, factor = _parse_bad_cell(text)
    return 1 < site < 100_000 and (factor is None or 0.01 <= factor <= 100.0)


@dataclass(frozen=True)
class ElementSettings(Checked):
    """What is known of this one element and not of its design."""

    bad_cells: str = describe_field(
        '',
        'cells known to be bad, separated by spaces: 217 is stuck as in a blank element, 61:0.5 '
        'has half of its on-site stiffness; empty: none',
        words='cells from 2 on, such as 217, or 61:0.5 with a stiffness from 0.01 to 100 times '
        'the nominal one,',
        word=_is_bad_cell,
    )

    @cached_property
    def _parsed_cells(self) -> list[tuple[int, float | None]]:
        return [_parse_bad_cell(word) for word in self.bad_cells.split()]

    @cached_property
    def stuck_sites(self) -> tuple[int, ...]:
        """Sites of the stuck cells, from the left."""
        return tuple(sorted({site for site, factor in self._parsed_cells if factor is None}))

    @cached_property
    def weak_factors(self) -> dict[int, float]:
        """On-site stiffness of the others over the nominal one, by site."""
        return {site: factor for site, factor in self._parsed_cells if factor is not None}

    def explain_blocked(self, site: int) -> str:
        """Return why no wall reaches a site from the left; empty if one does."""
        first = min(self.stuck_sites, default=site + 1)
        return f'cell {first} is stuck' if first <= site else ''


@dataclass(frozen=True)
class DisturbanceSettings(Checked):
    """Limits of the base acceleration, in lattice constants per time unit squared."""

    max_acceleration: float = _acceleration(
        0.01, 'largest accepted acceleration of the base, either sign', low=1e-9
    )
    safe_limit: float = _acceleration(
        1e-4,
        'acceleration below which no wall moves, and the content stays known',
    )
    timeout: float = describe_time(
        1000.0,
        'time without messages after which the base is taken as at rest',
        low=1.0,
        high=1e9,
    )


@dataclass(frozen=True)
class TimeSettings(Checked):
    """Length of a tick."""

    tick: float = describe_time(
        20.0, 'length of a tick; commands take effect between ticks', low=0.1, high=1e4
    )


@dataclass(frozen=True)
class ScaleSettings(Checked):
    """The dimensionless units in SI."""

    time: float = describe_field(1e-4, 'one time unit sqrt(m / k_r)', unit='s', low=1e-9, high=1e3)
    length: float = describe_field(1e-2, 'one lattice constant', unit='m', low=1e-12, high=1e3)
    stiffness: float = describe_field(
        1e6, 'k_r, the stiffness of the spring between two cells', unit='N/m', low=1e-12, high=1e15
    )

    @property
    def speed(self) -> float:
        """One lattice constant per time unit, in m/s."""
        return self.length / self.time

    @property
    def force(self) -> float:
        """k_r times one lattice constant, in N."""
        return self.stiffness * self.length

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
    kick: KickSettings = KickSettings()
    clearing_pulse: ClearingPulseSettings = ClearingPulseSettings()
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
        for conflict in self._find_conflicts():
            raise SettingsError(ErrorCode.CONFLICT, *conflict)
        if self.amplifies_pulses:
            for name, probe in (('probe', self.probe), ('probe_right', self.probe_right)):
                try:
                    self.read.amplify_probe(probe)
                except SettingsError as error:
                    expected = f'{error.expected} after the factor read.kicked_gain'
                    raise SettingsError(
                        ErrorCode.CONFLICT, f'{name}.{error.field}', error.value, expected
                    ) from None

    def _find_conflicts(self) -> Iterator[Problem]:
        """Yield the values that do not fit others."""
        limit, peaks = self.actuator.max_strain, ('compression', 'tension', 'start_strain')
        for name, group in self.list_groups().items():
            for peak in filter(group.__dict__.__contains__, peaks):
                if abs(value := getattr(group, peak)) > limit:
                    expected = f'within actuator.max_strain = {limit:g}'
                    yield Problem(f'{name}.{peak}', value, expected)
        if not (self.write.uses_kicks or self.actuator.present):
            expected = 'kick or auto for an element without an actuator (actuator.present)'
            yield Problem('write.method', self.write.method, expected)
        loudest = self.transducer.max_amplitude
        if loudest < self.clearing_pulse.A:
            expected = f'at most transducer.max_amplitude = {loudest:g}'
            yield Problem('clearing_pulse.A', self.clearing_pulse.A, expected)
        if self.element.bad_cells and self.holds_words:
            expected = 'empty for an element with many walls (register.spacing)'
            yield Problem('element.bad_cells', self.element.bad_cells, expected)
        if self.read.method != 'delay' and self.element.bad_cells:
            expected = (
                'delay for an element with known bad cells (element.bad_cells), whose waveforms '
                'are compared anyway'
            )
            yield Problem('read.method', self.read.method, expected)
        if self.has_one_transducer:
            for field, value, needed in (
                ('read.end', self.read.end, 'left'),
                ('register.spacing', self.register.spacing, 0),
                ('actuator.present', self.actuator.present, False),
            ):
                if value != needed:
                    expected = f'{needed} for an element with one transducer (read.method records)'
                    yield Problem(field, value, expected)

    @property
    def holds_words(self) -> bool:
        """Whether it is a register of many walls, whose contents are words, and not levels."""
        return self.register.spacing > 0

    @property
    def has_one_transducer(self) -> bool:
        """Whether the left end is all that is driven and heard."""
        return self.read.method == 'records'

    @property
    def compares_waveforms(self) -> bool:
        """Whether a read compares waveforms with forecasts, rather than delays."""
        return self.read.method != 'delay' or self.holds_words or bool(self.element.bad_cells)

    @property
    def amplifies_pulses(self) -> bool:
        """Whether pulses are `read.kicked_gain` times as strong: where kicks move one wall."""
        return self.write.uses_kicks and not self.holds_words

    def is_kicked(self, level: int) -> bool:
        """Return whether a calibration takes the wall to a level by a kick."""
        return self.write.avoids_strain and self.kick.wall_speed(level) > 0.0

    @property
    def tick_seconds(self) -> float:
        """Real time of a tick at speed 1, in seconds."""
        return self.time.tick * self.scale.time

    def add_stuck_cells(self, sites: Iterable[int]) -> Settings:
        """Return settings that know more stuck cells."""
        bad = ' '.join((self.element.bad_cells, *map(str, sites))).strip()
        return dataclasses.replace(self, element=ElementSettings(bad))

    def list_groups(self) -> dict[str, Checked]:
        """Return the groups by name."""
        return {field.name: getattr(self, field.name) for field in dataclasses.fields(Settings)}
