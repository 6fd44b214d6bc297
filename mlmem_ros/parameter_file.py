# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node's ROS parameter file, read without ROS: the design and the settings it gives.

Names, types and ranges are those of the node; what concerns the node alone is left to it.
"""

from __future__ import annotations

import dataclasses
import difflib
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml  # type: ignore[import-untyped]

from .described import descriptions
from .device.errors import SettingsError
from .device.settings import Settings
from .physics import PRESETS, Design, DesignError, preset

DEFAULT_PRESET = 'case_2'
"""The design that a node starts from."""

OF_THE_NODE = ('publish', 'record', 'state', 'target_level', 'autostart', 'use_sim_time')
"""Groups and names that the node knows and a design does not."""

OF_THE_NODE_TOO = ('time.speed', 'design.check')
"""Names that the node knows, in groups of the device."""


class ParameterFileError(ValueError):
    """A file that is not a node's parameter file: the message names what and where."""


def load(source: str) -> tuple[Design, Settings]:
    """Return the design and the settings of a parameter file, or of a shipped one by its name.

    A preset has the settings of its file in `config`, where it is at hand, else the defaults.

    Args:
        source: Path of a file, or the name of a shipped one: of a preset, `fast`, ...

    Raises:
        ParameterFileError: There is no such file, or it is not a parameter file of a node.
        DesignError: The design makes no memory.
        SettingsError: Settings are out of range or contradict each other.
    """
    path = shipped_file(source) or Path(source)
    if source in PRESETS and path == Path(source):
        return preset(source), Settings()
    try:
        text = path.read_text(encoding='utf-8')
    except (OSError, UnicodeDecodeError) as error:
        raise ParameterFileError(
            'FILE|PRESET must be a readable parameter file, the name of one that ships, or one of '
            f'{", ".join(PRESETS)}; got {source!r}: {error}'
        ) from error
    return parse(text, source)


def parse(text: str, name: str = 'the file') -> tuple[Design, Settings]:
    """Return the design and the settings that a parameter file's text gives.

    Args:
        text: YAML, as `/**: {ros__parameters: {design: {preset: case_2}, write: ...}}`.
        name: What to call it in messages.

    Raises:
        ParameterFileError, DesignError, SettingsError: As `load`.
    """
    given = dict(_flat(_parameters(text, name), name))
    groups: dict[str, dict[str, Any]] = {'design': {}}
    groups |= {group: {} for group in Settings().groups()}
    try:
        chosen = preset(given.pop('design.preset', DEFAULT_PRESET))
    except DesignError as error:
        raise ParameterFileError(f'{name}: design.{error}') from error
    owners: dict[str, Any] = {'design': chosen, **Settings().groups()}
    kinds = {
        f'{group}.{field.name}': str(field.type)
        for group, owner in owners.items()
        for field, _ in descriptions(owner)
    }
    for key, value in given.items():
        if key in OF_THE_NODE_TOO or key.split('.')[0] in OF_THE_NODE:
            continue
        if key not in kinds:
            near = difflib.get_close_matches(key, kinds, n=1)
            hint = f'; did you mean {near[0]}?' if near else ''
            raise ParameterFileError(f'{name}: there is no parameter {key}{hint}')
        group, _, field_name = key.partition('.')
        groups[group][field_name] = _typed(value, kinds[key], key, name)
    try:
        design = dataclasses.replace(chosen, **groups.pop('design'))
        parts = {
            group: dataclasses.replace(owners[group], **values) for group, values in groups.items()
        }
        return design, Settings(**parts)
    except DesignError as error:
        raise DesignError(f'{name}: design.*: {error}') from error
    except SettingsError as error:
        raise SettingsError(f'{name}: {error}') from error


def text_of(design: Design, settings: Settings) -> str:
    """Return the parameter file of a design and settings, which `parse` reads back.

    A shipped design is named; of another, what differs from the default preset is given, as is
    of the settings what differs from their defaults.
    """
    name = next((name for name, known in PRESETS.items() if known == design), DEFAULT_PRESET)
    groups = {'design': {'preset': name, **_differences(design, preset(name))}}
    for group, default in Settings().groups().items():
        if different := _differences(getattr(settings, group), default):
            groups[group] = different
    lines = ['/**:', '  ros__parameters:']
    for group, values in groups.items():
        lines.append(f'    {group}:')
        lines += [f'      {key}: {_scalar(value)}' for key, value in values.items()]
    return '\n'.join(lines) + '\n'


def _differences(given: Any, default: Any) -> dict[str, Any]:
    pairs = ((field.name, getattr(given, field.name)) for field in dataclasses.fields(given))
    return {key: value for key, value in pairs if value != getattr(default, key)}


def _scalar(value: Any) -> str:
    """Return a value in YAML; a double has a point, or ROS would take it for an integer."""
    if isinstance(value, bool):
        return str(value).lower()
    text = str(value)
    if isinstance(value, float) and '.' not in text:
        mantissa, e, exponent = text.partition('e')
        text = f'{mantissa}.0{e}{exponent}'
    return text


def shipped_file(name: str) -> Path | None:
    """Return the shipped parameter file of a name: in a checkout, or under this prefix."""
    if not name.isidentifier():  # a path
        return None
    here = Path(__file__).resolve()
    places = [parent / 'share' / 'mlmem_ros' / 'config' for parent in here.parents]
    for place in (here.parents[1] / 'config', *places):
        if (file := place / f'{name}.yaml').is_file():
            return file
    return None


def _parameters(text: str, name: str) -> Mapping[str, Any]:
    """Return what is under `ros__parameters`, that of `/**` and of one node together."""
    try:
        content = yaml.load(text, yaml.BaseLoader)  # every scalar stays the text it is
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ParameterFileError(
            f'{name}: it must be YAML; {" ".join(str(error).split())}'
        ) from error
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
        merged |= dict(_flat(found[node], name))
    return merged


def _flat(parameters: Mapping[str, Any], name: str, above: str = '') -> Iterator[tuple[str, str]]:
    """Yield names with their dots, and the text of the values."""
    for key, value in parameters.items():
        if isinstance(value, Mapping):
            yield from _flat(value, name, f'{above}{key}.')
        elif isinstance(value, str):
            yield f'{above}{key}', value
        else:
            raise ParameterFileError(f'{name}: {above}{key} must be one value; got {value!r}')


def _typed(text: str, kind: str, key: str, name: str) -> Any:
    """Return a value of the type that the node declares; ROS turns no integer into a double."""
    if kind == 'str':
        return text
    if kind == 'bool' and text.lower() in ('true', 'false'):
        return text.lower() == 'true'
    whole = re.fullmatch(r'[-+]?\d+', text) is not None
    if kind == 'int' and whole:
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
    raise ParameterFileError(f'{name}: parameter {key} must be {wanted[kind]}; got {text!r}')
