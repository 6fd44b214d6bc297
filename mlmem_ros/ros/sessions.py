# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Starting and stopping session files: with the node, and by ~/record while it runs."""

from __future__ import annotations

import time
from collections.abc import Callable
from concurrent.futures import Future
from pathlib import Path

from rclpy.node import Node

from ..bag.errors import BagError
from ..device import MemoryElement, Refused, SettingsError
from .files import confined
from .gate import Gate
from .recording import Recording
from .settings import RecordSettings

Attach = Callable[[Recording | None], None]
"""Connects the node's taps to a recording, or to none."""


class Sessions:
    """Holds the one recording of a node.

    Attributes:
        current: The recording under way, or None.
    """

    def __init__(self, node: Node, gate: Gate, attach: Attach) -> None:
        self.current: Recording | None = None
        self._node = node
        self._gate = gate
        self._attach = attach
        self._ended: Recording | None = None

    def open(self, element: MemoryElement, settings: RecordSettings) -> None:
        """Begin with the node, where a path says so, before time runs.

        Raises:
            BagError: The path exists, or cannot be written.
            SettingsError: It leads out of `files.root`.
        """
        if settings.path:
            path = confined(settings.path, self._root)
            self._begin(Recording(self._node, element, settings, path))

    def close(self) -> None:
        """End with the node, when time does not run any more."""
        if self.current is not None:
            self._end()
        self.settle()

    def start(self) -> Future[Path]:
        """Begin while time runs.

        Returns:
            The path of the new bag, once it holds the present state; `Refused` where a
            recording or a procedure is under way, `BagError` where it cannot be written,
            `SettingsError` where the path leads out of `files.root`.
        """
        try:
            element = self._gate.open_loop().element
            if self.current is not None:
                raise Refused(f'busy: recording into {self.current.status.path}')
            if element.procedure:
                raise Refused(f'busy: {element.procedure} is running; a session begins idle')
            settings = self._record_settings()
            path = _new_path(settings.path, self._root)
            recording = Recording(self._node, element, settings, path)
        except (Refused, BagError, SettingsError) as refusal:
            return _failed(refusal)
        return self._gate.open_loop().call(lambda: self._begin(recording))

    def stop(self) -> Future[Path]:
        """End while time runs.

        Returns:
            The path of the bag once nothing more goes into it; `settle` then closes it.
        """
        try:
            loop = self._gate.open_loop()
            if self.current is None:
                raise Refused('nothing is being recorded')
        except Refused as refusal:
            return _failed(refusal)
        return loop.call(self._end)

    def settle(self) -> None:
        """Finish the bag of a recording that has ended."""
        ended, self._ended = self._ended, None
        if ended is not None:
            ended.close()

    def _begin(self, recording: Recording) -> Path:
        try:
            recording.begin()
        except Refused:  # a procedure began in between
            recording.close()
            raise
        self.current = recording
        self._attach(recording)
        return recording.status.path

    def _end(self) -> Path:
        ended, self.current = self.current, None
        self._attach(None)
        assert ended is not None
        ended.end()
        self._ended = ended
        return ended.status.path

    @property
    def _root(self) -> str:
        root: str = self._node.get_parameter('files.root').value
        return root

    def _record_settings(self) -> RecordSettings:
        values = self._node.get_parameters_by_prefix('record')
        return RecordSettings(**{name: item.value for name, item in values.items()})


def _new_path(configured: str, root: str) -> Path:
    """Return the configured path, or one with the time where it is empty or taken."""
    path = confined(configured or 'session', root)
    if configured and not path.exists():
        return path
    return path.with_name(f'{path.name}-{time.strftime("%Y%m%d-%H%M%S")}')


def _failed(refusal: Exception) -> Future[Path]:
    answer: Future[Path] = Future()
    answer.set_exception(refusal)
    return answer
