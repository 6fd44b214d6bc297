# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What is known of an element: the echo delay of every level, and corrections of its pulses."""

from __future__ import annotations

import dataclasses
import hashlib
import json
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from statistics import median
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import Checked, ErrorCode, SettingsError
from ..instrument.echo import Crossings, Shape, earliest_delay
from ..instrument.end import End
from ..physics import Design
from ..physics.values import Array
from ..schema import describe_field

if TYPE_CHECKING:
    from ..settings import ProbeSettings, Settings

Records = tuple[tuple[float, ...], ...]
"""What the left end does after the pulse of a read, in its band (`Listener.project_shot`): of the
blank element, and of every level."""


@dataclass(frozen=True)
class DelayTable:
    """The delays at one end.

    Attributes:
        delays: Echo delay of every level in time units, by level.
        blank: Echo delay of a blank element, or None if it gives no echo.
        shapes: The shape of every level's echo; empty if that is not known.
    """

    delays: tuple[float, ...]
    blank: float | None = None
    shapes: tuple[Shape, ...] = ()

    def __post_init__(self) -> None:
        if not self.delays or not np.isfinite(self.delays).all():
            raise SettingsError.out_of_range(
                'delays', list(self.delays), 'finite, one for every level'
            )
        if self.blank is not None and not (
            np.isfinite(self.blank) and self.blank not in self.delays[1:]
        ):
            expected = 'a finite delay that no level but 0 has, or None'
            raise SettingsError.out_of_range('blank', self.blank, expected)
        if self.shapes and len(self.shapes) != len(self.delays):
            expected = f'{len(self.delays)}, one for every level'
            raise SettingsError.out_of_range('shapes', len(self.shapes), expected)
        if not all(known is None or np.isfinite(known) for each in self.shapes for known in each):
            raise SettingsError.out_of_range('shapes', self.shapes, 'finite, or None')
        if not all(amplitude > 0.0 for *_, amplitude in self.shapes):
            raise SettingsError.out_of_range('shapes', self.shapes, 'of echoes louder than 0')

    @property
    def longest_delay(self) -> float:
        """The delay of the farthest echo."""
        return max(self.delays if self.blank is None else (*self.delays, self.blank))

    def find_nearest(self, delay: float, without: int | None = None) -> tuple[int, float]:
        """Return the entry nearest to a delay `without` a level, or -1 for the blank entry, and
        how clear the choice is.

        Returns:
            The level, or -1 for the blank entry; and the level margin: 1 at the entry, 0 half-way
            to a neighbour, negative beyond the ends of the table.
        """
        entries = dict(enumerate(self.delays))
        if self.blank is not None:
            entries[-1] = self.blank
        if len(entries) > 1 and without is not None:
            entries.pop(without, None)
        level = min(entries, key=lambda key: abs(entries[key] - delay))
        nearest = entries.pop(level)
        offset = delay - nearest
        others = [value - nearest for value in entries.values() if value != nearest]
        same_side = [gap for gap in others if gap * offset > 0.0]
        spacing = min(map(abs, same_side or others or [nearest]))
        return level, 1.0 - 2.0 * abs(offset) / spacing

    def margin(self, level: int, offset: float, least: float) -> float:
        """Return how well an echo agrees with a level that is `offset` later than its entry: 1 at
        none, 0 at half a spacing.

        The spacing is the median one of three levels to either side, or `least`, which is that of
        the fastest waves: two levels that are near the end may have about the same delay.
        """
        about = self.delays[max(0, level - 3) : level + 4]
        steps = [abs(late - early) for early, late in pairwise(about)]
        spacing = max(least, median(steps) if steps else 0.0)
        return 1.0 - 2.0 * abs(offset) / spacing

    @cached_property
    def crossings(self) -> Array:
        """Times at which the echo of every level crosses 0.8 of the threshold, the threshold, and
        1.25 of it, shape (levels, 3); NaN where it does not.
        """
        shapes = self.shapes or [(None, None, 0.0)] * len(self.delays)
        pairs = zip(self.delays, shapes, strict=True)
        return np.array([(low, delay, high) for delay, (low, high, _) in pairs], dtype=float)

    def compare_levels(
        self, level: int, crossings: Crossings | Array, probe: ProbeSettings
    ) -> tuple[float, int]:
        """Return how much nearer an echo is to a level than to any other, and the worst other.

        It is 1 at the level's own times, 0 half-way to the other's and -1 at these; -1, too, of
        two levels with the same echo. How far two echoes are apart is the sum over the crossings
        that all have, and one before listening begins is as any other such. That is a metric:
        an echo within half of the distance of two levels of one is below 0 for the other, whatever
        they are. With a single level there is nothing to distinguish: 1, and itself.
        """
        if len(self.delays) == 1:
            return 1.0, level
        times, earliest = np.array(crossings, dtype=float), earliest_delay(probe)
        used = np.isfinite(self.crossings).all(axis=0) & np.isfinite(times)
        known = np.maximum(self.crossings[:, used], earliest)
        far = np.abs(known - np.maximum(times[used], earliest)).sum(axis=1)
        between = np.abs(known - known[level]).sum(axis=1)
        nearer = np.full(len(known), -1.0)
        np.divide(far - far[level], between, out=nearer, where=between > 0.0)
        nearer[level] = np.inf
        worst = int(nearer.argmin())
        return float(nearer[worst]), worst


