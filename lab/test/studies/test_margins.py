# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Climbs, the heat around them, and the maps made of them."""

import dataclasses
import itertools
import json
import math
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from mlmem import Outcome, Settings, SettingsError
from mlmem.physics import CASE_II
from mlmem.presets import load_preset
from mlmem.settings import TimeSettings
from mlmem_lab.studies import style
from mlmem_lab.studies.bench import Bench
from mlmem_lab.studies.campaign import Ledger, run
from mlmem_lab.studies.margins import (
    Shmoo,
    draw_map,
    make_axis,
    measure_margins,
    prepare_settings,
    rerun_point,
)
from mlmem_lab.studies.margins.command import _summarise_margins
from mlmem_lab.studies.margins.shmoo import NOISE_AXIS, RAMPS_AXIS, with_values
from mlmem_lab.studies.style import style_context
from mlmem_lab.studies.trace import (
    Heat,
    WrittenLevel,
    least_margins,
    write_upward,
)
from mlmem_tools.cli.main import main

SETTINGS = Settings(time=TimeSettings(tick=50.0))

RANGES = {'write.compression': (-0.05, -0.018), 'write.tension': (0.030, 0.066)}
"""Three values each: one too weak (compression works from -0.021, tension from 0.038), the
operating value, and one that is stronger and works.
"""


def small_map():
    x, y = (make_axis(name, SETTINGS, span) for name, span in RANGES.items())
    return Shmoo(CASE_II, SETTINGS, x, y, size=3)


@pytest.fixture(scope='module')
def rows(tmp_path_factory):
    study = small_map().campaign()
    with Ledger(tmp_path_factory.mktemp('map') / 'ledger.jsonl', study) as ledger:
        list(run(study, ledger, None))
        return ledger.table()


# --- one climb -------------------------------------------------------------------------------


def element(**write):
    settings = dataclasses.replace(
        SETTINGS, write=dataclasses.replace(SETTINGS.write, attempts=1, **write)
    )
    return Bench(CASE_II, settings).device()


def test_the_device_as_it_ships_writes_and_reads_every_level():
    climb = write_upward(element())
    assert climb.passed
    assert [each.outcome.reading.level for each in climb.writes] == list(range(8))
    for level, each in enumerate(climb.writes):
        assert each.wall == pytest.approx(CASE_II.defect_site(level), abs=0.1)
    assert min(least_margins(each.outcome for each in climb.writes).values()) > 0.2


def test_a_climb_ends_at_the_first_level_that_fails():
    """Tension below 0.036 does not free the wall, and the first that needs it is at level 1."""
    climb = write_upward(element(tension=0.03))
    assert not climb.passed
    assert climb.reached == 2
    assert climb.failure == 'wall'
    assert climb.writes[-1].level == 1


def test_a_right_wall_with_a_wrong_echo_is_a_failure_of_the_echo():
    """Delays that are all half a level later than what comes back."""
    device = element()
    table = device.calibration.left
    late = dataclasses.replace(table, delays=tuple(np.add(table.delays, 54.0)))
    device.calibration = dataclasses.replace(device.calibration, left=late)
    climb = write_upward(device)
    assert (climb.reached, climb.failure) == (0, 'echo')
    assert climb.writes[0].level == 0


@pytest.mark.parametrize(
    ('level', 'success', 'failure'),
    [(2, True, ''), (2, False, 'echo'), (1, False, 'wall'), (1, True, 'silent')],
)
def test_what_the_device_says_and_the_truth_make_four_cases(level, success, failure):
    outcome = Outcome('write', success, '', None, 1, 0, 100)
    assert WrittenLevel(asked=2, outcome=outcome, level=level, wall=75.0).failure == failure


# --- heat ------------------------------------------------------------------------------------


