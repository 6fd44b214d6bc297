# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node that compiles says so in its log, on its heartbeat and in its diagnostics."""

import logging
from types import SimpleNamespace

import pytest

from mlmem.physics import CASE_II
from mlmem_ros.ros.node import starting

NODE = SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
TEXT = 'compiling the kernels of the rigid substrate (pefrl)'


@pytest.fixture
def host():
    return SimpleNamespace(preparing='')


@pytest.fixture
def cached(monkeypatch):
    """Set whether the kernels are in the compiler's cache: cached(True)."""
    return lambda answer: monkeypatch.setattr(starting, 'is_kernel_cached', lambda *_: answer)


def test_preparation_with_cached_kernels_is_not_logged(cached, host, caplog):
    cached(True)
    with caplog.at_level('INFO'), starting.report_preparation(NODE, host, CASE_II, 'pefrl'):
        assert host.preparing == 'preparing the device'
    assert host.preparing == ''
    assert caplog.messages == []


def test_preparation_that_compiles_is_logged_and_reported(cached, host, caplog):
    cached(False)
    with caplog.at_level('INFO'), starting.report_preparation(NODE, host, CASE_II, 'pefrl'):
        assert host.preparing == TEXT
    assert host.preparing == ''
    assert caplog.messages[0].startswith(TEXT)
    assert caplog.messages[1].startswith('compiled in')


def test_preparation_that_fails_is_over(cached, host):
    cached(False)
    with (
        pytest.raises(RuntimeError),
        starting.report_preparation(NODE, host, CASE_II, 'pefrl'),
    ):
        raise RuntimeError
    assert host.preparing == ''
