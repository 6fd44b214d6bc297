# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The benchmarks compare what is equal. No time is asserted here."""

import json
import shutil
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem_lab import bench
from mlmem_lab.bench import BENCHMARK_NAMES, import_benchmark, recorder, select_benchmarks
from mlmem_lab.bench.kernel import TIME_STEP, Problem, c_runner, numpy_runner
from mlmem_lab.bench.measure import Comparison, Entry, Spread
from mlmem_lab.bench.node_process import NodeProcess
from mlmem_lab.bench.recorder import build_traffic
from mlmem_ros.bag.reader import BagReader
from mlmem_tools.cli.main import main


@pytest.fixture(scope='module')
def problem():
    return Problem.with_cells(225)


@pytest.mark.parametrize('make', [numpy_runner, c_runner])
def test_every_kernel_makes_the_same_steps(problem, make):
    if make is c_runner and shutil.which('gcc') is None:
        pytest.skip('gcc is missing')
    chain, other = problem.chain(dt=TIME_STEP), make(problem)
    chain.rest(200)
    other.advance(200)
    np.testing.assert_allclose(other.displacements(), chain.v, rtol=0, atol=1e-12)


@pytest.mark.parametrize('name', recorder.WRITERS_BY_NAME)
def test_every_writer_records_all_messages(tmp_path, name):
    messages = build_traffic(1.0)
    with recorder.WRITERS_BY_NAME[name](tmp_path / 'bag') as put:
        for message in messages:
            put(message)
    reader = BagReader(next((tmp_path / 'bag').glob('*.mcap')))
    counts = {topic: info.message_count for topic, info in reader.topics.items()}
    assert sum(counts.values()) == len(messages) == 303
    assert counts['/mlmem/field'] == 100


def test_a_ratio_is_taken_round_by_round():
    slow, fast = Entry('slow', (2.0, 20.0, 4.0)), Entry('fast', (1.0, 10.0, 2.0))
    assert slow.over(fast) == Spread(2.0, 2.0, 2.0)


def test_a_comparison_is_kept_whole(tmp_path, monkeypatch):
    entries = [Entry('a', (1.0, 2.0, 3.0)), Entry('b', (2.0, 4.0, 6.0))]
    for measured in (True, False):
        made = Comparison('c', 'C', 's', 't', entries, {'d': 'no'}, measured)
        assert made.table().row_count == 2
        ours = SimpleNamespace(TITLE='C', run=lambda repeats, made=made: [made])
        monkeypatch.setattr(bench, 'import_benchmark', lambda name, ours=ours: ours)
        assert main(['bench', 'kernel', '--output', str(tmp_path)]) == 0
        kept = json.loads((tmp_path / 'c.json').read_text(encoding='utf-8'))
        assert kept['entries'][1]['samples'] == [2.0, 4.0, 6.0]
        assert kept['skipped'] == {'d': 'no'}
        assert kept['host']['versions']['numpy'] == np.__version__
        assert not measured or kept['ratios'][1]['median'] == 2.0


def test_benchmarks_are_found_by_name(capsys):
    assert select_benchmarks([]) == list(BENCHMARK_NAMES)
    assert select_benchmarks(['recorder', 'kernel']) == ['kernel', 'recorder']
    with pytest.raises(KeyError, match=r"benchmark must be one of .*; got 'x'"):
        select_benchmarks(['x'])
    for name in BENCHMARK_NAMES:
        module = import_benchmark(name)
        assert module.TITLE
        assert callable(module.run)
    assert main(['bench', '--list', 'recorder', 'kernel']) == 0
    listed = ' '.join(capsys.readouterr().out.split())  # rich folds long lines
    assert (
        f'kernel {import_benchmark("kernel").TITLE} recorder {import_benchmark("recorder").TITLE}'
        == listed
    )
    assert main(['bench', 'x']) == 2


@pytest.mark.slow
def test_a_node_watches_itself():
    """A tick is 2 ms: as many as fit were run or skipped, give or take a rest of 20."""
    pytest.importorskip('rclpy')
    with NodeProcess() as process:
        seen = process.watch(3.0)
    assert seen['ticks'] + seen['overruns'] == pytest.approx(3.0 / 0.002, abs=40)
    assert seen['p50'] <= seen['p99'] <= seen['worst']
    assert 0.0 < seen['share'] < 100.0
