# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A design is checked before it is built, once in a process."""

from mlmem_ros.analysis.checks import Finding, Report, Verdict
from mlmem_ros.device import Settings
from mlmem_ros.device.settings import ScaleSettings
from mlmem_ros.host import design_check, kept_checks
from mlmem_ros.host.design_check import check_design
from mlmem_ros.physics import CASE_I, CASE_II


def test_a_design_that_is_configured_again_is_not_checked_again(monkeypatch, journal, log):
    found = Finding('carrier_left', {}, '', Verdict.WARN, 'close to the edge of its band', '')
    checked = []

    def check(design, settings):
        checked.append(settings)
        return Report((found,))

    monkeypatch.setattr(design_check, 'check', check)
    monkeypatch.setattr(kept_checks, '_path', lambda: None)
    one, other = (Settings(scale=ScaleSettings(time=time)) for time in (0.123, 0.124))
    for settings in (one, one, other, one):
        check_design(CASE_II, settings, 'refuse', journal)
    assert checked == [one, other]
    assert len(log.of('warning')) == 4  # what it found is told each time


def test_what_was_found_is_kept_for_the_next_process(monkeypatch, tmp_path):
    """Until a file that it rests on has changed; a file of checks that is damaged is none."""
    path = tmp_path / 'checks.json'
    monkeypatch.setattr(kept_checks, '_path', lambda: path)
    passed, warned = (
        Finding(name, {'x': 1.0}, '', verdict, 'text', 'page 3')
        for name, verdict in (('mass', Verdict.PASS), ('carrier', Verdict.WARN))
    )
    settings = Settings()
    kept_checks.keep(CASE_II, settings, Report((passed, warned)))
    (found,) = kept_checks.kept(CASE_II, settings).findings
    assert (found.name, found.verdict, found.text) == ('carrier', Verdict.WARN, 'text')
    assert kept_checks.kept(CASE_I, settings) is None
    monkeypatch.setattr(kept_checks, '_source', lambda: 'changed')
    assert kept_checks.kept(CASE_II, settings) is None
    monkeypatch.undo()
    monkeypatch.setattr(kept_checks, '_path', lambda: path)
    path.write_text('{')
    assert kept_checks.kept(CASE_II, settings) is None
