# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node that compiles says so in its log, on its heartbeat and in its diagnostics."""

import logging
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from mlmem.physics import CASE_II
from mlmem_ros.ros.node import starting


@pytest.mark.parametrize(
    ('cached', 'text'),
    [
        (True, 'preparing the device'),
        (False, 'compiling the kernels of the rigid substrate (pefrl)'),
    ],
)
@pytest.mark.parametrize('fails', [False, True])
def test_preparation_is_reported_until_it_ends(monkeypatch, caplog, cached, text, fails):
    """Only a compilation is logged."""
    monkeypatch.setattr(starting, 'is_kernel_cached', lambda *_: cached)
    host = SimpleNamespace(preparing='')
    node = SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
    with (
        caplog.at_level('INFO'),
        pytest.raises(RuntimeError) if fails else nullcontext(),
        starting.report_preparation(node, host, CASE_II, 'pefrl'),
    ):
        assert host.preparing == text
        if fails:
            raise RuntimeError
    assert host.preparing == ''
    assert bool(caplog.messages) != cached
    if not cached:
        assert caplog.messages[0].startswith(text)
        assert fails or caplog.messages[1].startswith('compiled in')
