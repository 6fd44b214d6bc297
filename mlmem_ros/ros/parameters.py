# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Parameters, declared from the descriptions of the settings they fill."""

from __future__ import annotations

import dataclasses
import sys
from dataclasses import dataclass
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from ..described import Description, descriptions
from ..device.settings import Settings
from ..physics import PRESETS, Design, preset
from .settings import PublishSettings, RecordSettings

Group = TypeVar('Group')


class ParameterError(ValueError):
    """A parameter has the wrong type or value; the message names it."""


@dataclass(frozen=True)
class Parameters:
    """All the node was given."""

    design: Design
    settings: Settings
    publish: PublishSettings
    record: RecordSettings


def declare(node: Node) -> Parameters:
    """Declare every parameter of the contract and return their values.

    Raises:
        ParameterError: One has the wrong type or is out of range.
        DesignError: The design's parameters make no memory.
        SettingsError: Settings contradict each other.
    """
    name = _declare(
        node,
        'design.preset',
        'case_2',
        Description('shipped design that the others start from', choices=tuple(PRESETS)),
    )
    design = _declare_group(node, 'design', preset(name))
    groups = {
        field.name: _declare_group(node, field.name, getattr(Settings(), field.name))
        for field in dataclasses.fields(Settings)
    }
    publish = _declare_group(node, 'publish', PublishSettings())
    record = _declare_group(node, 'record', RecordSettings())
    target = Description('level that ~/write writes', low=0, high=max(0, design.levels - 1))
    _declare(node, 'target_level', 0, target, read_only=False)
    return Parameters(design, Settings(**groups), publish, record)


def _declare_group(node: Node, prefix: str, defaults: Group) -> Group:
    """Declare the fields of a settings dataclass and return one with their values."""
    values = {
        field.name: _declare(
            node, f'{prefix}.{field.name}', getattr(defaults, field.name), description
        )
        for field, description in descriptions(defaults)
    }
    return type(defaults)(**values)


def _declare(
    node: Node, name: str, default: Any, description: Description, *, read_only: bool = True
) -> Any:
    try:
        return node.declare_parameter(
            name, default, descriptor(description, default, read_only)
        ).value
    except InvalidParameterTypeException as error:
        hint = ' (a number with a decimal point)' if isinstance(default, float) else ''
        raise ParameterError(
            f'parameter {name} must be {_article(default)}{hint}; got {_given(node, name)}'
        ) from error
    except InvalidParameterValueException as error:
        raise ParameterError(
            f'parameter {name} must be from {description.low} to {description.high}; '
            f'got {_given(node, name)}'
        ) from error


def descriptor(description: Description, default: Any, read_only: bool) -> ParameterDescriptor:
    """Return the ROS descriptor of a described field.

    Args:
        description: Meaning, unit and range.
        default: The default value: its type is the parameter's.
        read_only: Whether it is fixed once the node runs.
    """
    text = description.text + (f' [{description.unit}]' if description.unit else '')
    result = ParameterDescriptor(description=text, read_only=read_only)
    if description.choices:
        result.additional_constraints = f'one of {", ".join(description.choices)}'
    low, high = description.low, description.high
    if low is None and high is None:
        return result
    if isinstance(default, float):
        limit = sys.float_info.max
        result.floating_point_range = [
            FloatingPointRange(
                from_value=float(-limit if low is None else low),
                to_value=float(limit if high is None else high),
            )
        ]
    else:
        result.integer_range = [
            IntegerRange(
                from_value=-(2**63) if low is None else int(low),
                to_value=2**63 - 1 if high is None else int(high),
            )
        ]
    return result


def _article(default: Any) -> str:
    names = {bool: 'a bool', int: 'an integer', float: 'a double', str: 'a string'}
    return names[type(default)]


def _given(node: Node, name: str) -> str:
    override = node._parameter_overrides.get(name)  # rclpy has no public way to ask
    return repr(override.value) if override is not None else 'something else'