def test_heat_gives_every_mode_the_energy_of_its_temperature():
    """Fluctuation and dissipation: between kicks, t apart, the energy of small waves decays
    from E to E exp(-eta t), so that m <v^2> = T eta t / (exp(eta t) - 1) just before a kick.
    """
    temperature, eta = 1e-8, CASE_II.eta
    device = element()
    heat = Heat(device, temperature, seed=1)
    # The standing waves of free ends. Those above m = 60, faster than omega = 0.9, are colder by
    # the dissipation of the integrator itself.
    m, j = np.arange(1, 61)[:, None], np.arange(CASE_II.N)
    modes = np.sqrt(2.0 / CASE_II.N) * np.cos(np.pi * m * (j + 0.5) / CASE_II.N)
    energies = []
    for tick in range(300):
        device.advance()
        if tick * device.tick > 8.0 / eta:  # from rest to within exp(-8) of the steady state
            energies.append((modes @ device.chain.velocity) ** 2)
        heat.kick()
    expected = temperature * eta * device.tick / math.expm1(eta * device.tick)
    # 260 samples, new ones every 5, of 60 modes: a standard error of 2.5 %.
    assert np.mean(energies) == pytest.approx(expected, rel=0.08)


def test_heat_is_the_same_for_the_same_seed_and_another_for_another():
    def end(seed):
        device = element()
        heat = Heat(device, 1e-8, seed)
        for _ in range(5):
            device.advance()
            heat.kick()
        return device.chain.velocity.copy()

    assert np.array_equal(end(1), end(1))
    assert not np.array_equal(end(1), end(2))


def test_a_hot_element_does_not_come_to_rest():
    shared = small_map().campaign().common
    climb = rerun_point(shared, {NOISE_AXIS: 1e-5}, seed=3)
    assert not climb.passed
    assert 'does not come to rest' in climb.writes[-1].outcome.error


# --- axes ------------------------------------------------------------------------------------


def test_a_line_of_the_map_passes_through_the_operating_point():
    values = make_axis('write.hold', SETTINGS).values(7)
    assert len(values) == 7
    assert 600.0 in values
    assert (np.diff(values) > 0).all()


def test_noise_begins_at_none():
    values = make_axis(NOISE_AXIS, SETTINGS).values(5)
    assert values[0] == 0.0
    assert values[-1] / values[-2] == pytest.approx(values[-2] / values[-3], rel=1e-4)


def test_a_point_changes_what_it_names_and_nothing_else():
    settings, temperature = with_values(
        SETTINGS, {RAMPS_AXIS: 700.0, 'probe.v_th': 2e-4, NOISE_AXIS: 1e-9}
    )
    write = dataclasses.replace(SETTINGS.write, ramp=700.0, release=700.0)
    probe = dataclasses.replace(SETTINGS.probe, v_th=2e-4)
    assert settings == dataclasses.replace(SETTINGS, write=write, probe=probe)
    assert temperature == 1e-9


@pytest.mark.parametrize(
    ('name', 'span', 'message'),
    [
        ('write.speed', None, "must be a numeric setting, such as .*; got 'write.speed'"),
        ('read.end', None, "must be a numeric setting, such as .*; got 'read.end'"),
        ('hold', None, "must be a numeric setting, such as .*; got 'hold'"),
        ('write.hold', (0.0, 500.0), 'with the operating value 600 between them'),
        ('write.hold', (math.nan, 700.0), 'must be two numbers'),
        ('probe.v_th', (0.0, 1.0), 'must be above 0; got 0'),
    ],
)
def test_an_axis_that_makes_no_sense_is_refused(name, span, message):
    with pytest.raises(ValueError, match=message):
        make_axis(name, SETTINGS, span)


def test_a_map_needs_two_axes_and_two_points_each():
    x = make_axis('write.hold', SETTINGS)
    with pytest.raises(ValueError, match=r'two different ones; got write\.hold twice'):
        Shmoo(CASE_II, SETTINGS, x, x)
    with pytest.raises(ValueError, match='size must be at least 2; got 1'):
        Shmoo(CASE_II, SETTINGS, x, make_axis(NOISE_AXIS, SETTINGS), size=1)


# --- maps ------------------------------------------------------------------------------------


def test_the_map_passes_where_the_wall_is_known_to_follow(rows):
    reached = small_map().build_grid(rows, 'reached')
    # Weak compression leaves the wall at level 0, weak tension at level 1.
    assert reached.tolist() == [[2, 2, 1], [8, 8, 1], [8, 8, 1]]
    assert set(small_map().build_grid(rows, 'failure')[reached < 8]) == {'wall'}


