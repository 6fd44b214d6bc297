# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The wait for the compiler is reported repeatedly, and not at all with a warm cache."""

import logging
import threading
from types import SimpleNamespace

import pytest

from mlmem_ros.physics import CASE_II
from mlmem_ros.ros.node import starting

NODE = SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
TEXT = 'compiling the kernels of the rigid substrate (pefrl)'


@pytest.fixture
def cached(monkeypatch):
    """Set whether the kernels are in the compiler's cache: cached(True)."""
    return lambda answer: monkeypatch.setattr(starting, 'kernel_in_cache', lambda *_: answer)


def test_cached_kernels_are_not_reported(cached, caplog):
    cached(True)
    told = []
    with (
        caplog.at_level('INFO'),
        starting.telling_compilation(NODE, CASE_II, 'pefrl', told.append),
    ):
        pass
    assert told == []
    assert caplog.messages == []


def test_compiling_is_reported_until_it_ends(cached, caplog, monkeypatch):
    cached(False)
    monkeypatch.setattr(starting, 'REMINDER', 0.001)
    told, thrice = [], threading.Event()

    def report(text):
        told.append(text)
        if len(told) == 3:
            thrice.set()

    with caplog.at_level('INFO'), starting.telling_compilation(NODE, CASE_II, 'pefrl', report):
        assert thrice.wait(10.0)
    assert set(told) == {TEXT}
    assert caplog.messages[0].startswith(TEXT)
    assert caplog.messages[1].startswith('compiled in')
    assert 'mlmem-compiling' not in [thread.name for thread in threading.enumerate()]


def test_a_failure_ends_the_reminders(cached):
    cached(False)
    with pytest.raises(RuntimeError), starting.telling_compilation(NODE, CASE_II, 'pefrl', print):
        raise RuntimeError
    assert 'mlmem-compiling' not in [thread.name for thread in threading.enumerate()]
