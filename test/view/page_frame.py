# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a page receives."""

import json


def unpack_frame(frame):
    """Return the header of a frame for a page, and its body."""
    length = int.from_bytes(frame[:4], 'little')
    return json.loads(frame[4 : 4 + length]), frame[4 + length :]
