# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's ROS parameter file, read without ROS: the design and settings in it.

Names, types and ranges are checked as by the node; what concerns only the node is ignored.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml  # type: ignore[import-untyped]

from mlmem import PRESETS, Preset, Settings, SettingsError, law_file, preset
from mlmem.law_file import LawFileError
from mlmem.parsing import DecodeError, parse_yaml, read_file
from mlmem.physics import Design, DesignError
from mlmem.physics.curve import Curve
from mlmem.presets import DEFAULT_ELEMENT
from mlmem.schema import find_descriptions, make_printable, short_repr
from mlmem.settings import ScaleSettings

from .host.settings import declare_parameters

RCLPY_PARAMETERS = 'use_sim_time', 'start_type_description_service'
"""Parameters of every node; beside `qos_overrides.*`."""


class ParameterFileError(DecodeError):
    """A file is not a node's parameter file; the message says what is wrong, and where."""


def load_preset(source: str) -> Preset:
    """Return the design and settings of a parameter file, given its path, or of a preset, given
    its name.

    Raises:
        ParameterFileError: There is no such file, or it is not a parameter file of a node.
        DesignError: The design is not a memory.
        SettingsError: Settings are out of range or contradict each other.
    """
    return preset(source) if source in PRESETS else parse_preset(_read_source(source), source)


def read_preset_name(source: str) -> str:
    """Return the name of the preset over which a parameter file puts its values.

    Raises:
        ParameterFileError: As `load_preset`.
    """
    name: str = _read_parameters(_read_source(source), source).get(
        'design.preset', DEFAULT_ELEMENT
    )
    return name


def _read_source(source: str) -> str:
    try:
        return read_file(source)
    except DecodeError as error:
        raise ParameterFileError(
            f'{short_repr(source, 60)}: {error}; give a parameter file, or one of '
            f'{", ".join(PRESETS)}'
        ) from error


def build_node_parameters(element: str) -> str | dict[str, str]:
    """Return what a launch file passes to a node for the path of a file, or the name of a preset:
    parameters, or a file.

    Raises:
        ParameterFileError: It is neither.
    """
    if element in PRESETS:
        return {'design.preset': element}
    path = Path(element).expanduser().absolute()
    if not path.is_file():
        raise ParameterFileError(
            f'element must be the path of a parameter file, or one of {", ".join(PRESETS)}; '
            f'got {short_repr(element)}'
        )
    try:
        parse_yaml(read_file(path))  # ROS would read any file to its end
    except DecodeError as error:
        raise ParameterFileError(f'{path}: {error}') from error
    return str(path)


