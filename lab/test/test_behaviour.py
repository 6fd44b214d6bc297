# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The device does what it did when the results were measured, to the bit."""

from dataclasses import replace

import pytest

from mlmem import MemoryElement, Read, Write, load_element
from mlmem_lab.behaviour import behaviour_study, measure_case, run_trial
from mlmem_lab.bench.measure import describe_processor
from mlmem_lab.results import load_result


@pytest.mark.parametrize('case', ['robust_words', 'case_2, simulated'])
def test_device_does_what_the_results_were_measured_with(case):
    result = load_result(behaviour_study.path)
    if result['processor'] != describe_processor():
        pytest.skip(f'the hashes are of another processor: {result["processor"]}')
    known, found = result['cases'][case], measure_case(case)
    assert found == known, (
        f'{[what for what in known if found.get(what) != known[what]]} do something else: if this '
        'is meant, run "mlmem study behaviour", and all studies that are stale then'
    )


def test_trial_hash_tells_a_change_that_no_reading_shows():
    shipped = load_element('kick_2')
    slower = replace(shipped.design, eta=shipped.design.eta * (1.0 + 1e-12))
    commands = Write(1), Read()
    same, other = (MemoryElement(design, shipped.settings) for design in (shipped.design, slower))
    expected = run_trial(MemoryElement(shipped), *commands)
    assert run_trial(same, *commands) == expected != run_trial(other, *commands)
    assert run_trial(MemoryElement(shipped), Read(), *commands) != expected
