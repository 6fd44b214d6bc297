# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shipped elements: the files of `config/`, by name. docs/presets.md says what they are for.

A file is loaded when its element is first needed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import NamedTuple

from . import element_file
from .element_file import Element, ElementFileError
from .physics import Design, DesignError
from .schema import short_repr
from .settings import Settings

ELEMENT_NAMES = (
    'case_1', 'case_2', 'byte', 'bits_1', 'bits_2', 'bits_4', 'register_4', 'register_5', 'kick_2',
    'kick_4',
)  # fmt: skip
"""`bits_n` and `kick_n` store n bits."""

DEFAULT_ELEMENT = 'case_2'
"""The default element."""

INSTALLED_FOLDER = Path(__file__).parent / 'elements'
"""Where setup.py puts the files; a checkout has them in `config/` alone."""


class Preset(NamedTuple):
    """An element with the settings of its instrument: `new_element(preset('bits_4'))`."""

    design: Design
    settings: Settings

    @property
    def digest(self) -> str:
        """A hash of every bit of it that is not a default, so that a new setting changes none."""
        defaults, values = Settings().as_dict(), {'design': self.design.as_dict()}
        for name, group in self.settings.as_dict().items():
            if given := {key: it for key, it in group.items() if it != defaults[name][key]}:
                values[name] = given
        text = json.dumps(values, sort_keys=True)
        return hashlib.blake2b(text.encode(), digest_size=8).hexdigest()


def load_element(source: str | Path) -> Element:
    """Return a shipped element by its name, or the element in a file by its path.

    Raises:
        ElementFileError: There is no such file, or it is not that of an element.
    """
    if source in ELEMENT_NAMES:
        return _load_shipped(str(source))
    path = Path(source)
    if not path.exists():
        raise ElementFileError(
            f'element must be one of {", ".join(ELEMENT_NAMES)}, or the path of an element file; '
            f'got '
            f'{short_repr(str(source))}'
        )
    return element_file.read_element_file(path)


@cache
def _load_shipped(name: str) -> Element:
    folder = INSTALLED_FOLDER
    if not folder.is_dir():
        folder = Path(__file__).resolve().parent.parent / 'config'
    return element_file.read_element_file(folder / f'{name}.yaml')


def use_kicks(element: Preset) -> Preset:
    """Return an element that is written without strain."""
    write = replace(element.settings.write, method='kick')
    return element._replace(settings=replace(element.settings, write=write))


class _Presets(Mapping[str, Preset]):
    """The shipped elements by name."""

    def __getitem__(self, name: str) -> Preset:
        if name not in ELEMENT_NAMES:
            raise KeyError(name)
        return _load_preset(name)

    def __iter__(self) -> Iterator[str]:
        return iter(ELEMENT_NAMES)

    def __len__(self) -> int:
        return len(ELEMENT_NAMES)

    def __contains__(self, name: object) -> bool:
        return name in ELEMENT_NAMES  # without loading it


@cache
def _load_preset(name: str) -> Preset:
    element = _load_shipped(name)
    return Preset(element.design, element.settings)


PRESETS: Mapping[str, Preset] = _Presets()


def preset(name: str) -> Preset:
    """Return a shipped element by its name in `PRESETS`.

    Raises:
        DesignError: There is no such preset.
    """
    try:
        return PRESETS[name]
    except KeyError:
        raise DesignError(f'preset must be one of {", ".join(PRESETS)}; got {name!r}') from None
