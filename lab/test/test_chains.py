# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""From a film to what slows a chain: of a chain that is known, and of measured shells.

The known one: tilted phi-4 elements, 30 g, wells 40 mm apart, springs of 200 N/m.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from mlmem import law_file
from mlmem.physics.curve import Curve
from mlmem_lab.chains import tracked
from mlmem_lab.chains.tracked import Chain, Film, fit_chain, load_coupling, load_film
from mlmem_tools.cli.main import main
from mlmem_tools.law.curves import CurveError, average_runs, load_run

EXAMPLES = Path(__file__).parents[2] / 'examples'
H, W = 0.01, 0.02
LAW = Curve.of(lambda D: 4.0 * H / W * (D / W) * ((D / W) ** 2 - 1.0) - 0.15, -0.05, 0.05, 101)
KNOWN = Chain(LAW, 200.0, 0.06, 0.03, 14)
DAMPING, FRICTION, HAND = 12.0, 0.02, 0.03


@pytest.fixture(scope='module')
def film():
    """Elements 6 to 8, looked at every millisecond."""
    wave = KNOWN.wave(DAMPING, FRICTION, HAND, 10)
    t, sites = np.arange(0.0, wave.t[-1], 1e-3), (6, 7, 8)
    return Film(t + 0.5, np.array([np.interp(t, wave.t, wave.u[:, s - 1]) for s in sites]), sites)


def test_what_slows_a_known_chain_is_found(film):
    """A film without noise tells all three; with an error of 5 % damping is known to 4 1/s."""
    found = fit_chain(KNOWN, film)
    assert found.misfit < 0.01
    assert found.damping == pytest.approx(DAMPING, rel=0.01)
    assert found.friction == pytest.approx(FRICTION, rel=0.03)
    assert found.begin == pytest.approx(0.5, abs=0.01)
    there = KNOWN.wave(DAMPING, FRICTION, HAND, KNOWN.elements).arrivals()
    assert np.diff(found.wave.arrivals()) == pytest.approx(np.diff(there), rel=1e-3, nan_ok=True)


def test_friction_beyond_what_a_passage_sets_free_stops_a_wave():
    """0.15 N over the way is set free."""
    passes = [KNOWN.wave(0.0, friction, HAND, 13).arrivals() for friction in (0.1, 0.4)]
    assert np.isfinite(passes[0][12])
    assert np.isnan(passes[1][12])


def test_the_examples_magnets_are_those_of_their_file():
    """At 22 to 80 mm; the far ones are given to three digits."""
    magnets = load_coupling(EXAMPLES / 'chain/magnets.csv')
    assert magnets.error < 0.02
    force = [magnets.A * (r + magnets.b) ** -magnets.p for r in (0.03, 0.06, 0.07, 0.08)]
    assert force == pytest.approx([4.9, 0.42, 0.232, 0.134], rel=0.03)


@pytest.mark.parametrize(
    ('text', 'message'),
    [
        ('', 'must begin with a header, t_ms,u8_mm,u9_mm'),
        ('t_ms,x\n', r'line 1: the header must name tracked elements as u8_mm'),
        ('t,u8_mm\n', 'line 1: the header must name one of t_ms, t_s'),
        ('t_ms,u8_mm\n0,1\n1\n', 'line 3: it must have 2 values; got 1'),
        ('t_ms,u8_mm\n0,nan\n', 'line 2: u8_mm must be a finite number'),
        ('t_ms,u8_mm\n0,1\n', 'at least 16 rows; got 1'),
        ('t_ms,u8_mm\n' + '1,0\n' * 16, 'line 3: times must rise'),
    ],
)
def test_files_that_are_no_films(tmp_path, text, message):
    (tmp_path / 'bad.csv').write_text(text)
    with pytest.raises(CurveError, match=message):
        load_film(tmp_path / 'bad.csv')


def test_files_that_are_no_couplings(tmp_path):
    (tmp_path / 'bad.csv').write_text('distance_mm,force_N\n' + '10,1\n' * 15 + '0,1\n')
    with pytest.raises(CurveError, match='line 17: distance and force must be above 0'):
        load_coupling(tmp_path / 'bad.csv')


def test_films_of_another_chain(film):
    with pytest.raises(CurveError, match='tracked elements must be from 2 to 14'):
        fit_chain(KNOWN, Film(film.t, film.u, (6, 7, 15)))
    with pytest.raises(CurveError, match='element 6 must pass half the way'):
        fit_chain(KNOWN, Film(film.t, 0.1 * film.u, film.sites))


def test_the_command(tmp_path, capsys, sketched, monkeypatch):
    """Measured shells at 7 cm: the arrival of an element that was left out, and a report."""
    monkeypatch.setattr(tracked, 'STEP', 0.04)  # twice as long
    law = tmp_path / 'law.yaml'
    found = average_runs([load_run(EXAMPLES / f'law/shell_run{k}.csv') for k in (1, 2)], 64)
    law_file.write_law_file(law, found.curve)
    films, magnets = str(EXAMPLES / 'chain/film.csv'), str(EXAMPLES / 'chain/magnets.csv')
    given = ['chain', str(law), '--track', films, '--spacing', '0.07', '--mass', '0.021']
    output = ['--predict', '0.06', '--output', str(tmp_path / 'report'), '--json']
    assert main([*given, '--coupling', magnets, *output]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told['speed'] == pytest.approx(1.9, rel=0.25)  # measured over four elements
    assert told['unseen']['predicted'] == pytest.approx(told['unseen']['measured'], rel=0.25)
    assert told['predictions'][0]['speed'] > told['speed']
    assert (tmp_path / 'report/chain.md').read_text().count('- ') >= 5
    assert (tmp_path / 'report/chain.png').stat().st_size > 10_000
    assert main(given) == 2
    assert 'give one of --coupling and --spring' in capsys.readouterr().err
    assert main([*given, '--spring', '-1']) == 2
    assert 'must be above 0' in capsys.readouterr().err
    assert main([*given, '--coupling', films]) == 2
    assert 'the header must name one of distance_um' in capsys.readouterr().err
    assert main([*given, '--coupling', magnets, '--elements', '9']) == 1
    assert 'tracked elements must be from 2 to 9' in capsys.readouterr().err
