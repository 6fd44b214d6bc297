# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The file of an element, in YAML: everything about one element.

`format: 1`, the `design`, and those settings that differ from the defaults; keys are the names of
the fields. What a fit finds of an individual element can follow. The shipped elements in `config/`
are such files. With `based_on: case_2` a file starts from a shipped element and holds only the
values that differ from it.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import MISSING, asdict, dataclass, field, fields, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from .atomic_files import write_atomically
from .errors import ErrorCode, Rejected
from .parsing import DecodeError, decode_value, encode_value, find_line, parse_yaml, read_file
from .physics import Design, DesignError, Specimen
from .physics.values import Array
from .readers.calibration import (
    PulseCorrection,
    PulseCorrections,
    corrections_by_level,
    hash_schedule,
)
from .schema import describe_field, find_descriptions
from .settings import Settings

ELEMENT_NAMES = (
    'case_1', 'case_2', 'byte', 'bits_1', 'bits_2', 'bits_4', 'register_4', 'register_5', 'kick_2',
    'kick_4', 'robust_2', 'robust_3', 'robust_2_friction', 'robust_3_friction',
    'robust_3_one_end', 'robust_words',
)  # fmt: skip
"""Shipped elements; `bits_n`, `kick_n` and `robust_n` store n bits."""


class ElementFileError(DecodeError):
    """A file is not that of an element; the message says why."""


@dataclass(frozen=True)
class TransducerValues:
    """What a fit finds of the transducers, of the left one and of the right one.

    Attributes:
        zero: Displacement that it shows at 0, in cells.
        gain: Displacement that it shows over the true one.
        drive: Displacement that it makes over the commanded one.
        late: Time units by which it is late as a sensor.
        lag: Time units by which it is late as a driver.
    """

    zero: tuple[float, float] = (0.0, 0.0)
    gain: tuple[float, float] = (1.0, 1.0)
    drive: tuple[float, float] = (1.0, 1.0)
    late: tuple[float, float] = (0.0, 0.0)
    lag: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, eq=False)
class Element:
    """An element with its settings, as far as it is known.

    Attributes:
        specimen: The element itself; exactly as designed unless it was fitted.
        alpha_std: Standard deviation of every alpha, shape (N,); zeros unless it was fitted.
        time_unit: The instrument's time unit in true ones.
        transducers: What was found of them.
        chi2: Misfit per datum of the fit.
        undetermined: What the data do not determine.
        plan: Corrections of its pulses, or None.
        settings: Settings of its instrument.
        name: Name of its file without the ending; empty if it has none.
    """

    specimen: Specimen
    alpha_std: Array
    time_unit: float = 1.0
    transducers: TransducerValues = TransducerValues()
    chi2: float = 0.0
    data: int = 0
    undetermined: tuple[str, ...] = ()
    plan: PulseCorrections | None = None
    settings: Settings = field(default_factory=Settings)
    name: str = ''

    @property
    def design(self) -> Design:
        """The intended element."""
        return self.specimen.design

    def __repr__(self) -> str:
        return f'Element({self.name!r}, {self.specimen})'

    @property
    def design_and_settings(self) -> tuple[Design, Settings]:
        """The intended element, and the settings of its instrument."""
        return self.design, self.settings

    @property
    def timed_specimen(self) -> Specimen:
        """The element in the instrument's time, in which an instrument simulates it.

        A clock that is off by a factor scales masses and damping.
        """
        made, unit = self.specimen, self.time_unit
        return replace(made, mass=made.masses / unit**2, eta_factor=made.eta_factor / unit)

    def corrections_by_level(self, settings: Settings) -> list[PulseCorrection]:
        """Return the planned corrections by the level to which a pulse takes the wall."""
        return corrections_by_level(self.plan, settings, self.specimen.design.levels)

    def apply_planned_kicks(self, settings: Settings) -> Settings:
        """Return settings of a register with the kicks of walls and kinks as planned."""
        if self.plan is None or not settings.holds_words:
            return settings
        walls = [step.speed for step in self.plan.steps]
        return replace(settings, kick=settings.kick.scale_speeds(walls, self.plan.kinks))

    def as_dict(self) -> dict[str, Any]:
        """Return the values for a file: all that is not as designed, or not a default."""
        made = self.specimen
        design = _collect_differences(made.design)
        if made.design.phase == made.design.usual_phase:
            del design['phase']
        values: dict[str, Any] = {'format': 1, 'design': design}
        defaults = Settings().list_groups()
        for name, group in self.settings.list_groups().items():
            if changed := _collect_differences(group, defaults[name]):
                values[name] = changed
        if np.any(self.alpha_std) or (made.alpha != made.design.alpha).any():
            values |= {
                'alpha': made.alpha.tolist(),
                'alpha_std': np.asarray(self.alpha_std).tolist(),
            }
        found = {
            'mass': made.masses, 'k_r': made.k_r, 'offset': made.offsets, 'stuck': made.stuck,
            'time_unit': self.time_unit, 'transducers': self.transducers, 'chi2': self.chi2,
            'data': self.data, 'undetermined': self.undetermined, 'plan': self.plan,
        }  # fmt: skip
        for each in fields(_File):
            if each.name in found and np.any((value := found[each.name]) != each.default):
                values[each.name] = (
                    value.tolist() if isinstance(value, np.ndarray) else encode_value(value)
                )
        return values


