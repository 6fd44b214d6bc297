# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A design is checked before it is built, once in a process."""

from mlmem_ros.analysis.checks import Finding, Report, Verdict
from mlmem_ros.device import Settings
from mlmem_ros.device.settings import ScaleSettings
from mlmem_ros.host import design_check
from mlmem_ros.host.design_check import check_design
from mlmem_ros.physics import CASE_II


def test_a_design_that_is_configured_again_is_not_checked_again(monkeypatch, journal, log):
    found = Finding('carrier_left', {}, '', Verdict.WARN, 'close to the edge of its band', '')
    checked = []

    def check(design, settings):
        checked.append(settings)
        return Report((found,))

    monkeypatch.setattr(design_check, 'check', check)
    one, other = (Settings(scale=ScaleSettings(time=time)) for time in (0.123, 0.124))
    for settings in (one, one, other, one):
        check_design(CASE_II, settings, 'refuse', journal)
    assert checked == [one, other]
    assert len(log.of('warning')) == 4  # what it found is told each time
