# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device's values as messages, in SI units where the message type requires them."""

from __future__ import annotations

import array
from collections.abc import Mapping
from typing import Any

import numpy as np
from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from sensor_msgs.msg import JointState, Range
from std_msgs.msg import (
    Float32MultiArray,
    Float64MultiArray,
    Int16,
    Int64,
    MultiArrayDimension,
    MultiArrayLayout,
)

from mlmem import UNDECODABLE, MemoryElement, Outcome, Reading, Shot
from mlmem.physics.potential import Array
from mlmem.procedure_table import JOINT_NAME
from mlmem.readers.echo import Echo

from . import values


def build_level(reading: Reading | None) -> Int16:
    """Return the content; see `values.encode_level`."""
    return Int16(data=values.encode_level(reading))


def word(reading: Reading | None) -> Int64:
    """Return the content of a register; see `values.encode_level`."""
    return Int64(data=values.encode_level(reading))


def build_content(element: MemoryElement, name: str) -> DiagnosticStatus:
    """Return the content in words; a warning if it is not known. `name` is the node's full
    name.
    """
    text, found = values.describe_content(element)
    known = element.reading is not None and element.reading.level != UNDECODABLE
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if known else DiagnosticStatus.WARN,
        name=name.rpartition('/')[2],
        message=text,
        hardware_id=name,
        values=[KeyValue(key=key, value=value) for key, value in found.items()],
    )


def build_outcome(outcome: Outcome, name: str) -> DiagnosticStatus:
    """Return the outcome of a procedure; `name` is the node's full name."""
    level = DiagnosticStatus.OK if outcome.success else DiagnosticStatus.ERROR
    text, found = values.describe_outcome(outcome)
    return DiagnosticStatus(
        level=level,
        name=name.rpartition('/')[2],
        message=text,
        hardware_id=name,
        values=[KeyValue(key=key, value=value) for key, value in found.items()],
    )


def build_test_statuses(outcome: Outcome, name: str) -> list[DiagnosticStatus]:
    """Return one status for every check of a self-test, or a single one without checks."""
    return [
        _build_test_status(name, check.name, check.passed, check.message, check.values)
        for check in outcome.checks
    ] or [build_refused_test(name, outcome.error)]


def build_refused_test(name: str, reason: str) -> DiagnosticStatus:
    """Return the status of a self-test that did not run."""
    return _build_test_status(name, 'self_test', False, reason, {})


def _build_test_status(
    name: str, check: str, passed: bool, message: str, values: Mapping[str, Any]
) -> DiagnosticStatus:
    return DiagnosticStatus(
        level=DiagnosticStatus.OK if passed else DiagnosticStatus.ERROR,
        name=f'{name[1:]}: {check}',
        message=message,
        hardware_id=name,
        values=build_key_values(values),
    )


def build_key_values(found: Mapping[str, Any]) -> list[KeyValue]:
    """Return values as diagnostics carry them; see `values.format_values`."""
    return [KeyValue(key=key, value=text) for key, text in values.format_values(found).items()]


def build_echo(heard: Echo) -> Float32MultiArray:
    """Return an echo: channels t, v_m and v_c (time units and cells) by sample."""
    rows = np.stack((heard.t, heard.v_m, heard.v_c))
    return Float32MultiArray(
        layout=_build_layout(channel=len(rows), sample=rows.shape[1]), data=_to_float_array(rows)
    )


def build_field(element: MemoryElement) -> Float32MultiArray:
    """Return the configuration Delta_j by cell."""
    configuration = element.chain.configuration
    return Float32MultiArray(
        layout=_build_layout(cell=len(configuration)), data=_to_float_array(configuration)
    )


def build_wall_positions(element: MemoryElement) -> Float64MultiArray:
    """Return the true positions of all walls in sites, from left to right."""
    found = values.find_wall_positions(element)
    return Float64MultiArray(layout=_build_layout(wall=len(found)), data=array.array('d', found))


def build_waveform(shot: Shot) -> Float64MultiArray:
    """Return a shot of a survey: numbers that describe it, then rows v_1 and v_N by sample."""
    layout = _build_layout(end=2, sample=shot.samples.shape[1])
    layout.data_offset = values.SHOT_HEAD_SIZE
    return Float64MultiArray(
        layout=layout, data=array.array('d', values.encode_shot(shot).tobytes())
    )


def build_range(reading: Reading, element: MemoryElement, stamp: Time, frame_id: str) -> Range:
    """Return the distance from the probed end to the wall in metres, +inf when there is none."""
    length = element.settings.scale.length
    message = Range(
        radiation_type=Range.ULTRASOUND,
        min_range=0.0,
        max_range=float(element.design.N * length),
        range=values.compute_distance(reading, element),
    )
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    return message


def build_joint_states(element: MemoryElement, stamp: Time, frame_id: str) -> JointState:
    """Return the substrate's end and the transducer cell v_1: m, m/s and N.

    There are no forces if the driver measures none.
    """
    position, velocity, effort = (
        array.array('d', each) for each in values.measure_joints(element)
    )
    message = JointState(
        name=[JOINT_NAME, 'transducer'], position=position, velocity=velocity, effort=effort
    )
    message.header.stamp = stamp
    message.header.frame_id = frame_id
    return message


def _build_layout(**sizes: int) -> MultiArrayLayout:
    """Return the layout of an array with these dimensions, the last one contiguous."""
    dimensions: list[MultiArrayDimension] = []
    stride = 1
    for label, size in reversed(sizes.items()):
        stride *= size
        dimensions.insert(0, MultiArrayDimension(label=label, size=size, stride=stride))
    return MultiArrayLayout(dim=dimensions)


def _to_float_array(values: Array) -> array.array[float]:
    """Return the values in the only type that rclpy does not check element by element."""
    result = array.array('f')
    result.frombytes(values.astype(np.float32).tobytes())
    return result
