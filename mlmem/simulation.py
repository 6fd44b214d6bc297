# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Research without a device: simulate a chain, look at its trajectory.

A chain starts from rest. Functions of time give the strain of its substrate and the motion of one
of its ends. Lengths are in lattice constants, times in sqrt(m / k_r), energies in k_r (lattice
constant)^2.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from numbers import Real
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from .errors import ErrorCode, SettingsError
from .physics import (
    SUBSTEPS_PER_STEP,
    Chain,
    HeldCell,
    Material,
    Specimen,
    StateError,
    as_specimen,
    default_step,
    find_walls,
    substep_times,
)
from .physics.energy import kinetic_energy
from .physics.equilibrium import (
    compute_energies,
    find_pinned_walls,
    guess_position,
    make_blank,
    wall_profile,
)
from .physics.values import Array
from .progress import track_progress

TimeFunction = Callable[[Any], ArrayLike]
"""A quantity over time, given a time or an array of times."""


InitialState = Callable[[Specimen], Array]
"""A function of a specimen that returns the displacements v_j, shape (N,), to begin with."""


def wall_at(
    level: int | None = None, *, position: float | None = None, relaxed: bool = True
) -> InitialState:
    """Begin a simulation with one wall.

    Args:
        level: Level at whose defect the wall rests; or
        position: its place in sites.
        relaxed: Whether the wall first comes to rest where its energy is least nearby. Otherwise
            it has the profile of a tanh, and moves as soon as time begins.

    Raises:
        SettingsError: Neither or both of level and position are given.
        StateError: In the simulation: there is no such level or site, or no equilibrium was found.
    """
    if (level is None) == (position is None):
        expected = 'given, or else position, and not both'
        raise SettingsError(ErrorCode.CONFLICT, 'level', level, expected)

    def place_wall(specimen: Specimen) -> Array:
        place = float(position or 0.0) if level is None else guess_position(specimen, level)
        if not 1.0 <= place <= specimen.design.N:
            expected = f'from 1 to {specimen.design.N}'
            raise StateError.out_of_range('position', place, expected)
        if relaxed:
            return find_pinned_walls(specimen, [place])
        return wall_profile(specimen, place) + specimen.offsets

    return place_wall


def walls_at(levels: Sequence[int]) -> InitialState:
    """Begin a simulation with walls and kinks, in turn, at rest at several levels.

    Raises:
        SettingsError: A level stands twice: a wall and a kink at one place annihilate.
        StateError: In the simulation: there is no such level, or no equilibrium was found.
    """
    if len(set(levels)) < len(levels):
        raise SettingsError.out_of_range('levels', levels, 'different from each other')

    def place_walls(specimen: Specimen) -> Array:
        return find_pinned_walls(specimen, [guess_position(specimen, level) for level in levels])

    return place_walls