def test_a_point_alone_gives_the_row_of_the_map(rows):
    study = small_map().campaign()
    for point in (1, 4):
        assert study.evaluate_point(point) == rows[point]


def test_settings_without_an_echo_fail_the_point_and_raise_nothing():
    study = dataclasses.replace(small_map().campaign(), points=[{'probe.v_th': 1.0}])
    row = study.evaluate_point(0)
    assert (row['passed'], row['failure']) == (False, 'unfit')
    assert 'level 0 gives no echo' in row['error']
    with pytest.raises(SettingsError):
        rerun_point(study.common, study.points[0], 0)


def test_margins_of_the_map(rows):
    margins = measure_margins(small_map(), rows)
    assert margins.passed
    assert margins.share == pytest.approx(4 / 9)
    compression, tension = margins.reaches
    assert (compression.low, compression.high) == (-0.05, -0.034)
    assert (compression.low_open, compression.high_open) == (True, False)
    assert (tension.low, tension.high) == (0.048, 0.066)
    # Tension 0.030 is 37.5 % from 0.048; compression -0.018 is 47 % from -0.034.
    assert margins.distance == pytest.approx(0.375)
    assert margins.nearest['write.tension'] == 0.030


def invented(shmoo, passes):
    x, y = np.meshgrid(shmoo.x_values, shmoo.y_values)
    return [{'point': i, 'passed': bool(p)} for i, p in enumerate(passes(x, y).ravel())]


def test_the_distance_is_that_to_the_nearest_failure_in_relative_change():
    x, y = make_axis('write.hold', SETTINGS), make_axis('write.settle', SETTINGS)
    shmoo = Shmoo(CASE_II, SETTINGS, x, y, size=201)
    # A straight boundary x / x0 + y / y0 = 1.5 is (2 - 1.5) / sqrt(2) from (1, 1).
    rows = invented(shmoo, lambda x, y: x / 600.0 + y / 1500.0 > 1.5)
    margins = measure_margins(shmoo, rows)
    assert margins.distance == pytest.approx(0.5 / math.sqrt(2.0), rel=0.02)
    assert margins.reaches[0].low == pytest.approx(300.0, abs=6.1)
    assert margins.reaches[0].high_open


def test_an_operating_point_that_fails_has_no_reach():
    x, y = make_axis('write.hold', SETTINGS), make_axis('write.settle', SETTINGS)
    shmoo = Shmoo(CASE_II, SETTINGS, x, y, size=5)
    margins = measure_margins(shmoo, invented(shmoo, lambda x, y: x < 0.0))
    assert not margins.passed
    assert margins.reaches == ()
    assert margins.distance == 0.0


def test_a_map_without_a_failure_has_no_distance_and_noise_none_either():
    shmoo = Shmoo(
        CASE_II,
        SETTINGS,
        make_axis('write.hold', SETTINGS),
        make_axis(NOISE_AXIS, SETTINGS),
        size=5,
    )
    assert measure_margins(shmoo, invented(shmoo, lambda x, y: x == x)).distance is None
    hot = measure_margins(shmoo, invented(shmoo, lambda x, y: y < 1e-9))
    assert hot.distance is None  # no relative change of nothing
    assert hot.reaches[1].low_open
    assert hot.reaches[1].high < 1e-9


def test_the_title_says_the_nearest_failure_that_the_text_says():
    x, y = make_axis('write.hold', SETTINGS), make_axis('write.settle', SETTINGS)
    shmoo = Shmoo(CASE_II, SETTINGS, x, y, size=41)
    rows = invented(shmoo, lambda x, y: x / 600.0 + y / 1500.0 > 1.5)
    for row, (settle, hold) in zip(
        rows, itertools.product(shmoo.y_values, shmoo.x_values), strict=True
    ):
        row.update({x.name: hold, y.name: settle, 'reached': 8 * row['passed'], 'failure': 'wall'})
    margins = measure_margins(shmoo, rows)
    (text,) = [line for line in _summarise_margins(margins) if 'nearest' in line]
    with style_context():
        title = draw_map(shmoo, rows, margins).axes[0].get_title(loc='left')
    share, failure = title.splitlines()
    assert failure.startswith('nearest failure: write.hold')
    assert text.startswith(failure)
    assert share.split()[0] == _summarise_margins(margins)[0].split()[0]


