# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node that compiles says so in its log, on its heartbeat and in its diagnostics."""

import logging
from contextlib import nullcontext
from types import SimpleNamespace

import pytest

from mlmem.physics import CASE_II
from mlmem_ros.ros.node import starting


@pytest.mark.parametrize('cached', [True, False])
@pytest.mark.parametrize('fails', [False, True])
def test_preparation_is_reported_until_it_ends(monkeypatch, caplog, cached, fails):
    """Only a compilation is logged."""
    monkeypatch.setattr(starting, 'is_kernel_cached', lambda *_: cached)
    host = SimpleNamespace(preparing='')
    node = SimpleNamespace(get_logger=lambda: logging.getLogger('test'))
    with (
        caplog.at_level('INFO'),
        pytest.raises(RuntimeError) if fails else nullcontext(),
        starting.report_preparation(node, host, CASE_II, 'pefrl'),
    ):
        assert host.preparing.startswith('preparing' if cached else 'compiling')
        if fails:
            raise RuntimeError
    assert host.preparing == ''
    words = [] if cached else ['compiling', 'compiled'][: 1 if fails else 2]
    assert [line.split()[0] for line in caplog.messages[: len(words)]] == words
    assert bool(caplog.messages) != cached