@dataclass(frozen=True, eq=False)
class Trajectory:
    """What a simulation returns: the saved states, T of them.

    Attributes:
        specimen: The simulated element.
        t: Times, shape (T,), in time units sqrt(m / k_r).
        displacement: Displacements v_j of the metamaterial, shape (T, N), in lattice constants.
        velocity: Velocities of the metamaterial, shape (T, N), in lattice constants per time unit.
        substrate: Displacements V_j of the substrate, shape (T, N), in lattice constants.
        substrate_velocity: Velocities of an elastic substrate, shape (T, N), in lattice constants
            per time unit; otherwise zeros.
    """

    specimen: Specimen
    t: Array
    displacement: Array
    velocity: Array
    substrate: Array
    substrate_velocity: Array

    def __repr__(self) -> str:
        return f'Trajectory({len(self.t)} states up to t = {self.t[-1]:g}, {self.specimen})'

    @property
    def configuration(self) -> Array:
        """Configuration Delta_j = v_j - V_j in lattice constants, shape (T, N)."""
        return self.displacement - self.substrate

    @property
    def strain(self) -> Array:
        """Strain of the element, a ratio of lengths, tension positive, shape (T,)."""
        return self.substrate[:, -1] / self.specimen.design.end_displacement(1.0)

    @cached_property
    def wall_positions(self) -> Array:
        """Positions of the walls in sites, shape (T, W); NaN where a state has fewer."""
        found = [
            [wall.position for wall in find_walls(self.specimen.design, row)]
            for row in self.configuration
        ]
        positions = np.full((len(found), max(map(len, found))), np.nan)
        for row, values in zip(positions, found, strict=True):
            row[: len(values)] = values
        return positions

    @cached_property
    def energies(self) -> dict[str, Array]:
        """Kinetic, coupling, on-site and substrate energy in k_r (lattice constant)^2, shape (T,)
        each.
        """
        static = compute_energies(self.specimen, self.displacement, self.substrate)
        moving = kinetic_energy(self.specimen, self.velocity, self.substrate_velocity)
        parts = (moving, *static)
        return dict(zip(('kinetic', 'coupling', 'on_site', 'substrate'), parts, strict=True))

    @property
    def energy(self) -> Array:
        """Total energy in k_r (lattice constant)^2, shape (T,)."""
        return np.asarray(np.sum(list(self.energies.values()), axis=0))

    def plot(self, axes: Any = None) -> Any:
        """Draw the configuration over place and time, with the walls; return the axes.

        Raises:
            ModuleNotFoundError: Matplotlib is not installed.
        """
        import matplotlib.pyplot as plt

        if axes is None:
            _, axes = plt.subplots(layout='constrained')
        design = self.specimen.design
        picture = axes.pcolormesh(
            design.sites,
            self.t,
            self.configuration,
            vmin=design.D_s1,
            vmax=design.D_s2,
            cmap='RdBu_r',
            shading='nearest',
            rasterized=True,
        )
        axes.plot(self.wall_positions, self.t, color='black', linewidth=1.0)
        axes.set_xlabel('site j')
        axes.set_ylabel(r'time $t\,/\,\sqrt{m/k_r}$')
        axes.figure.colorbar(
            picture, ax=axes, label=r'configuration $\Delta_j$ / lattice constant'
        )
        return axes

    def to_xarray(self) -> Any:
        """Return an xarray Dataset with the dimensions t, site and wall.

        Raises:
            ModuleNotFoundError: xarray is not installed.
        """
        import xarray

        by_site = ('configuration', 'displacement', 'velocity', 'substrate')
        fields: dict[str, Any] = {name: (('t', 'site'), getattr(self, name)) for name in by_site}
        fields |= {f'energy_{name}': ('t', values) for name, values in self.energies.items()}
        fields |= {
            'strain': ('t', self.strain),
            'wall_position': (('t', 'wall'), self.wall_positions),
        }
        sites = np.arange(1, self.specimen.design.N + 1)
        dataset = xarray.Dataset(fields, coords={'t': self.t, 'site': sites})
        dataset.attrs['design'] = json.dumps(self.specimen.design.as_dict())
        return dataset

    def save(self, path: Path | str) -> Path:
        """Write all arrays, and the design as JSON, to a file that `numpy.load` reads.

        Raises:
            OSError: It cannot be written.
        """
        path = Path(path)
        names = (
            't', 'strain', 'configuration', 'displacement', 'velocity', 'substrate',
            'wall_positions', 'energy',
        )  # fmt: skip
        arrays = {name: getattr(self, name) for name in names}
        design = json.dumps(self.specimen.design.as_dict())
        with path.open('wb') as file:
            np.savez_compressed(file, design=design, **arrays)
        return path


def simulate(
    material: Material,
    *,
    duration: float,
    initial: InitialState | ArrayLike | None = None,
    save_every: float | None = None,
    strain: TimeFunction | float = 0.0,
    drive: Mapping[int, TimeFunction | float] | None = None,
    eta: float | None = None,
    dt: float | None = None,
    progress: bool = True,
) -> Trajectory:
    """Simulate a chain that starts from rest.

    Args:
        material: A design, simulated exactly as designed; a specimen with scatter of its own; or
            what has one, such as a loaded element.
        duration: Simulated time in time units; rounded up to a multiple of `save_every`.
        initial: Displacements v_j, shape (N,), or a function of the specimen that returns them,
            such as `wall_at` and `walls_at` make; by default `make_blank`. Where the strain does
            not begin at 0, it is the configuration that is given.
        save_every: Time between two saved states; by default a 200th of the duration.
        strain: Strain of the substrate over time, tension positive; or a constant one.
        drive: Displacement v_j over time of an end, site 1 or N; NaN while the end is free. Or a
            number, at which the end is held. One end can be driven, because a chain's loop holds
            one cell.
        eta: Damping in place of the design's.
        dt: Largest step in time units; by default the largest that is accurate and stable.
        progress: Whether to show a progress bar if it takes longer than two seconds.

    Raises:
        SettingsError: An argument is out of range.
        DesignError: The step is beyond the limit of stability.
        StateError: The initial state is none, or a cell is driven too far to be followed.
    """
    specimen = as_specimen(material)
    if eta is not None:
        specimen = replace(specimen, design=replace(specimen.design, eta=eta), eta_factor=1.0)
    _require_time('duration', duration)
    save_every = duration / 200.0 if save_every is None else save_every
    _require_time('save_every', save_every, duration)
    longest = default_step(specimen) if dt is None else dt
    _require_time('dt', longest)
    steps = math.ceil(save_every / longest * (1.0 - 1e-12))
    chain = Chain(specimen, save_every / steps)
    inputs = _InputFunctions(strain, *_select_driven_end(drive, specimen.design.N))
    first_strain = float(inputs.sample_strain(np.zeros(1))[0])
    _set_initial_state(chain, make_blank if initial is None else initial, first_strain)
    count = math.ceil(duration / save_every * (1.0 - 1e-12))
    frames = [_copy_rows(chain)]
    runs: Iterator[int] = iter(range(count))
    if progress:
        runs = track_progress(runs, count, 'simulating')
    for _ in runs:
        _advance_chain(chain, steps, inputs)
        frames.append(_copy_rows(chain))
    rows = np.array(frames, dtype=np.float64)
    times = np.asarray(save_every * np.arange(count + 1), dtype=np.float64)
    return Trajectory(specimen, times, *(np.array(rows[:, k]) for k in range(4)))


