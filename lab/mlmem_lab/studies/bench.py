# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The devices of a study: all with the same element, exactly as designed or as a fit found it."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import Any

from mlmem import Calibration, MemoryElement, Settings, factory_calibration
from mlmem.element_file import Element, parse_element
from mlmem.factory import compute_calibration
from mlmem.instrument.drivers import Simulation
from mlmem.move_settings import WriteSettings
from mlmem.moves.corrections import make_corrections
from mlmem.parsing import decode_value
from mlmem.physics import Design, Specimen, find_level
from mlmem.physics.wall import arrival_tolerance
from mlmem.readers.reading import UNDECODABLE
from mlmem.readers.register import find_wall_levels
from mlmem.readers.words import make_code


@dataclass(frozen=True)
class Bench:
    """An element and the settings of its instrument.

    Attributes:
        element: The element with its pulses; None for one exactly as designed.
    """

    design: Design
    settings: Settings
    element: Element | None = None

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        found = {'design': self.design.as_dict(), 'settings': self.settings.as_dict()}
        return found | ({} if self.element is None else {'element': self.element.as_dict()})

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Bench:
        """Return what `as_dict` described."""
        element = _load_element(json.dumps(data['element'])) if 'element' in data else None
        design = decode_value(Design, data['design'])
        return cls(design, decode_value(Settings, data['settings']), element)

    @cached_property
    def made(self) -> Specimen:
        """The element as it is simulated."""
        return Specimen(self.design) if self.element is None else self.element.timed_specimen

    @property
    def calibration(self) -> Calibration:
        """Its delays, shared by equal instruments, and its pulses: factors on those set.

        Raises:
            SettingsError: A level gives no echo, or levels cannot be told apart by their echoes.
        """
        heard = self.settings
        if self.design.substrate != 'elastic':  # a write does not change what is heard
            heard = replace(heard, write=WriteSettings(method=heard.write.method))
        if self.element is None:
            return factory_calibration(self.design, heard)
        corrections = self.element.plan and make_corrections(
            self.element.plan.steps, self.settings
        )
        return replace(
            _calibrate_delays(self.element, self.design, heard), pulse_corrections=corrections
        )

    def device(self, calibration: Calibration | None = None) -> MemoryElement:
        """Return a blank device; raises as `calibration`."""
        calibration = calibration or self.calibration
        if self.element is None:
            return MemoryElement(self.design, self.settings, calibration)
        settings = self.element.apply_planned_kicks(self.settings)
        driver = Simulation.of(self.made, settings.time)
        device = MemoryElement(self.design, settings, calibration, driver)
        if device.settings.register.spacing:
            device.adopt(self.made)
        return device

    def level(self, device: MemoryElement) -> int:
        """Return the level at which the wall of a device is; -1 if blank, -2 if at none; of many
        walls the word.
        """
        made = self.made
        if (code := make_code(made.design, device.settings)) is not None:
            levels = find_wall_levels(made.design, device.chain.configuration)
            allowed = levels is not None and code.is_valid_word(levels)
            return code.word(levels or ()) if allowed else UNDECODABLE
        return find_level(made.design, device.chain.configuration, arrival_tolerance(made.design))


@lru_cache(maxsize=4)
def _load_element(text: str) -> Element:
    return parse_element(json.loads(text))


@lru_cache(maxsize=64)
def _calibrate_delays(element: Element, design: Design, settings: Settings) -> Calibration:
    return compute_calibration(element.timed_specimen, design, settings)