def parse_preset(text: str, name: str = 'the file', *, further: bool = True) -> Preset:
    """Return the preset that a parameter file's text names, with the changes in it.

    Args:
        text: YAML, as `/**: {ros__parameters: {design: {preset: case_2}, write: ...}}`. Instead of
            a preset it may name a `design.file`, as what `ros2 param dump` writes.
        name: Its name in messages.
        further: Whether it may name a file.

    Raises:
        ParameterFileError, DesignError, SettingsError: As `load_preset`.
    """
    given = dict(_flatten_parameters(_read_parameters(text, name), name))
    basis, file = given.pop('design.preset', DEFAULT_ELEMENT), given.pop('design.file', '')
    law = given.pop('design.law', None)
    if file and not further:
        raise ParameterFileError(f'{name}: it must not name another design.file; got {file!r}')
    try:
        chosen = parse_preset(_read_source(file), file, further=False) if file else preset(basis)
    except DesignError as error:
        raise ParameterFileError(f'{name}: design.{error}') from error
    owners: dict[str, Any] = {'design': chosen.design, **chosen.settings.groups()}
    groups: dict[str, dict[str, Any]] = {group: {} for group in owners}
    kinds = {
        f'{group}.{field.name}': str(field.type)
        for group, owner in owners.items()
        for field, _ in find_descriptions(owner)
    }
    known = {*RCLPY_PARAMETERS, *(name for name, *_ in declare_parameters())}
    for key, value in given.items():
        if key not in kinds:
            if key in known or key.startswith('qos_overrides.'):
                continue
            near = difflib.get_close_matches(key, [*kinds, *known], n=1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise ParameterFileError(
                f'{name}: there is no parameter {make_printable(key, 80)}{hint}'
            )
        group, _, field_name = key.partition('.')
        groups[group][field_name] = _convert_value(value, kinds[key], key, name)
    try:
        parts = {
            group: dataclasses.replace(owners[group], **values) for group, values in groups.items()
        }
        design = parts.pop('design')
        settings = Settings(**parts)
        if law is not None:
            design = dataclasses.replace(
                design, law=_load_law(law, settings.scale) if law else None
            )
        design.require_memory()
        return Preset(design, settings)
    except DesignError as error:
        raise DesignError(f'{name}: design.*: {error}') from error
    except SettingsError as error:
        raise SettingsError(f'{name}: {error}') from error
    except LawFileError as error:
        raise ParameterFileError(f'{name}: design.law: {error}') from error


def _load_law(source: str, scale: ScaleSettings) -> Curve:
    """Return the on-site law of a text, or in the file that it names."""
    text = (
        source
        if law_file.is_law_text(source)
        else law_file.read_law_text(Path(source).expanduser())
    )
    return law_file.parse_curve(text, scale.length, scale.stiffness)


def format_preset(design: Design, settings: Settings) -> str:
    """Return the parameter file of a design and settings, which `parse_preset` reads back.

    It names the nearest preset and lists what differs.
    """
    wanted = {'design': design, **settings.groups()}
    candidates = {
        name: {
            group: _find_differences(wanted[group], values)
            for group, values in {'design': known.design, **known.settings.groups()}.items()
        }
        for name, known in {
            DEFAULT_ELEMENT: preset(DEFAULT_ELEMENT),
            **PRESETS,
        }.items()  # DEFAULT wins a tie
    }
    name = min(candidates, key=lambda name: sum(map(len, candidates[name].values())))
    differences = candidates[name]
    groups = {'design': {'preset': name, **differences.pop('design')}, **differences}
    given = {group: values for group, values in groups.items() if values}
    text: str = yaml.safe_dump({'/**': {'ros__parameters': given}}, sort_keys=False)
    return text


def _find_differences(given: Any, default: Any) -> dict[str, Any]:
    pairs = ((field.name, getattr(given, field.name)) for field in dataclasses.fields(given))
    return {key: _to_plain(value) for key, value in pairs if value != getattr(default, key)}


def _to_plain(value: Any) -> Any:
    if isinstance(value, Curve):
        return law_file.format_law(value)
    return float(value) if isinstance(value, float) else value  # a search leaves NumPy's


def _read_parameters(text: str, name: str) -> dict[str, Any]:
    """Return what is below `ros__parameters`, of `/**` and one node merged."""
    try:
        content = parse_yaml(text, texts=True)
    except DecodeError as error:
        raise ParameterFileError(f'{name}: {error}') from error
    sections = content if isinstance(content, Mapping) else {}
    found = {
        node: section['ros__parameters']
        for node, section in sections.items()
        if isinstance(section, Mapping) and isinstance(section.get('ros__parameters'), Mapping)
    }
    if not found:
        raise ParameterFileError(
            f'{name}: it must hold a node, as /**, and under it ros__parameters; it has neither'
        )
    named = [node for node in found if '*' not in node]
    if len(named) > 1:
        raise ParameterFileError(
            f'{name}: it must hold the parameters of one node; got {", ".join(named)}'
        )
    merged: dict[str, Any] = {}
    for node in sorted(found, key=lambda node: node in named):
        merged |= dict(_flatten_parameters(found[node], name))
    return merged


def _flatten_parameters(
    parameters: Mapping[str, Any], name: str, above: str = ''
) -> Iterator[tuple[str, str]]:
    for key, value in parameters.items():
        if isinstance(value, Mapping):
            yield from _flatten_parameters(value, name, f'{above}{key}.')
        elif isinstance(value, str):
            yield f'{above}{key}', value
        else:
            raise ParameterFileError(
                f'{name}: {above}{key} must be one value; got {short_repr(value)}'
            )


def _convert_value(text: str, kind: str, key: str, name: str) -> Any:
    """Return a value of the declared type; like ROS, it converts no integer to a double."""
    if kind == 'str':
        return text
    if kind == 'bool' and text.lower() in ('true', 'false'):
        return text.lower() == 'true'
    whole = re.fullmatch(r'[-+]?\d+', text) is not None
    if kind == 'int' and whole and len(text) < 100:
        return int(text)
    if kind == 'float' and not whole:
        try:
            return float(text.replace('.inf', 'inf').replace('.nan', 'nan'))
        except ValueError:
            pass
    wanted = {
        'bool': 'true or false',
        'int': 'an integer',
        'float': 'a double (a number with a decimal point)',
    }
    raise ParameterFileError(
        f'{name}: parameter {key} must be {wanted[kind]}; got {short_repr(text)}'
    )