def as_designed(design: Design, settings: Settings) -> Element:
    """Return an element that is exactly as designed."""
    return Element(Specimen(design), np.zeros(design.N), settings=settings)


def use_kicks(element: Element) -> Element:
    """Return an element that is written without strain."""
    write = replace(element.settings.write, method='kick')
    return replace(element, settings=replace(element.settings, write=write))


def _collect_differences(group: Any, default: Any = None) -> dict[str, Any]:
    """Return the fields that differ from a default, or from those of the class, for a file."""
    values, described_fields = asdict(group), dict(find_descriptions(group))
    found = {}
    for each in fields(group):
        if values[each.name] != (getattr(default, each.name) if default else each.default):
            row = described_fields.get(each)
            found[each.name] = (
                list(map(_parse_word, values[each.name].split()))
                if row and row.words
                else values[each.name]
            )
    return found


def _parse_word(word: str) -> int | float | str:
    """Return a word of a text as a file has it."""
    for kind in (int, float):
        try:
            return kind(word)
        except ValueError:
            continue
    return word


@dataclass(frozen=True, eq=False, kw_only=True)
class _File(Settings):
    """The keys of a file: all groups of settings, and these."""

    format: int = describe_field(MISSING, 'version of the format', low=1, high=1)
    design: Design = describe_field(MISSING, 'the intended element')
    alpha: Array | None = describe_field(None, 'amplification of every cell', low=0.0)
    alpha_std: Array | None = describe_field(None, 'its standard deviation', low=0.0, high=1e9)
    k_r: float | Array = describe_field(1.0, 'springs between the cells', low=1e-3, high=1e3)
    mass: float | Array = describe_field(1.0, 'masses', low=1e-3, high=1e3)
    offset: float | Array = 0.0
    stuck: tuple[int, ...] = ()
    time_unit: float = describe_field(1.0, "the instrument's time unit", low=0.5, high=2.0)
    transducers: TransducerValues = TransducerValues()
    chi2: float = describe_field(0.0, 'misfit per datum', low=0.0)
    data: int = describe_field(0, 'number of data', low=0, high=2**62)
    undetermined: tuple[str, ...] = ()
    plan: PulseCorrections | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        try:
            self.design.require_memory()
        except DesignError as error:
            raise ElementFileError.of_error(error, 'design') from error
        n = self.design.N
        sizes = {'alpha': n, 'alpha_std': n, 'k_r': n - 1, 'mass': n, 'offset': n}
        for name, size in sizes.items():
            values = getattr(self, name)
            if isinstance(values, np.ndarray) and values.shape != (size,):
                expected = f'{size} numbers'
                raise ElementFileError(ErrorCode.CONFLICT, name, values.size, expected)
        factor, most = self.alpha_factor, 100.0
        if outside := factor[~((factor >= 1.0 / most) & (factor <= most))].tolist():
            raise ElementFileError.out_of_range(
                'alpha',
                outside[0],
                f"from 1/{most:g} to {most:g} times the design's",
            )
        levels, plan = self.design.levels, self.plan
        if plan and not (len(plan.steps) == levels and len(plan.kinks) in (0, levels)):
            counts = f'{len(plan.steps)} steps, {len(plan.kinks)} kinks'
            expected = f'of steps, and kinks if any, to {levels} levels'
            raise ElementFileError(ErrorCode.CONFLICT, 'plan', counts, expected)

    @property
    def alpha_factor(self) -> Array:
        """Amplification of every cell over the design's, shape (N,)."""
        if self.alpha is None:
            return np.ones(self.design.N)
        return np.asarray(self.alpha / self.design.alpha)


def _complete_values(data: Any) -> Any:
    """Return the values of a file over those of the shipped element on which it is based; the
    groups of settings that it has are complete.

    Raises:
        DecodeError: There is no such shipped element.
    """
    if not isinstance(data, Mapping):
        return data
    values, base = dict(data), encode_value(Settings())
    if 'based_on' in data:
        if (name := values.pop('based_on')) not in ELEMENT_NAMES:
            known = ', '.join(ELEMENT_NAMES)
            raise DecodeError.out_of_range('based_on', name, f'one of {known}')
        shipped = load_element(name)
        base = shipped.as_dict() | encode_value(shipped.settings)
        values = {**base, **values}
    for key in base.keys() & values.keys():
        if isinstance(base[key], Mapping) and isinstance(values[key], Mapping):
            values[key] = {**base[key], **values[key]}
    return values