def test_the_picture_is_the_same_for_the_same_table(rows, tmp_path, sketched):
    shmoo = small_map()
    margins = measure_margins(shmoo, rows)
    with style_context():
        files = [
            style.save_figure(draw_map(shmoo, rows, margins), tmp_path / name) for name in 'ab'
        ]
    one, two = (png.read_bytes() for png, _ in files)
    assert one == two


# --- the command -----------------------------------------------------------------------------


def command(*arguments):
    """Return `mlmem margins` over the small map."""
    words = ['margins', *arguments]
    for axis, span in zip('xy', RANGES.values(), strict=True):
        words += [f'--{axis}-range', *map(str, span)]
    return words


@pytest.mark.slow
def test_an_interrupted_map_continues(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    words = command('--size', '5', '--output', 'map', '--jobs', '2')
    process = subprocess.Popen(
        [sys.executable, '-m', 'mlmem_tools.cli.main', *words],
        text=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
    )
    ledger = tmp_path / 'map' / 'ledger.jsonl'
    while not (ledger.exists() and ledger.read_bytes().count(b'\n') > 2):
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    out, error = process.communicate(timeout=120)
    assert process.returncode == 130, error
    assert 'repeat the command to continue' in ' '.join(out.split())
    assert 'Traceback' not in error
    kept = ledger.read_bytes()

    assert main(command('--size', '5', '--output', 'map', '--jobs', '1')) == 0
    out = capsys.readouterr().out
    assert 'points were already done' in out
    assert 'nearest failure: write.compression -0.034, write.tension 0.03, 37.5% away' in out
    assert ledger.read_bytes().startswith(kept)
    files = sorted(file.name for file in (tmp_path / 'map').iterdir())
    assert files == ['ledger.jsonl', 'map.png', 'map.svg', 'margins.json', 'points.csv']
    assert json.loads((tmp_path / 'map' / 'margins.json').read_text())['passed']

    assert main(command('--size', '6', '--output', 'map')) == 1
    assert 'a study with another set of points' in capsys.readouterr().err


def test_a_point_is_run_alone_step_by_step(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(command('--size', '3', '--point', '0')) == 0
    out = capsys.readouterr().out
    assert 'point 0: write.compression -0.05, write.tension 0.03' in out
    assert 'fails at level 2' in out
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(('name', 'tick'), [('case_2', 50.0), ('bits_4', 20.0)])
def test_a_map_rounds_no_time_of_its_operating_point(name, tick):
    _, settings = load_preset(name)
    assert prepare_settings(settings).time.tick == tick
    assert prepare_settings(settings, 5.0).time.tick == 5.0


def test_a_map_of_steps_leaves_kicks_out():
    """With them the wall of Case II would come to every level, whatever the tension."""
    design, settings = load_preset('case_2')
    settings = dataclasses.replace(
        settings, write=dataclasses.replace(settings.write, method='kick')
    )
    axes = [make_axis(name, settings) for name in ('write.compression', 'write.tension')]
    shmoo = Shmoo(design, prepare_settings(settings), *axes, size=3)
    climbs = [shmoo.campaign().evaluate_point(point) for point in (1, 4, 5)]
    assert [climb['reached'] for climb in climbs] == [2, 8, 1]


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['--size', '1'], 'size must be at least 2; got 1'),
        (['--x', 'write.tension'], 'must be two numbers with the operating value 0.048'),
        (['--tick', 'nan'], 'tick must be a finite number'),
        (['--point', '4096'], 'from 0 to 4095; got 4096'),
        (['--jobs', '0', '--output', '.'], 'jobs must be at least 1; got 0'),
    ],
)
def test_a_wrong_argument_is_refused(arguments, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(['margins', '--x-range', '-0.05', '-0.018', *arguments]) in (1, 2)
    assert message in capsys.readouterr().err
    assert not list(tmp_path.glob('**/points.csv'))
