# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The file of an individual element: `element.yaml`, as a fit writes it and a node uses it."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from .device.errors import SettingsError
from .device.settings import Settings
from .device.trims import AS_SET, Trim, Trims, schedule_of
from .durable import write_atomically
from .physics import Design, DesignError, Specimen
from .physics.potential import Array

FORMAT = 1
"""Version of this format."""


class ElementFileError(ValueError):
    """A file is not that of an element; the message says why."""


@dataclass(frozen=True, eq=False)
class Element:
    """An individual element, as far as it is known.

    Attributes:
        specimen: The element.
        alpha_std: Standard deviation of every alpha, shape (N,).
        time_unit: The instrument's time unit in true ones.
        transducers: Zero, gain and drive of both ends.
        chi2: Misfit per datum of the fit.
        data: Number of data.
        untold: What the data could not tell.
        plan: Trims of its pulses, or None.
    """

    specimen: Specimen
    alpha_std: Array
    time_unit: float = 1.0
    transducers: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    chi2: float = 0.0
    data: int = 0
    untold: tuple[str, ...] = ()
    plan: Trims | None = None

    @property
    def timed(self) -> Specimen:
        """The element in the instrument's time, in which an instrument simulates it.

        A clock that is off by a factor scales masses and damping.
        """
        made, unit = self.specimen, self.time_unit
        return replace(made, mass=made.masses / unit**2, eta_factor=made.eta_factor / unit)

    def pulses(self, settings: Settings) -> list[Trim]:
        """Return the trims of launch and steps by level: as planned, or as in the settings."""
        if self.plan is None or self.plan.schedule != schedule_of(settings):
            return [AS_SET] * self.specimen.design.levels
        return list(self.plan.steps)

    def as_dict(self) -> dict[str, Any]:
        """Return the values for a file."""
        made = self.specimen
        values: dict[str, Any] = {
            'format': FORMAT,
            'design': dataclasses.asdict(made.design),
            'alpha': made.alpha.tolist(),
            'alpha_std': np.asarray(self.alpha_std).tolist(),
        }
        if (made.masses != 1.0).any():
            values['mass'] = made.masses.tolist()
        if (made.k_r != 1.0).any():
            values['k_r'] = made.k_r.tolist()
        if made.offsets.any():
            values['offset'] = made.offsets.tolist()
        return values | {
            'time_unit': self.time_unit,
            'transducers': {name: list(pair) for name, pair in self.transducers.items()},
            'chi2': self.chi2,
            'data': self.data,
            'untold': list(self.untold),
            **({'plan': self.plan.as_dict()} if self.plan else {}),
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any]) -> Element:
        """Return the element that `as_dict` described.

        Raises:
            ElementFileError: The data are not an element.
        """
        try:
            if data['format'] != FORMAT:
                raise ValueError(f'format must be {FORMAT}; got {data["format"]!r}')
            design = Design(**data['design'])
            alpha, deviations = (
                np.array(data[name], dtype=np.float64) for name in ('alpha', 'alpha_std')
            )
            if alpha.shape != (design.N,) or deviations.shape != alpha.shape:
                raise ValueError(f'alpha and alpha_std must be {design.N} numbers each')
            made = Specimen(
                design, alpha / design.alpha, k_r_factor=data.get('k_r', 1.0),
                mass=data.get('mass', 1.0), offset=data.get('offset', 0.0),
            )  # fmt: skip
            time_unit = float(data.get('time_unit', 1.0))
            if not 0.5 <= time_unit <= 2.0:
                raise ValueError(f'time_unit must be from 0.5 to 2; got {time_unit}')
            transducers = {
                str(name): (float(left), float(right))
                for name, (left, right) in data.get('transducers', {}).items()
            }
            return cls(
                made, deviations, time_unit, transducers,
                float(data.get('chi2', 0.0)), int(data.get('data', 0)),
                tuple(map(str, data.get('untold', ()))),
                Trims.from_dict(data['plan']) if 'plan' in data else None,
            )  # fmt: skip
        except (
            LookupError, TypeError, ValueError, AttributeError, DesignError, SettingsError,
        ) as error:  # fmt: skip
            raise ElementFileError(f'this is not an element: {error!r}') from error


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
    import yaml

    try:
        content = yaml.safe_load(path.read_text(encoding='utf-8'))
    except (OSError, UnicodeDecodeError, yaml.YAMLError, ValueError) as error:
        raise ElementFileError(f'{path}: {" ".join(str(error).split())}') from error
    if not isinstance(content, Mapping):
        raise ElementFileError(f'{path}: it must be the file of an element, as `mlmem fit` writes')
    try:
        return Element.from_dict(content)
    except ElementFileError as error:
        raise ElementFileError(f'{path}: {error}') from error


def of_design(path: Path, design: Design, settings: Settings | None = None) -> Element:
    """Read the file of an element that must be one of a design.

    Args:
        path: The file.
        design: The design.
        settings: Those with which its pulses must have been planned, if they have; None: any.

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