def text_of(element: Element) -> str:
    """Return an element as the text of a file, which `parse` reads back."""
    import yaml  # type: ignore[import-untyped]

    class Dumper(yaml.SafeDumper):  # type: ignore[misc]
        """One key a line, and lists on theirs."""

    for kind in (list, tuple):
        Dumper.add_representer(
            kind, lambda dumper, values: dumper.represent_sequence(
                'tag:yaml.org,2002:seq', values, flow_style=True
            )
        )  # fmt: skip
    text: str = yaml.dump(element.as_dict(), Dumper=Dumper, sort_keys=False, width=90)
    return text


def write_element_file(path: Path, element: Element) -> None:
    """Write an element to a file, whole or not at all.

    Raises:
        OSError: It cannot be written; a file that was there is as it was.
    """
    write_atomically(path, text_of(element))


def parse(text: str, source: str, name: str = '') -> Element:
    """Return the element in the text of a file, as `text_of` returns it or a person writes it.

    Args:
        text: YAML.
        source: Where the text is from, for messages.
        name: Name of the element.

    Raises:
        ElementFileError: The text is not an element; the message names the line.
    """
    try:
        given: _File = decode_value(_File, _complete_values(parse_yaml(text)))
        made = Specimen(
            given.design, given.alpha_factor, k_r_factor=given.k_r, mass=given.mass,
            offset=given.offset, stuck=given.stuck,
        )  # fmt: skip
    except Rejected as error:
        line = find_line(text, error.field) if error.field else 0
        place = f'{source}, line {line}' if line else source
        raise ElementFileError.of_error(error, place=place) from error
    deviations = np.zeros(given.design.N) if given.alpha_std is None else given.alpha_std
    settings = Settings(**{each.name: getattr(given, each.name) for each in fields(Settings)})
    return Element(
        made, deviations, given.time_unit, given.transducers, given.chi2, given.data,
        given.undetermined, given.plan, settings, name,
    )  # fmt: skip


def read_element_file(path: Path) -> Element:
    """Read the file of an element.

    Raises:
        ElementFileError: It cannot be read, or is none; the message names the line.
    """
    try:
        text = read_file(path)
    except DecodeError as error:
        raise ElementFileError.of_error(error, place=str(path)) from error
    return parse(text, str(path), path.stem)


def read_matching_element(path: Path, design: Design, settings: Settings | None = None) -> Element:
    """Read the file of an element that must be one of a design.

    Raises:
        ElementFileError: It cannot be read, has other cells and defects, or pulses for others.
    """
    element = read_element_file(path)
    found = element.specimen.design.cells
    if found != design.cells:
        expected = f'one with the N, J, J_s and tail of the other, {design.cells}'
        raise ElementFileError(ErrorCode.CONFLICT, 'design', found, expected, place=str(path))
    if settings and element.plan and element.plan.schedule != hash_schedule(settings):
        planned, expected = element.plan.schedule, 'for these settings, as `mlmem plan` makes one'
        raise ElementFileError(ErrorCode.CONFLICT, 'plan', planned, expected, place=str(path))
    return element


def load_element(source: str | Path) -> Element:
    """Return a shipped element by its name, or the element in a file by its path.

    Raises:
        ElementFileError: There is no such file, or it is not that of an element.
    """
    if isinstance(source, (str, Path)):
        if source in ELEMENT_NAMES:
            return _load_shipped(str(source))
        path = Path(os.path.expanduser(source))  # as it is if there is no such user
        if os.path.exists(path):  # false for a name that is too long, too
            return read_element_file(path)
        source = str(source)
    expected = f'one of {", ".join(ELEMENT_NAMES)}, or the path of an element file'
    raise ElementFileError.out_of_range('element', source, expected)


def element_path(source: str) -> str:
    """Return the name of a shipped element, or the absolute path of an element file, for a node
    that may run in another folder.

    Raises:
        ElementFileError: As `load_element`.
    """
    load_element(source)
    return source if source in ELEMENT_NAMES else str(Path(os.path.expanduser(source)).absolute())


@cache
def _load_shipped(name: str) -> Element:
    # setup.py puts the files here; a checkout has them in `config/` alone
    folder = Path(__file__).parent / 'elements'
    if not folder.is_dir():
        folder = Path(__file__).resolve().parent.parent / 'config'
    return read_element_file(folder / f'{name}.yaml')
