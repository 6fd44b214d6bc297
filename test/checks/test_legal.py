# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Every legal design is judged, or refused in one clear sentence, without other errors."""

import dataclasses
import math
import random
import re
import warnings

import legal
import pytest

from mlmem import Settings, SettingsError, load_element
from mlmem.instrument.motion import Cycle
from mlmem.physics import CASE_II
from mlmem.settings import ActuatorSettings
from mlmem_tools import checks
from mlmem_tools.checks import Verdict, check

QUICK = (checks.material, checks.echoes)

NONE = re.compile(r'launch_\w+|pin_depth|peierls_nabarro|rigidity|echo_(left|right)')
"""Findings that may lack a number: no strain frees a wall, no wall is left, no echo is heard."""


def judge(design, settings):
    """Check a design; return the verdict, or None if it is refused."""
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        try:
            report = check(design, settings)
        except SettingsError as error:
            refusal = str(error)
        else:
            refusal = ''
    if refusal:
        assert re.search('(time.tick|omega_c) must be at (most|least)', refusal)
        return None
    names = [finding.name for finding in report.findings]
    assert len(names) == len(set(names))
    for finding in report.findings:
        assert finding.text
        numberless = [name for name, value in finding.values.items() if math.isnan(value)]
        assert not numberless or NONE.fullmatch(finding.name), finding
        assert not numberless or finding.verdict is not Verdict.PASS or 'back' in str(numberless)
    return report.verdict


def judge_seed(seed, *, drawn):
    chance = random.Random(seed)
    return judge(legal.design(chance), legal.settings(chance) if drawn else Settings())


def test_legal_designs_are_judged():
    verdicts = {judge_seed(seed, drawn=seed % 2) for seed in (2, 4, 5, 10, 12)}
    assert verdicts == {Verdict.FAIL, None}


def test_legal_designs_are_judged_by_closed_forms(monkeypatch):
    """Without the simulations and landscapes, which take ten times as long."""
    monkeypatch.setattr(checks, 'CHECK_MODULES', QUICK)
    verdicts = {judge_seed(seed, drawn=False) for seed in (*range(103, 111), 116, 117, 120)}
    assert verdicts == {*Verdict, None}


@pytest.mark.parametrize(
    'changes', [{'eta': 0.0}, {'beta': 0.0, 'gamma': 0.0}, {'eta': 0.0, 'beta': 0.0, 'gamma': 0.0}]
)
def test_no_damping_and_no_defects_are_judged(changes, monkeypatch):
    """Without the checks that take nine tenths of the time: they have tests of their own."""
    dear = (checks.disturb, checks.transducer)
    quick = [each for each in checks.CHECK_MODULES if each not in dear]
    monkeypatch.setattr(checks, 'CHECK_MODULES', quick)
    design, settings = load_element('bits_1').design_and_settings
    assert judge(dataclasses.replace(design, **changes), settings) is Verdict.FAIL


def test_runs_that_would_take_too_long_are_skipped(monkeypatch):
    """The slowest legal actuator takes a thousand million time units for a ramp."""
    monkeypatch.setattr(checks, 'CHECK_MODULES', (checks.launch, checks.steps))
    settings = Settings(actuator=ActuatorSettings(max_rate=1e-9))
    assert Cycle.plan_cycle(settings.write, 0.048, 1e-9).duration > 1e8
    report = check(CASE_II, settings)
    for name in ('launch_write', 'launch_erase', 'write_steps'):
        assert report[name].verdict is Verdict.WARN
        assert 'too long' in report[name].text
