# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The body: six legs in MuJoCo, which walk as tripods."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

TIME_STEP_S = 0.002
"""Seconds of a step of the physics, and between two messages of the IMU."""

HIP_PLACES_M = {
    f'{row}{side}': (x, y)
    for row, x in (('front', 0.2), ('middle', 0.0), ('hind', -0.2))
    for side, y in (('_left', 0.07), ('_right', -0.07))
}
"""Where the hips are, in metres: forward and to the left."""

TRIPOD_LEGS = {'front_left', 'hind_left', 'middle_right'}
"""The legs that swing together; the others stand meanwhile."""

LEG_XML = """
<body name="{leg}" pos="{x} {y} 0">
  <joint name="{leg}_hip" axis="0 0 1" damping="0.02"/>
  <geom type="capsule" fromto="0 0 0 0 {out} 0" size="0.015" mass="0.1"/>
  <body pos="0 {out} 0">
    <joint name="{leg}_knee" axis="{side} 0 0" damping="0.02"/>
    <geom type="capsule" fromto="0 0 0 0 {foot} -0.11" size="0.013" mass="0.1"/>
    <geom type="sphere" pos="0 {foot} -0.11" size="0.02" mass="0.02" friction="0.9"/>
  </body>
</body>"""

BODY_XML = """
<mujoco>
  <option timestep="{step}"/>
  <visual><headlight ambient="0.5 0.5 0.5" diffuse="0.2 0.2 0.2"/></visual>
  <asset>
    <texture name="sky" type="skybox" builtin="flat" rgb1="0.9 0.94 1" width="8" height="8"/>
    <texture name="field" type="2d" builtin="checker" rgb1="0.82 0.8 0.76" rgb2="0.74 0.72 0.68"
      width="64" height="64"/>
    <material name="field" texture="field" texrepeat="100 10"/>
  </asset>
  <worldbody>
    <light pos="0 0 3" dir="0.2 0.3 -1" directional="true" diffuse="0.4 0.4 0.4"/>
    <geom type="plane" size="50 5 0.1" material="field"/>{stones}
    <body name="torso" pos="0 0 0.14">
      <freejoint/>
      <geom type="box" size="0.25 0.07 0.03" mass="1.5" rgba="0.16 0.35 0.6 1"/>
      <site name="imu"/>{legs}
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
  <sensor><accelerometer site="imu"/></sensor>
</mujoco>"""

SERVO_XML = '<position joint="{name}" kp="30" kv="0.5" forcerange="-2.5 2.5"/>'
STONE_XML = (
    '<geom type="box" size="0.06 0.06 {h:.4f}" pos="{x:.2f} {y:.2f} 0" rgba="0.6 0.58 0.55 1"/>'
)
"""A stone whose upper side is at height `h`, in metres."""


@dataclass(frozen=True)
class Gait:
    """A way to walk: steps a second, and the swing of the hips in rad."""

    name: str
    frequency: float
    stride: float


GAITS = (
    Gait('stand', 0.0, 0.0),
    Gait('stroll', 1.0, 0.35),
    Gait('walk', 2.0, 0.35),
    Gait('hurry', 3.0, 0.35),
)

KNEE_LIFT_RAD = 0.5
"""How far a knee lifts its foot in the swing, in rad."""


class Hexapod:
    """Six legs on a plane with stones.

    Attributes:
        time: In seconds.
        powered: Whether its servos have power; it collapses without.
    """

    def __init__(self, roughness: float = 0.0, seed: int = 1) -> None:
        """Stand at the beginning of a course; its stones are up to `roughness` metres high."""
        self._model = mujoco.MjModel.from_xml_string(_build_course(roughness, seed))
        self._data = mujoco.MjData(self._model)
        self._phase = 0.0
        self._strong = self._model.actuator_forcerange.copy()
        self.powered = True

    @property
    def time(self) -> float:
        """Return the time in seconds."""
        return float(self._data.time)

    @property
    def acceleration(self) -> tuple[float, float, float]:
        """What the IMU feels in m/s^2, gravity included: forward, left, up."""
        x, y, z = self._data.sensordata
        return float(x), float(y), float(z)

    @property
    def place(self) -> tuple[float, float]:
        """How far it has come, and the height of its torso, in metres."""
        return float(self._data.qpos[0]), float(self._data.qpos[2])

    @property
    def joints(self) -> dict[str, float]:
        """The angles of its joints in rad."""
        names = [self._model.joint(n).name for n in range(1, self._model.njnt)]
        return dict(zip(names, map(float, self._data.qpos[7:]), strict=True))

    def draw_picture(self, renderer: mujoco.Renderer) -> Any:
        """Return a picture of it from its right side, shape (height, width, 3)."""
        camera = mujoco.MjvCamera()
        camera.lookat[:] = self._data.qpos[0], 0.0, 0.06
        camera.distance, camera.azimuth, camera.elevation = 1.15, 60.0, -20.0
        renderer.update_scene(self._data, camera)
        return renderer.render()

    def make_renderer(self, width: int, height: int) -> mujoco.Renderer:
        """Return what draws it without a screen; a context manager.

        Without a graphics card set MUJOCO_GL to egl or osmesa.
        """
        return mujoco.Renderer(self._model, height, width)

    def step(self, gait: Gait) -> None:
        """Walk for one step of the physics."""
        self._phase += 2 * math.pi * gait.frequency * TIME_STEP_S
        angles = []
        for leg, (_, y) in HIP_PLACES_M.items():
            phase = self._phase + (0.0 if leg in TRIPOD_LEGS else math.pi)
            forward = -math.copysign(gait.stride, y) * math.sin(phase)
            angles += [
                forward,
                KNEE_LIFT_RAD * max(0.0, math.cos(phase)) if gait.frequency else 0.0,
            ]
        self._data.ctrl[:] = angles
        self._model.actuator_forcerange[:] = self._strong * self.powered
        mujoco.mj_step(self._model, self._data)


def _build_course(roughness: float, seed: int) -> str:
    rng = np.random.default_rng(seed)
    places = [(x, y) for x in np.arange(0.3, 8.0, 0.15) for y in np.arange(-0.3, 0.4, 0.15)]
    heights = 1e-4 + rng.uniform(0.0, roughness, len(places))
    stones = ''.join(
        STONE_XML.format(x=x, y=y, h=h) for (x, y), h in zip(places, heights, strict=True)
    )
    legs = ''.join(
        LEG_XML.format(
            leg=leg, x=x, y=y, side=math.copysign(1, y), out=math.copysign(0.1, y),
            foot=math.copysign(0.12, y),
        )
        for leg, (x, y) in HIP_PLACES_M.items()
    )  # fmt: skip
    joints = [f'{leg}_{joint}' for leg in HIP_PLACES_M for joint in ('hip', 'knee')]
    return BODY_XML.format(
        step=TIME_STEP_S, legs=legs, stones=stones if roughness else '',
        servos=''.join(SERVO_XML.format(name=name) for name in joints),
    )  # fmt: skip
