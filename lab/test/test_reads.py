# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Reads in a row, counted: the wall tells what is true, whatever the device says."""

import functools
import json
from collections import Counter

import pytest

from mlmem.readers.reading import UNDECODABLE
from mlmem_lab.designer import proposal
from mlmem_lab.reads import command, count
from mlmem_lab.reads.count import (
    DESIGN_PREFIX,
    READS_PER_MOVE,
    Counts,
    bad_cells,
    count_rows,
    find_preset,
    list_designs,
    sum_counts,
    true_level,
)
from mlmem_lab.results import STRAINED_PRESETS, find_stale_entries, hash_modules
from mlmem_tools.checks import Report
from mlmem_tools.cli.main import main


def mlmem_reads(*arguments):
    return main(['reads', *map(str, arguments), '--specimens', '0', '--workers', '1'])


@pytest.fixture
def lies(monkeypatch):
    """Walls are one level beside the place that the device is right about."""
    monkeypatch.setattr(count, 'true_level', lambda element: 1 - true_level(element))


@pytest.fixture
def quick(monkeypatch):
    """Rows that are right and take no time."""

    @functools.wraps(count_rows)
    def right(name, count, seed, finer=1, specimen=None):
        reads = count * READS_PER_MOVE
        return Counts(Counter(right=reads), count, ticks=[1] * reads)

    monkeypatch.setattr(command, 'count_rows', right)


@pytest.mark.parametrize('finer', [1, 2])
def test_every_read_is_counted_after_every_kind_of_move(finer):
    counts = count_rows('bits_1', 4, seed=1, finer=finer)
    assert counts.blocks == 4
    assert counts.reads == counts.found['right'] == 4 * READS_PER_MOVE
    assert counts.found['written'] == 2  # the write, and that after the erase
    assert len(counts.ticks) == counts.reads
    assert not counts.reasons


def test_a_device_that_lies_is_caught(lies):
    counts = count_rows('bits_1', 4, seed=1)
    assert counts.found['wrong'] == 4 * READS_PER_MOVE
    assert counts.wrong_blocks == counts.blocks == 4
    assert counts.found['written wrong'] == 2
    assert any(reason.startswith('WRONG: ') for reason in counts.reasons)
    assert counts.as_dict()['wrong rows, at most (95 %)'] == 1.0


def test_a_stuck_cell_before_the_wall_is_no_wall():
    """It echoes as a wall does, from one end; from both it is refused."""
    counts = bad_cells('bits_1', 'stuck', 30, write=True)
    assert counts.blocks == counts.reads == 3  # blank and two levels
    assert counts.found['wrong'] == counts.found['written wrong'] == 0
    assert counts.found['undecodable'] > 0


def test_a_strong_cell_close_before_a_far_wall_is_no_level(monkeypatch):
    """Both ends hear it towards level 24 of 48: the far one by less than half a spacing."""
    monkeypatch.setattr(proposal, 'check', lambda *_: Report(()))  # in test_designer.py
    site = find_preset('levels_48')[0].defect_site(23) + 6
    counts = bad_cells('levels_48', 'alpha 3', site, reach=6.5)
    assert (counts.reads, counts.found['undecodable']) == (2, 2)  # levels 23 and 24


def test_undecodable_is_right_where_there_is_no_level(monkeypatch):
    monkeypatch.setattr(count, 'true_level', lambda element: UNDECODABLE)
    counts = bad_cells('bits_1', 'stuck', 30)
    assert counts.found['undecodable'] == 0
    assert counts.found['no level'] > 0
    assert counts.reads == sum(counts.found[name] for name in count.READ_OUTCOMES) == 3


def test_presets_written_by_strain_and_designs_are_counted_by_default():
    assert list_designs(5, 6) == [*STRAINED_PRESETS, f'{DESIGN_PREFIX}5', f'{DESIGN_PREFIX}6']


def test_the_command_keeps_what_the_file_has_of_other_elements(tmp_path, capsys, quick):
    """Among it their hashes: what is stale stays so."""
    path = tmp_path / 'reads.json'
    assert mlmem_reads('bits_1', '--rows', 1, '--output', path) == 0
    first = json.loads(path.read_text())
    assert first['elements']['all']['reads'] == 3 * READS_PER_MOVE  # at three steps
    first['hashes'] = {'bits_1': 'old'}
    path.write_text(json.dumps(first))
    assert mlmem_reads('levels_2', '--rows', 2, '--output', path, '--json') == 0
    both = json.loads(path.read_text())
    assert list(both['elements']) == ['bits_1', 'levels_2', 'all']
    assert both['elements']['all']['reads'] == (3 + 4) * READS_PER_MOVE
    current = hash_modules(both['modules'])
    assert both['hashes'] == {'bits_1': 'old', 'levels_2': current}
    assert both['command'].count('mlmem reads') == 2
    assert mlmem_reads('bits_1', '--rows', 1, '--output', path) == 0
    assert find_stale_entries(json.loads(path.read_text())) == []
    assert 'undecodable' in capsys.readouterr().out


def test_a_wrong_read_is_the_exit_status(monkeypatch, quick):
    found = {'bits_1': {'wrong': 1, 'rows': 4, 'wrong rows': 1, 'reasons': {}}}
    monkeypatch.setattr(command, 'sum_counts', lambda counted: sum_counts(found))
    assert mlmem_reads('bits_1', '--rows', 1) == 1


@pytest.mark.parametrize(
    ('wrong', 'said'),
    [
        (['--rows', '0'], '--rows, --every and --workers must be at least 1'),
        (['bits_7'], 'elements are case_1, '),
        (['levels_x'], 'and levels_2 to levels_256; got levels_x'),
        (['levels_1'], 'and levels_2 to levels_256; got levels_1'),
        (['--designs', '1', '4'], 'got levels_1'),
    ],
)
def test_misuse_is_named(wrong, said, capsys):
    assert mlmem_reads(*wrong) == 2
    assert said in capsys.readouterr().err


def test_a_result_that_cannot_be_written_is_an_error_and_not_lost(tmp_path, capsys, quick):
    path = tmp_path / 'reads.json'
    path.write_text('{"elements": ')
    assert mlmem_reads('bits_1', '--rows', 1, '--output', path) == 1
    printed = capsys.readouterr()
    assert 'the result could not be written' in printed.err
    assert 'bits_1' in printed.out
    assert path.read_text() == '{"elements": '
