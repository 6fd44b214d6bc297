# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The elements of the runs: most often two levels and strong damping, so that a write takes some
40 ticks; else shipped elements of up to 32 levels.
"""

from dataclasses import dataclass, replace
from functools import cache, cached_property

from mlmem import MemoryElement, Settings, Write, factory_calibration, load_element, snapshot
from mlmem.physics import Design


@dataclass(frozen=True)
class ElementKind:
    """A design with the settings of its instrument."""

    design: Design
    settings: Settings

    @cached_property
    def calibration(self):
        """Its factory calibration."""
        return factory_calibration(self.design, self.settings)

    @cache  # noqa: B019 (there are five)
    def make_snapshot(self, level):
        """Return the snapshot of an element on which a level was written, or of a blank one."""
        element = MemoryElement(self.design, self.settings, self.calibration)
        if level >= 0:
            assert element.perform(Write(level)).reading.level == level
        return snapshot.take_snapshot(element)

    def restore_element(self, taken):
        """Return a new element in the state of a snapshot."""
        element = MemoryElement(self.design, self.settings, self.calibration)
        snapshot.restore_snapshot(element, taken)
        return element


def _make_quick_kind():
    """Return an element that is written within seconds of its run: a tick is 0.1 s."""
    design, settings = load_element('bits_1').design_and_settings
    changes = {
        'write': {'final_settle': 300.0}, 'erase': {'settle': 300.0}, 'read': {'rest': 50.0},
        'probe_right': {'gain_decay': 1 / 160}, 'time': {'tick': 50.0}, 'scale': {'time': 2e-3},
    }  # fmt: skip
    groups = {name: replace(getattr(settings, name), **given) for name, given in changes.items()}
    return ElementKind(replace(design, eta=1 / 80), replace(settings, **groups))


def _load_shipped_kind(name):
    """Return a preset at a pace of twenty ticks a second: a write takes 15 to 25 of them."""
    design, settings = load_element(name).design_and_settings
    scale = replace(settings.scale, time=0.05 / settings.time.tick)
    return ElementKind(design, replace(settings, scale=scale))


ELEMENT_KINDS = {
    kind.design.levels: kind
    for kind in (_make_quick_kind(), *map(_load_shipped_kind, ('bits_2', 'case_2', 'bits_4')))
}
"""The elements, by the number of their levels."""


@cache
def is_healthy(faults):
    """Return whether a device has no faults."""
    return not faults.list_active()
