# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The loops: Eqs. (1a) and (1b) advanced by the PEFRL integrator; see `pefrl`.

One pass over the cells makes one kick and the drift after it. The last drift of a step and the
first one of the next are made in one pass, yet one after the other: a run that is cut into pieces
gives the same bits. Arrays of displacements carry ghost cells as in `noh_bathe_kernel`, and the
loops are inlined as text for the same reason.

What is prescribed comes in the order of time, in which the stages are not: the second goes back.
"""

from __future__ import annotations

from . import on_site as formula
from .jit import built_on, inlined, kernel
from .noh_bathe_kernel import Cells
from .on_site import on_site
from .potential import Array


@inlined
def rigid_stage(
    n: int, x: Array, new: Array, v: Array, height: Array, offset: Array, shape: Array,
    decay: Array, kick: Array, push: Array, V_N: float, shake: float,
    a: float, b: float, c: float, drift: float,
) -> None:
    """Kick at the displacements x, then drift to the new ones, over a rigid substrate."""
    for j in range(n):
        at = x[j + 1]
        force = on_site(height[j], at - (V_N * shape[j] + offset[j]), a, b, c)
        pull = (x[j] - 2.0 * at) + x[j + 2] - force
        velocity = decay[j] * v[j] + kick[j] * pull - push[j] * shake
        v[j] = velocity
        new[j + 1] = at + drift * velocity


@inlined
def rigid_last(
    n: int, x: Array, new: Array, end: Array, v: Array, height: Array, offset: Array,
    shape: Array, decay: Array, kick: Array, push: Array, V_N: float, shake: float,
    a: float, b: float, c: float, drift: float,
) -> None:
    """The last stage of a step: drift to its end, and by as much into the next one."""
    for j in range(n):
        at = x[j + 1]
        force = on_site(height[j], at - (V_N * shape[j] + offset[j]), a, b, c)
        pull = (x[j] - 2.0 * at) + x[j + 2] - force
        velocity = decay[j] * v[j] + kick[j] * pull - push[j] * shake
        v[j] = velocity
        at += drift * velocity
        end[j + 1] = at
        new[j + 1] = at + drift * velocity


@inlined
def clamp(stuck: Cells, x: Array, new: Array, v: Array) -> None:
    """Leave stuck cells where they are."""
    for k in range(len(stuck)):
        j = stuck[k]
        new[j + 1] = x[j + 1]
        v[j] = 0.0


@inlined
def fold(n: int, x: Array) -> None:
    """Let the ghost cells repeat the ends."""
    x[0] = x[1]
    x[n + 1] = x[n]


@built_on(formula)
@kernel
def advance_rigid(
    steps: int, n: int, u: Array, v: Array, A: Array, x: Array, y: Array,
    height: Array, offset: Array, stuck: Cells, shape: Array, V_N: Array, shake: Array,
    a: float, b: float, c: float, site: int, driven: int, drive: Array, ends: Array,
    drifts: Array, decay: Array, kick: Array, push: Array,
    inner_decay: Array, inner_kick: Array, inner_push: Array,
) -> None:
    """Advance Eq. (1a) over the quasi-static substrate V_j = V_N shape_j.

    Args:
        steps: Number of steps.
        n: Number of cells.
        u, v: Displacements (n + 2,) and velocities (n,): the state.
        A: Accelerations (n,), which this method has no use for.
        x, y: Work space of the shape of u.
        height: alpha_j d, shape (n,).
        offset: Shift of a cell's ground states, shape (n,).
        stuck: Indices of the cells that do not move relative to the base, whole numbers.
        shape: Substrate displacement per unit V_N, shape (n,).
        V_N: Substrate end displacement at every node of every step, shape (5 steps,).
        shake: Acceleration of the base, in whose frame the chain is, likewise.
        a, b, c: Potential.
        site: Driven cell, index in u.
        driven: Number of leading nodes at which the cell is driven; what of them is left over by
            whole steps counts for nothing.
        drive: Its displacement and velocity at every node, (2, >= driven).
        ends: Out: displacement of the first and the last cell after every step, (2, steps).
        drifts: Lengths in time of the first three drifts of a step.
        decay, kick, push: What the first and the last kick of a step make of velocity, force and
            acceleration of the base, each of shape (n,).
        inner_decay, inner_kick, inner_push: The same of the two kicks between them.
    """
    d0, d1, d2 = drifts[0], drifts[1], drifts[2]
    for j in range(n):
        x[j + 1] = u[j + 1] + d0 * v[j]
    for k in range(steps):
        i = 5 * k
        held = i + 5 <= driven
        if held:
            x[site] = drive[0, i + 1]
        fold(n, x)
        rigid_stage(
            n, x, y, v, height, offset, shape, decay, kick, push, V_N[i + 1], shake[i + 1],
            a, b, c, d1,
        )
        clamp(stuck, x, y, v)
        if held:
            y[site] = drive[0, i]
        fold(n, y)
        rigid_stage(
            n, y, x, v, height, offset, shape, inner_decay, inner_kick, inner_push,
            V_N[i], shake[i], a, b, c, d2,
        )
        clamp(stuck, y, x, v)
        if held:
            x[site] = drive[0, i + 3]
        fold(n, x)
        rigid_stage(
            n, x, y, v, height, offset, shape, inner_decay, inner_kick, inner_push,
            V_N[i + 3], shake[i + 3], a, b, c, d1,
        )
        clamp(stuck, x, y, v)
        if held:
            y[site] = drive[0, i + 2]
        fold(n, y)
        rigid_last(
            n, y, x, u, v, height, offset, shape, decay, kick, push, V_N[i + 2], shake[i + 2],
            a, b, c, d0,
        )
        clamp(stuck, y, u, v)
        clamp(stuck, y, x, v)
        if held:
            u[site] = drive[0, i + 4]
            v[site - 1] = drive[1, i + 4]
            x[site] = u[site] + d0 * v[site - 1]
        ends[0, k] = u[1]
        ends[1, k] = u[n]


@inlined
def elastic_stage(
    n: int, x: Array, new: Array, v: Array, X: Array, NEW: Array, V: Array,
    height: Array, offset: Array, s: Array, decay: Array, kick: Array, push: Array,
    substrate_decay: float, substrate_kick: float, shake: float,
    a: float, b: float, c: float, drift: float,
) -> None:
    """Kick both chains at the displacements x, X, then drift to the new ones."""
    for j in range(n):
        at = x[j + 1]
        AT = X[j + 1]
        force = on_site(height[j], at - (AT + offset[j]), a, b, c)
        pull = (x[j] - 2.0 * at) + x[j + 2] - force
        velocity = decay[j] * v[j] + kick[j] * pull - push[j] * shake
        v[j] = velocity
        new[j + 1] = at + drift * velocity
        spring = s[j + 1] * (X[j + 2] - AT) - s[j] * (AT - X[j])
        velocity = substrate_decay * V[j] + substrate_kick * (spring + force - shake)
        V[j] = velocity
        NEW[j + 1] = AT + drift * velocity


@inlined
def elastic_last(
    n: int, x: Array, new: Array, end: Array, v: Array, X: Array, NEW: Array, END: Array,
    V: Array, height: Array, offset: Array, s: Array, decay: Array, kick: Array, push: Array,
    substrate_decay: float, substrate_kick: float, shake: float,
    a: float, b: float, c: float, drift: float,
) -> None:
    """The last stage of a step: drift to its end, and by as much into the next one."""
    for j in range(n):
        at = x[j + 1]
        AT = X[j + 1]
        force = on_site(height[j], at - (AT + offset[j]), a, b, c)
        pull = (x[j] - 2.0 * at) + x[j + 2] - force
        velocity = decay[j] * v[j] + kick[j] * pull - push[j] * shake
        v[j] = velocity
        at += drift * velocity
        end[j + 1] = at
        new[j + 1] = at + drift * velocity
        spring = s[j + 1] * (X[j + 2] - AT) - s[j] * (AT - X[j])
        velocity = substrate_decay * V[j] + substrate_kick * (spring + force - shake)
        V[j] = velocity
        AT += drift * velocity
        END[j + 1] = AT
        NEW[j + 1] = AT + drift * velocity


@inlined
def enforce(n: int, X: Array, V_N: float) -> None:
    """Set the ends of the substrate, which belong to the frame and the actuator."""
    X[1] = 0.0
    X[n] = V_N


@built_on(formula)
@kernel
def advance_elastic(
    steps: int, n: int, u: Array, v: Array, A: Array, x: Array, y: Array,
    U: Array, V: Array, B: Array, X: Array, Y: Array,
    height: Array, offset: Array, stuck: Cells, s: Array, V_N: Array, shake: Array,
    a: float, b: float, c: float, site: int, driven: int, drive: Array, ends: Array,
    drifts: Array, decay: Array, kick: Array, push: Array,
    inner_decay: Array, inner_kick: Array, inner_push: Array, substrate: Array,
) -> None:
    """Advance Eqs. (1a) and (1b) with V_1 = 0 and V_N prescribed.

    The two ends of the substrate are moved, not integrated, and their velocities read zero.

    Args:
        steps, n, u, v, A, x, y, height, offset, stuck, V_N, shake, a, b, c: As `advance_rigid`.
        U, V, B, X, Y: Of the substrate.
        s: Substrate stiffness left of every cell and right of the last, shape (n + 1,).
        site, driven, drive, ends, drifts, decay, kick, push, inner_decay, inner_kick, inner_push:
            As `advance_rigid`.
        substrate: Decay and kick of a substrate cell at the outer kicks, then at the inner ones.
    """
    d0, d1, d2 = drifts[0], drifts[1], drifts[2]
    outer, outer_kick = substrate[0], substrate[1]
    inner, substrate_inner = substrate[2], substrate[3]
    for j in range(n):
        x[j + 1] = u[j + 1] + d0 * v[j]
        X[j + 1] = U[j + 1] + d0 * V[j]
    for k in range(steps):
        i = 5 * k
        held = i + 5 <= driven
        if held:
            x[site] = drive[0, i + 1]
        fold(n, x)
        enforce(n, X, V_N[i + 1])
        elastic_stage(
            n, x, y, v, X, Y, V, height, offset, s, decay, kick, push, outer, outer_kick,
            shake[i + 1], a, b, c, d1,
        )
        clamp(stuck, x, y, v)
        if held:
            y[site] = drive[0, i]
        fold(n, y)
        enforce(n, Y, V_N[i])
        elastic_stage(
            n, y, x, v, Y, X, V, height, offset, s, inner_decay, inner_kick, inner_push,
            inner, substrate_inner, shake[i], a, b, c, d2,
        )
        clamp(stuck, y, x, v)
        if held:
            x[site] = drive[0, i + 3]
        fold(n, x)
        enforce(n, X, V_N[i + 3])
        elastic_stage(
            n, x, y, v, X, Y, V, height, offset, s, inner_decay, inner_kick, inner_push,
            inner, substrate_inner, shake[i + 3], a, b, c, d1,
        )
        clamp(stuck, x, y, v)
        if held:
            y[site] = drive[0, i + 2]
        fold(n, y)
        enforce(n, Y, V_N[i + 2])
        elastic_last(
            n, y, x, u, v, Y, X, U, V, height, offset, s, decay, kick, push, outer, outer_kick,
            shake[i + 2], a, b, c, d0,
        )
        clamp(stuck, y, u, v)
        clamp(stuck, y, x, v)
        enforce(n, U, V_N[i + 4])
        V[0] = V[n - 1] = 0.0
        if held:
            u[site] = drive[0, i + 4]
            v[site - 1] = drive[1, i + 4]
            x[site] = u[site] + d0 * v[site - 1]
        ends[0, k] = u[1]
        ends[1, k] = u[n]
