# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The shipped elements as designs with settings, by name.

docs/reference/elements.md says what they are for. A file is loaded when its element is first
needed.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from .element_file import NAMES, load_element
from .physics import Design, DesignError
from .settings import Settings


class Preset(NamedTuple):
    """An element with the settings of its instrument: `MemoryElement(preset('bits_4'))`."""

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


def load_preset(source: str | Path) -> Preset:
    """Return design and settings of an element; arguments and errors as `load_element`."""
    element = load_element(source)
    return Preset(element.design, element.settings)


def use_kicks(element: Preset) -> Preset:
    """Return an element that is written without strain."""
    write = replace(element.settings.write, method='kick')
    return element._replace(settings=replace(element.settings, write=write))


class _Presets(Mapping[str, Preset]):
    """The shipped elements by name."""

    def __getitem__(self, name: str) -> Preset:
        if name not in NAMES:
            raise KeyError(name)
        return load_preset(name)

    def __iter__(self) -> Iterator[str]:
        return iter(NAMES)

    def __len__(self) -> int:
        return len(NAMES)


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
