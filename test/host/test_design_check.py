# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A design is checked before it is built, once in a process."""

from mlmem import End, Settings
from mlmem.physics import CASE_I, CASE_II
from mlmem_ros.host import design_check
from mlmem_ros.host.design_check import check_design
from mlmem_tools import checks
from mlmem_tools.checks import Finding, Report, Verdict


def test_findings_are_kept_for_the_next_process(monkeypatch, tmp_path):
    """Until a file that it depends on has changed; a damaged file of checks is ignored."""
    checked = []

    def check(design, settings):
        checked.append(design)
        found = (
            Finding('mass', {'m': 1.0}, '', Verdict.PASS, 'text'),
            Finding('carrier', {}, '', Verdict.WARN, 'text'),
            Finding('read_disturb', {'left': 0.25}, '', Verdict.PASS, 'text'),
        )
        return Report(found)

    def asked_anew(design):
        design_check.load_findings.cache_clear()
        before = len(checked)
        warned, disturb = design_check.load_findings(design, Settings())
        assert tuple(warned) == ('carrier', 'warn', 'text', {})
        assert tuple(disturb) == ('read_disturb', 'pass', 'text', {'left': 0.25})
        return len(checked) > before

    monkeypatch.setattr(checks, 'check', check)
    monkeypatch.setattr(design_check, 'find_cache_folder', lambda: tmp_path)
    assert [asked_anew(design) for design in (CASE_II, CASE_II, CASE_I)] == [True, False, True]
    with monkeypatch.context() as changed:
        changed.setattr(design_check, '_hash_source', lambda: 'changed')
        assert asked_anew(CASE_II)
    assert not asked_anew(CASE_II)
    for damaged in ('{', '[1]'):
        for path in tmp_path.iterdir():
            path.write_text(damaged)
        assert asked_anew(CASE_II)
    design_check.load_findings.cache_clear()


def test_check_gives_the_loudest_safe_pulses(throttled, monkeypatch):
    found = [('mass', 'pass', 'text', {'m': 1.0}), ('read_disturb', 'pass', 'text', {'left': 0.2})]
    monkeypatch.setattr(design_check, 'load_findings', lambda *_: found)
    assert check_design(CASE_II, Settings(), 'refuse', throttled) == {End.LEFT: 0.2}
    assert check_design(CASE_II, Settings(), 'skip', throttled) == {}
