# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Loops that end with their test, and a device on which level after level was written."""

import pytest
import rig

from mlmem import BLANK, Loop, Write, snapshot


@pytest.fixture(scope='session')
def climb():
    """Write all levels upward on one element; return a snapshot of each."""
    element, snapshots = rig.device(), []
    for level in range(rig.DESIGN.levels):
        rig.succeed(element, Write(level))
        snapshots.append(snapshot.take_snapshot(element))
    return snapshots


@pytest.fixture
def written(climb):
    """Return a device on which a level was written by a procedure, with known content; or a blank
    one, of unknown content.
    """

    def written(level, **settings):
        element = rig.device(**settings)
        if level != BLANK:
            snapshot.restore_snapshot(element, climb[level])
        return element

    return written


@pytest.fixture
def start():
    """Start loops, by default as fast as possible, and stop them after the test."""
    loops = []

    def start(element, listener=lambda commands, events: None, *, speed=0.0, **options):
        loop = Loop(element, listener, speed=speed, **options)
        loops.append(loop)
        loop.start()
        return loop

    yield start
    for loop in loops:
        loop.shut_down()
