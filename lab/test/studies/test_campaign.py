# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Campaigns: the same table wherever points are evaluated, and after any kill."""

import csv
import os
import subprocess
import sys
import time
from collections import Counter
from pathlib import Path

import pytest
from small_campaigns import dies, fails_at_three, logged, noisy_square, squares

from mlmem_lab.studies.campaign import (
    Campaign,
    CampaignError,
    Ledger,
    provide_workers,
    run,
    save_table,
)


def table(campaign, path, executor=None):
    with Ledger(path, campaign) as ledger:
        for _ in run(campaign, ledger, executor):
            pass
        return ledger.table()


def ended(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return True
    # Without an init it stays as a zombie.
    return Path(f'/proc/{pid}/stat').read_text().rsplit(')', 1)[1].split()[0] == 'Z'


def wait_until(condition, seconds=30.0):
    last = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < last
        time.sleep(0.02)


# --- where points are evaluated --------------------------------------------------------------


def test_every_point_is_evaluated_with_a_seed_of_its_own(tmp_path):
    rows = table(squares(), tmp_path / 'ledger.jsonl')
    assert [row['point'] for row in rows] == list(range(12))
    assert [row['square'] for row in rows] == [2 * x * x for x in range(12)]
    assert len({row['seed'] for row in rows}) == 12


def test_processes_give_the_table_that_one_gives(tmp_path):
    here = table(squares(), tmp_path / 'here.jsonl')
    with provide_workers(2) as executor:
        assert table(squares(), tmp_path / 'there.jsonl', executor) == here


def test_a_dask_cluster_gives_the_table_that_one_process_gives(tmp_path, monkeypatch):
    distributed = pytest.importorskip('distributed')
    here = table(squares(), tmp_path / 'here.jsonl')
    options = {'processes': False, 'protocol': 'tcp://', 'dashboard_address': None}
    with distributed.LocalCluster(1, threads_per_worker=1, **options) as cluster:
        address = cluster.scheduler_address
        with provide_workers(1, address) as executor:
            assert table(squares(), tmp_path / 'there.jsonl', executor) == here

        monkeypatch.setattr('mlmem_lab.studies.campaign.execution.__version__', '9.9.9')
        refused = pytest.raises(
            CampaignError, match=r'must have mlmem_lab and mlmem_ros 9\.9\.9; got'
        )
        with refused, provide_workers(1, address):
            pass


def test_a_missing_cluster_is_reported(monkeypatch):
    pytest.importorskip('distributed')
    monkeypatch.setattr('mlmem_lab.studies.campaign.execution.SCHEDULER_TIMEOUT', '0.1s')
    with (
        pytest.raises(CampaignError, match=r'no Dask scheduler answers at .tcp://127\.0\.0\.1:9'),
        provide_workers(1, 'tcp://127.0.0.1:9'),
    ):
        pass


def test_a_single_point_alone_gives_its_row(tmp_path):
    rows = table(squares(), tmp_path / 'ledger.jsonl')
    assert squares().evaluate_point(7) == rows[7]
    with pytest.raises(CampaignError, match='from 0 to 11; got 12'):
        squares().evaluate_point(12)


def test_a_point_that_fails_is_named_and_the_others_are_kept(tmp_path):
    campaign = Campaign('failing', fails_at_three, {}, [{'x': x} for x in range(5)])
    with (
        Ledger(tmp_path / 'ledger.jsonl', campaign) as ledger,
        pytest.raises(CampaignError, match=r"point 3 of failing, \{'x': 3\}.*three is too much"),
    ):
        list(run(campaign, ledger, None))
    with Ledger(tmp_path / 'ledger.jsonl', campaign) as again:
        assert again.rows == ledger.rows


def test_a_dead_worker_is_reported(tmp_path):
    campaign = Campaign('deadly', dies, {}, [{'x': 0}])
    with (
        provide_workers(2) as executor,
        pytest.raises(CampaignError, match='a worker process died'),
    ):
        table(campaign, tmp_path / 'ledger.jsonl', executor)


# --- the ledger ------------------------------------------------------------------------------


def test_a_killed_campaign_continues_and_computes_nothing_twice(tmp_path):
    campaign, path = logged(tmp_path), tmp_path / 'ledger.jsonl'
    script = Path(__file__).with_name('small_campaigns.py')
    process = subprocess.Popen([sys.executable, script, tmp_path])
    wait_until(lambda: path.exists() and path.read_bytes().count(b'\n') > 8)
    process.kill()
    process.wait()

    log = tmp_path / 'computed.txt'
    pids = {int(line.split()[1]) for line in log.read_text().splitlines()}
    wait_until(lambda: all(ended(pid) for pid in pids))  # the workers end with their parent

    (tmp_path / 'hurry').touch()
    with Ledger(path, campaign) as ledger:
        kept = set(ledger.rows)
        assert 8 <= len(kept) < 60
        for _ in run(campaign, ledger, None):
            pass
        assert [row['y'] for row in ledger.table()] == list(range(60))
    times = Counter(int(line.split()[0]) for line in log.read_text().splitlines())
    assert all(times[point] == 1 for point in kept)
    # Points that the two workers were evaluating, or that the parent had not stored, are lost.
    assert sum(times.values()) <= 60 + 4


def test_a_torn_last_line_is_evaluated_again(tmp_path):
    path = tmp_path / 'ledger.jsonl'
    rows = table(squares(), path)
    path.write_bytes(path.read_bytes()[:-9])
    with Ledger(path, squares()) as ledger:
        assert len(ledger.rows) == 11
        assert len(list(run(squares(), ledger, None))) == 1
        assert ledger.table() == rows


def test_points_may_be_added_later(tmp_path):
    path = tmp_path / 'ledger.jsonl'
    table(squares(12), path)
    with Ledger(path, squares(15)) as ledger:
        assert {row['point'] for row in run(squares(15), ledger, None)} == {12, 13, 14}


@pytest.mark.parametrize(
    ('other', 'message'),
    [
        (squares(factor=3), 'a study with another common'),
        (squares(seed=6), 'a study with another seed'),
        (squares(n=5), 'a study with another set of points'),
        (Campaign('squares', noisy_square, {'factor': 2}, [{'x': -1.0}] * 12, 5), 'another set'),
    ],
)
def test_the_ledger_of_another_study_is_refused_and_left_alone(other, message, tmp_path):
    path = tmp_path / 'ledger.jsonl'
    table(squares(), path)
    before = path.read_bytes()
    with pytest.raises(CampaignError, match=message):
        Ledger(path, other)
    assert path.read_bytes() == before


@pytest.mark.parametrize('content', [b'to do: milk', b'a,b\n1,2\n', b'{"x": 1}\n'])
def test_a_file_that_is_no_ledger_is_refused_and_left_alone(content, tmp_path):
    path = tmp_path / 'ledger.jsonl'
    path.write_bytes(content)
    with pytest.raises(CampaignError, match='not the ledger of a campaign'):
        Ledger(path, squares())
    assert path.read_bytes() == content


def test_two_processes_do_not_share_a_ledger(tmp_path):
    path = tmp_path / 'ledger.jsonl'
    with (
        Ledger(path, squares()),
        pytest.raises(CampaignError, match='in use by another process'),
    ):
        Ledger(path, squares())


# --- the table -------------------------------------------------------------------------------


def test_csv_reads_back(tmp_path):
    rows = table(squares(), tmp_path / 'ledger.jsonl')
    path = save_table(rows, tmp_path / 'points.csv')
    with path.open(newline='', encoding='utf-8') as stream:
        back = [{name: int(text) for name, text in row.items()} for row in csv.DictReader(stream)]
    assert back == rows
