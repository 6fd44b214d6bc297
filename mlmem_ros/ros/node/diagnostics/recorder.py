# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The recorder: how the session file stands."""

from __future__ import annotations

from ....device import Loop
from ....host import Host
from .health import ERROR, OK, WARN, Component, Health


class RecorderComponent(Component):
    """Warns of a session with gaps or at its greatest size; one that failed is an error."""

    name = 'recorder'

    def __init__(self, host: Host) -> None:
        self._host = host

    def health(self, loop: Loop) -> Health:
        """Return the status of the recording."""
        return self.rest()

    def rest(self) -> Health:
        """Tell the same: a session may be closed while the node is not active."""
        recording = self._host.recording
        if recording is None:
            return Health(OK, self._host.sessions.state.value)
        status = recording.status
        values = {
            'path': status.path,
            'messages': status.messages,
            'bytes': status.size,
            'queued': status.queued,
            'dropped': status.dropped,
            'longest_wait': round(status.longest_wait, 3),
        }
        if status.error is not None:
            return Health(ERROR, str(status.error), values)
        if status.dropped:
            text = f'{status.dropped} messages found no room and are missing'
            return Health(WARN, text, values)
        if recording.full:
            return Health(WARN, 'full: the session has ended at record.most_megabytes', values)
        return Health(OK, status.state, values)