def _require_time(name: str, value: object, longest: float = math.inf) -> None:
    """Raise `SettingsError` unless this is a number above 0, finite, and at most the longest."""
    if not (isinstance(value, Real) and 0.0 < float(value) <= longest and math.isfinite(value)):
        limit = 'finite' if longest == math.inf else f'at most {longest:g}'
        raise SettingsError.out_of_range(name, value, f'above 0 and {limit}')


@dataclass(frozen=True)
class _InputFunctions:
    """Strain and motion of an end, over time.

    Attributes:
        site: The driven end.
        motion: Its displacement; None if no end is driven.
    """

    strain: TimeFunction | float
    site: int = 1
    motion: TimeFunction | float | None = None

    def sample_strain(self, times: Array) -> Array:
        """Return the strain at some times, shape (m,).

        Raises:
            ValueError: It is not finite.
        """
        values = _sample_function('strain', self.strain, times)
        if not np.isfinite(values).all():
            raise SettingsError.out_of_range(
                'strain', float(values[~np.isfinite(values)][0]), 'finite'
            )
        return values

    def sample_motion(self, times: Array, dt: float) -> Array:
        """Return displacement and velocity of the driven end, shape (2, m); NaN if free.

        Raises:
            ValueError: It is infinite.
        """
        if self.motion is None:
            return np.full((2, len(times)), np.nan)
        h = 1e-3 * dt  # step of the differences that give the velocity of a driven cell
        before, at, after = (
            _sample_function('drive', self.motion, times + shift) for shift in (-h, 0.0, h)
        )
        if np.isinf(at).any():
            raise SettingsError.out_of_range('drive', math.inf, 'finite, or NaN for a free end')
        velocity = (after - before) / (2.0 * h)
        for one_sided in ((after - at) / h, (at - before) / h):  # where the end is let go or taken
            velocity = np.where(np.isnan(velocity), one_sided, velocity)
        return np.array([at, velocity])


def _sample_function(name: str, function: TimeFunction | float, times: Array) -> Array:
    """Return a function's values; one that takes no arrays is called time by time.

    Raises:
        SettingsError: It is none, or its values are not one for each time.
    """
    if not (callable(function) or isinstance(function, Real)):
        raise SettingsError.out_of_range(name, function, 'a number or a function of time')
    if not callable(function):
        return np.full(len(times), float(function))
    try:
        values = np.asarray(function(times), dtype=np.float64)
    except (TypeError, ValueError):
        values = np.array([function(float(time)) for time in times], dtype=np.float64)
    if values.shape not in ((), (1,), times.shape):
        raise SettingsError.out_of_range(name, values.shape, 'a function with one value per time')
    return np.array(np.broadcast_to(values, times.shape))


def _select_driven_end(
    drive: Mapping[int, TimeFunction | float] | None, N: int
) -> tuple[int, TimeFunction | float | None]:
    """Return the end that is driven, and how.

    Raises:
        ValueError: Another cell is driven, or both ends are.
    """
    if not drive:
        return 1, None
    if not isinstance(drive, Mapping) or list(drive) not in ([1], [N]):
        expected = f'of site 1 or site {N}, and of one of them'
        raise SettingsError.out_of_range('drive', drive, expected)
    ((site, motion),) = drive.items()
    return site, motion


def _set_initial_state(chain: Chain, initial: InitialState | ArrayLike, strain: float) -> None:
    """Set the state from which a simulation begins."""
    specimen = chain.specimen
    v = np.asarray(initial(specimen) if callable(initial) else initial, dtype=np.float64)
    V_N = specimen.design.end_displacement(strain)
    chain.place(v + V_N * specimen.strain_shape if V_N else v, V_N)


def _copy_rows(chain: Chain) -> Array:
    """Return displacement and velocity of both chains, shape (4, N)."""
    return np.array([chain.v, chain.velocity, chain.V, chain.substrate_velocity])


def _advance_chain(chain: Chain, steps: int, inputs: _InputFunctions) -> None:
    """Advance by whole steps, in runs that begin where the driven end is taken."""
    times = substep_times(steps, chain.dt, first=chain.steps_done)
    V_N = chain.design.end_displacement(1.0) * inputs.sample_strain(times)
    motion = inputs.sample_motion(times, chain.dt)
    held = np.isfinite(motion[0])
    by_step = held.reshape(steps, SUBSTEPS_PER_STEP)
    taken = 1 + np.flatnonzero(by_step[1:, 0] & ~by_step[:-1].all(axis=1))
    for first, last in itertools.pairwise([0, *taken.tolist(), steps]):
        run = slice(first * SUBSTEPS_PER_STEP, last * SUBSTEPS_PER_STEP)
        free = np.flatnonzero(~held[run])
        driven = run.start + (int(free[0]) if len(free) else len(held[run]))
        chain.advance(V_N[run], HeldCell(inputs.site, motion[:, run.start : driven]))
