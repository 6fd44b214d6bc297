# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Writes a shot as a bench without ROS does."""

import numpy as np

from mlmem_tools.identification.csv_shots import SHOT_HEADINGS


def save_shot(path, shot):
    """Write a shot to a CSV file."""
    values = (*(getattr(shot, name) for name in SHOT_HEADINGS[:-2]), *shot.rest)
    head = '\n'.join(f'{name}: {value}' for name, value in zip(SHOT_HEADINGS, values, strict=True))
    np.savetxt(path, shot.samples.T, delimiter=',', header=head, fmt='%.17g')
