# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Content and calibration between two runs of the node: restored, and saved at intervals."""

from __future__ import annotations

import threading
from concurrent.futures import Future
from typing import Any

from rclpy.node import Node

from ..device import (
    Calibration,
    MemoryElement,
    Settings,
    calibration_file,
    new_element,
    snapshot,
    state_file,
)
from ..device.calibration import calibration_key
from ..physics import Design, StateError
from .files import confined
from .gate import Gate
from .settings import StateSettings


class MemoryFile:
    """Keeps the state of a device in a file, its calibrations beside it; an empty path: none.

    Saving happens in a thread of its own: neither the loop nor the executor waits for the disk.
    """

    def __init__(self, node: Node, settings: StateSettings, root: str, gate: Gate) -> None:
        """Save at intervals from now on.

        Args:
            node: Its executor is where the timer runs.
            settings: Path and interval.
            root: What the path is confined to; see `files`.
            gate: The way to the device.

        Raises:
            SettingsError: The path leads out of the root.
        """
        self._node = node
        self._path = confined(settings.path, root) if settings.path else None
        self._calibrations = calibration_file.beside(self._path) if self._path else None
        self._calibrated: tuple[str, Calibration] | None = None
        self._gate = gate
        self._saving = threading.Lock()
        self._saved_ticks = 0
        self._timer = None
        if self._path is not None and settings.interval > 0.0:
            self._timer = node.create_timer(settings.interval, self._save_at_interval)

    def new_element(self, design: Design, settings: Settings) -> MemoryElement:
        """Return a blank device, calibrated as it was when it had this design and settings last.

        A new combination of them is calibrated on an ideal element, which takes its time, and
        is known from then on.

        Raises:
            StateError: The file of calibrations is damaged, or cannot be read or written.
            SettingsError: It cannot be calibrated.
            DesignError: The step is beyond the stability limit.
        """
        if self._calibrations is None:
            return new_element(design, settings)
        key = calibration_key(design, settings)
        known = calibration_file.load(self._calibrations, key, design.levels)
        element = new_element(design, settings, known)
        if known is None:
            calibration_file.save(self._calibrations, key, element.calibration)
        self._calibrated = key, element.calibration
        return element

    def restore(self, element: MemoryElement) -> None:
        """Give a new device the saved state, if there is one.

        Raises:
            StateError: The file is damaged, or belongs to another design.
        """
        if self._path is None:
            return
        saved = state_file.load(self._path)
        if saved is None:
            self._node.get_logger().info(f'no state in {self._path} yet: the element is blank')
            return
        saved.setdefault('calibration_key', '')  # 0.1.0 told none, and had other pulses
        try:
            snapshot.restore(element, saved)
        except StateError as error:
            raise StateError(f'{self._path} does not belong to this design: {error}') from error
        self._node.get_logger().info(f'state restored from {self._path}')

    def save(self, element: MemoryElement) -> None:
        """Save the state of an idle device whose loop does not run."""
        if self._path is not None:
            self._write(snapshot.take(element))

    def close(self) -> None:
        """Save no more at intervals."""
        if self._timer is not None:
            self._node.destroy_timer(self._timer)

    def _save_at_interval(self) -> None:
        loop = self._gate.loop
        if loop is not None and not loop.element.procedure:
            loop.call(lambda: snapshot.take(loop.element)).add_done_callback(self._taken)

    def _taken(self, answer: Future[dict[str, Any]]) -> None:
        if answer.exception() is None:  # else a procedure began meanwhile: the next time will do
            threading.Thread(target=self._write, args=(answer.result(),), daemon=True).start()

    def _write(self, taken: dict[str, Any]) -> None:
        assert self._path is not None
        with self._saving:
            if taken['ticks'] < self._saved_ticks:
                return  # a slow thread must not put back what was before the last saving
            try:
                state_file.save(self._path, taken)
                self._saved_ticks = taken['ticks']
                self._save_calibration(taken)
            except StateError as error:
                self._node.get_logger().error(str(error))

    def _save_calibration(self, taken: dict[str, Any]) -> None:
        present = taken['calibration_key'], Calibration.from_dict(taken['calibration'])
        if self._calibrations is not None and present != self._calibrated:  # it was learnt anew
            calibration_file.save(self._calibrations, *present)
            self._calibrated = present