# --- corrections of pulses ----------------------------------------------------------------------
# Fabrication gives every level a slightly different well. `mlmem plan` finds the corrections of a
# fitted element, and a calibration finds the speeds of its kicks.


@dataclass(frozen=True)
class PulseCorrection(Checked):
    """Factors on the pulse of a step up, or of the launch of the wall."""

    peak: float = describe_field(1.0, 'on its strains', low=0.1, high=10.0)
    times: float = describe_field(1.0, 'on its ramps and rests', low=0.1, high=10.0)
    speed: float = describe_field(1.0, 'on the speed of a launch or kick; 0: no kick', high=10.0)


@dataclass(frozen=True)
class PulseCorrections:
    """The corrections of one element, which belong to one schedule.

    Attributes:
        steps: By the level to which a pulse takes the wall; the first is of the launch.
        schedule: `hash_schedule` the settings; with others the corrections are meaningless.
        kinks: Factors on the speeds of a register's kinks, by level; of walls they are in `steps`.
    """

    steps: tuple[PulseCorrection, ...]
    schedule: str
    kinks: tuple[float, ...] = describe_field((), 'of kinks', low=0.1, high=10.0)


def hash_schedule(settings: Settings) -> str:
    """Return a hash of all settings that shape the pulses of a write."""
    write, actuator = settings.write, settings.actuator
    names = (
        'ramp', 'hold', 'ease', 'release', 'settle', 'compression', 'tension', 'start_strain',
        'ease_to', 'launch_speed', 'last_release',
    )  # fmt: skip
    values: list[float | str] = [getattr(write, name) for name in names]
    values += [actuator.max_strain, actuator.max_rate]
    if write.avoids_strain:
        values += [settings.kick.speeds, settings.kick.hold]
        values += [given for given in (settings.kick.late, settings.kick.kinks) if given]
    return _hash_values(values)


def make_corrections(
    steps: Iterable[PulseCorrection], settings: Settings
) -> PulseCorrections | None:
    """Return the corrections that belong to these settings, or None if all pulses are as set."""
    steps = tuple(steps)
    if set(steps) == {PulseCorrection()}:
        return None
    return PulseCorrections(steps, hash_schedule(settings))


def corrections_by_level(
    known: PulseCorrections | None, settings: Settings, levels: int
) -> list[PulseCorrection]:
    """Return the corrections by the level to which a pulse takes the wall.

    Without any, and with those of another schedule, all pulses are as set.
    """
    if known is None or known.schedule != hash_schedule(settings):
        return [PulseCorrection()] * levels
    return list(known.steps)


# --- both ----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Calibration:
    """The delay tables of both ends, the corrections of the pulses, and the records of contents.

    Attributes:
        left: Table of the left end.
        right: Table of the right end, which also detects a blank element.
        pulse_corrections: Corrections of launch and steps, or None if all are as in the settings.
        records: Those of an element with one transducer; empty before its calibration.
        loss_factor: Damping and friction over those of the design, of an element that is read by
            waveforms.
    """

    left: DelayTable
    right: DelayTable
    pulse_corrections: PulseCorrections | None = None
    records: Records = ()
    loss_factor: float = 1.0

    def check(self, levels: int, first: End | None = None) -> None:
        """Raise `SettingsError` unless the tables have this number of levels.

        If given, the end that names the level must distinguish all levels.
        """
        if first is not None:
            steps = np.diff(self.table(first).delays)
            if not ((steps > 0).all() or (steps < 0).all()):
                delays = [round(delay, 2) for delay in self.table(first).delays]
                expected = 'rising or falling from level to level, to tell levels apart'
                raise SettingsError(ErrorCode.CONFLICT, 'delays', delays, expected)
        for end in End:
            if (count := len(self.table(end).delays)) != levels:
                expected = f'a calibration of {levels} levels, like the design'
                raise SettingsError(ErrorCode.CONFLICT, end.value, count, expected)
        known = self.pulse_corrections
        if known is not None and (count := len(known.steps)) != levels:
            expected = f'{levels}, one for every level'
            raise SettingsError(ErrorCode.CONFLICT, 'pulse_corrections', count, expected)
        if not 0.1 <= self.loss_factor <= 10.0:
            raise SettingsError.out_of_range('loss_factor', self.loss_factor, 'from 0.1 to 10')
        lengths = {len(each) for each in self.records}
        if len(lengths) > 1 or not all(np.isfinite(each).all() for each in self.records):
            raise SettingsError(
                ErrorCode.OUT_OF_RANGE, 'records', sorted(lengths), 'finite, and equally long'
            )

    def corrections_by_level(self, settings: Settings) -> list[PulseCorrection]:
        """Return the corrections by the level to which a pulse takes the wall."""
        return corrections_by_level(self.pulse_corrections, settings, len(self.right.delays))

    def table(self, end: End) -> DelayTable:
        """Return the table of an end."""
        return self.left if end is End.LEFT else self.right


def calibration_key(design: Design, settings: Settings) -> str:
    """Return a hash of everything that delays and records depend on: design, pulses, detectors.

    What is stored under one key does not apply under another.
    """
    values = [
        design.as_dict(),
        dataclasses.asdict(settings.probe),
        dataclasses.asdict(settings.probe_right),
        settings.time.tick,
        'carrier 1',  # the detector: delays of another one do not apply
    ]
    if settings.read.method == 'records':
        values.append(dataclasses.asdict(settings.register))
    return _hash_values(values)


def _hash_values(values: list[Any]) -> str:
    text = json.dumps(values, sort_keys=True)  # every bit of a float
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
