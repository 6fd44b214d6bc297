# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder: how the session file stands."""

from __future__ import annotations

from ...device import Loop
from ..recording import Recording
from .health import ERROR, OK, WARN, Component, Health


class RecorderComponent(Component):
    """Warns of a session with gaps or at its greatest size; a recording that failed is an error.

    Attributes:
        recording: The session that is recorded, or None.
    """

    name = 'recorder'

    def __init__(self) -> None:
        self.recording: Recording | None = None

    def health(self, loop: Loop) -> Health:
        """Return the status of the recording."""
        return self.rest()

    def rest(self) -> Health:
        """Tell the same: a session may be closed while the node is not active."""
        if self.recording is None:
            return Health(OK, 'not recording')
        status = self.recording.status
        values = {
            'path': status.path,
            'messages': status.messages,
            'bytes': status.size,
            'queued': status.queued,
            'dropped': status.dropped,
        }
        if status.error is not None:
            return Health(ERROR, str(status.error), values)
        if status.dropped:
            text = f'{status.dropped} messages found no room and are missing'
            return Health(WARN, text, values)
        if self.recording.full:
            return Health(WARN, 'full: the session has ended at record.most_megabytes', values)
        return Health(OK, status.state, values)
