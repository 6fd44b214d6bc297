# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The file of an individual element: `element.yaml`, as a fit writes it and a node uses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .atomic_files import write_atomically
from .moves.corrections import AS_SET, PulseCorrection, PulseCorrections, schedule_of
from .parsing import DecodeError, decode, from_yaml, read
from .physics import Design, Specimen
from .physics.potential import Array
from .schema import described, short_repr
from .settings import Settings

FORMAT = 1
"""Version of this format."""


MOST = 100.0
"""Greatest factor between the amplification of a cell and the design's."""


class ElementFileError(DecodeError):
    """A file is not that of an element; the message says why."""


@dataclass(frozen=True, eq=False)
class Element:
    """An individual element, as far as it is known.

    Attributes:
        alpha_std: Standard deviation of every alpha, shape (N,).
        time_unit: The instrument's time unit in true ones.
        transducers: Zero, gain and drive of both ends.
        chi2: Misfit per datum of the fit.
        untold: What the data could not tell.
        plan: PulseCorrections of its pulses, or None.
    """

    specimen: Specimen
    alpha_std: Array
    time_unit: float = 1.0
    transducers: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    chi2: float = 0.0
    data: int = 0
    untold: tuple[str, ...] = ()
    plan: PulseCorrections | None = None

    @property
    def timed(self) -> Specimen:
        """The element in the instrument's time, in which an instrument simulates it.

        A clock that is off by a factor scales masses and damping.
        """
        made, unit = self.specimen, self.time_unit
        return replace(made, mass=made.masses / unit**2, eta_factor=made.eta_factor / unit)

    def pulses(self, settings: Settings) -> list[PulseCorrection]:
        """Return corrections of launch and steps by level: as planned, or as in the settings."""
        if self.plan is None or self.plan.schedule != schedule_of(settings):
            return [AS_SET] * self.specimen.design.levels
        return list(self.plan.steps)

    def kicks(self, settings: Settings) -> Settings:
        """Return settings of a register with the kicks of walls and kinks as planned."""
        if self.plan is None or not settings.register.spacing:
            return settings
        kick, walls = settings.kick, [step.speed for step in self.plan.steps]
        speeds, kinks = (
            ' '.join(f'{factor * speed:.6g}' for factor, speed in zip(factors, each, strict=False))
            for factors, each in ((walls, kick.by_level), (self.plan.kinks, kick.of_kinks))
        )
        return replace(settings, kick=replace(kick, speeds=speeds, kinks=kinks))

    def as_dict(self) -> dict[str, Any]:
        """Return the values for a file."""
        made = self.specimen
        values: dict[str, Any] = {
            'format': FORMAT,
            'design': made.design.as_dict(),
            'alpha': made.alpha.tolist(),
            'alpha_std': np.asarray(self.alpha_std).tolist(),
        }
        if (made.masses != 1.0).any():
            values['mass'] = made.masses.tolist()
        if (made.k_r != 1.0).any():
            values['k_r'] = made.k_r.tolist()
        if made.offsets.any():
            values['offset'] = made.offsets.tolist()
        if made.stuck:
            values['stuck'] = list(made.stuck)
        return values | {
            'time_unit': self.time_unit,
            'transducers': {name: list(pair) for name, pair in self.transducers.items()},
            'chi2': self.chi2,
            'data': self.data,
            'untold': list(self.untold),
            **({'plan': self.plan.as_dict()} if self.plan else {}),
        }


@dataclass(frozen=True, eq=False)
class _File:
    """The keys of a file."""

    format: int = described(MISSING, 'version of the format', low=FORMAT, high=FORMAT)
    design: Design = described(MISSING, 'the intended element')
    alpha: Array = described(MISSING, 'amplification of every cell', low=0.0)
    alpha_std: Array = described(MISSING, 'its standard deviation', low=0.0, high=1e9)
    k_r: float | Array = described(1.0, 'springs between the cells', low=1e-3, high=1e3)
    mass: float | Array = described(1.0, 'masses', low=1e-3, high=1e3)
    offset: float | Array = 0.0
    stuck: tuple[int, ...] = ()
    time_unit: float = described(1.0, "the instrument's time unit", low=0.5, high=2.0)
    transducers: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    chi2: float = described(0.0, 'misfit per datum', low=0.0)
    data: int = described(0, 'number of data', low=0, high=2**62)
    untold: tuple[str, ...] = ()
    plan: PulseCorrections | None = None

    def __post_init__(self) -> None:
        factor, n = self.alpha / self.design.alpha, self.design.N
        if self.alpha.shape != (n,) or self.alpha_std.shape != (n,):
            raise ValueError(f'alpha and alpha_std must be {n} numbers each')
        if not ((factor >= 1.0 / MOST) & (factor <= MOST)).all():
            raise ValueError(f"alpha must be from 1/{MOST:g} to {MOST:g} times the design's")
        levels, plan = self.design.levels, self.plan
        if plan and not (len(plan.steps) == levels and len(plan.kinks) in (0, levels)):
            raise ValueError(f'plan must have steps, and kinks if any, to {levels} levels')


def element_of(data: Any) -> Element:
    """Return the element that `as_dict` described.

    Raises:
        ElementFileError: The data are not an element.
    """
    try:
        if isinstance(data, Mapping) and data.get('format', FORMAT) != FORMAT:
            raise ValueError(f'format must be {FORMAT}; got {short_repr(data["format"])}')
        given: _File = decode(_File, data)
        made = Specimen(
            given.design, given.alpha / given.design.alpha, k_r_factor=given.k_r, mass=given.mass,
            offset=given.offset, stuck=given.stuck,
        )  # fmt: skip
    except ValueError as error:
        raise ElementFileError(f'this is not an element as `mlmem fit` writes: {error}') from error
    return Element(
        made, given.alpha_std, given.time_unit, given.transducers, given.chi2, given.data,
        given.untold, given.plan,
    )  # fmt: skip


def save(path: Path, element: Element) -> None:
    """Write an element to a file, whole or not at all.

    Raises:
        OSError: It cannot be written; a file that was there is as it was.
    """
    import yaml  # type: ignore[import-untyped]

    text = yaml.safe_dump(element.as_dict(), sort_keys=False, default_flow_style=None)
    write_atomically(path, text)


def load(path: Path) -> Element:
    """Read the file of an element.

    Raises:
        ElementFileError: It cannot be read, or is none.
    """
    try:
        return element_of(from_yaml(read(path)))
    except DecodeError as error:
        raise ElementFileError(f'{path}: {error}') from error


def of_design(path: Path, design: Design, settings: Settings | None = None) -> Element:
    """Read the file of an element that must be one of a design.

    Raises:
        ElementFileError: It cannot be read, has other cells and defects, or pulses for others.
    """
    element = load(path)
    found = element.specimen.design.cells
    if found != design.cells:
        raise ElementFileError(
            f'{path} must have the N, J, J_s and tail of the design, {design.cells}; got {found}'
        )
    if settings and element.plan and element.plan.schedule != schedule_of(settings):
        raise ElementFileError(
            f'{path}: its pulses were planned with other settings; `mlmem plan` finds new ones'
        )
    return element
