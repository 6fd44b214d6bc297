# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The committed maps of kicks are those of the code, and no counted write is wrong."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from mlmem import MemoryElement, Preset, factory_calibration, preset
from mlmem.instrument.blocks import run
from mlmem.instrument.drivers import Simulation
from mlmem.instrument.end import Pulse
from mlmem.moves.kick import kick_energy, kick_out
from mlmem.moves.move import MIN_MARGIN
from mlmem.physics import (
    CASE_II,
    PEFRL,
    Chain,
    HeldCell,
    Specimen,
    find_level,
    find_walls,
    substep_times,
    wall_energy,
)
from mlmem.physics.energy import energy
from mlmem.physics.equilibrium import find_pinned_wall, relax_to_equilibrium, wall_profile
from mlmem.physics.held_wall import make_uniform
from mlmem.physics.waves import group_velocity
from mlmem.readers.reading import BLANK
from mlmem.settings import ProbeSettings
from mlmem_lab.landscapes import KickedWall, lowest_modes, packet_energy, wave_momentum
from mlmem_lab.results import RESULT_FOLDER, load_result
from mlmem_lab.rk4 import Rk4Element
from mlmem_lab.windows import flight, maps
from mlmem_lab.windows.flight import (
    after_erase,
    after_kick,
    build_chain,
    kick_margins,
    search_kicks,
)
from mlmem_lab.windows.kicks import KICKED_PRESETS, count, kicks
from mlmem_lab.windows.words import RESULT_FILE, cases_ahead, kicked_behind

MAPPED = load_result(RESULT_FOLDER / 'kicks.json')['presets']


def chain_of(name):
    design, settings = preset(name)
    return build_chain(Specimen(design), settings)


@pytest.mark.parametrize('name', KICKED_PRESETS)
def test_the_committed_map_is_that_of_the_code(name):
    design, settings = preset(name)
    chain = chain_of(name)
    for k in range(20, 320, 60):
        found = after_kick(chain, MAPPED[name]['speeds'][k], settings.kick)
        assert found == MAPPED[name]['ends'][k]
    assert after_erase(chain, design.levels - 1, settings.kick) == BLANK


@pytest.mark.parametrize('name', KICKED_PRESETS)
def test_every_shipped_move_bears_a_tenth_in_every_quantity_but_the_stroke_of_a_kick(name):
    """What bears less is barred. Of the stroke, see the next test."""
    design, settings = preset(name)
    chain = chain_of(name)
    for level, speed in enumerate(settings.kick.wall_speeds):
        for factor in (1.1, 1.0 / 1.1):
            assert after_kick(chain, factor * speed, settings.kick) == level
        found = MAPPED[name]['levels'][level]
        assert found['room'] >= MIN_MARGIN
        assert settings.kick.room(level) <= found['room'] + 0.005  # as it says itself
        assert min(found['rooms'][each] for each in ('hold', 'late')) >= MIN_MARGIN
    for each in MAPPED[name]['erases']:
        assert min(each[quantity] for quantity in ('speed', 'hold', 'late')) >= MIN_MARGIN
    for off in (-0.1, 0.1):
        for level in (0, 1, design.levels - 1):
            assert after_erase(chain, level, settings.kick, 'speed', off) == BLANK


@pytest.mark.parametrize('off', [-0.2, 0.2])
def test_another_integrator_agrees_that_a_kick_erases(off):
    """The device over classical Runge-Kutta steps, with a kick a fifth too slow or too fast."""
    design, settings = preset('kick_4')
    speed = (1.0 + off) * settings.kick.erase_speed
    settings = replace(settings, kick=replace(settings.kick, erase_speed=speed))
    known = factory_calibration(design, settings)
    made, dt = Specimen(design), MemoryElement(design, settings, known).driver.dt
    for level in (0, 1, 15):
        body = Rk4Element(made, dt, step=0.125)
        body.v[:] = find_pinned_wall(made, level)
        element = MemoryElement(design, settings, known, body)
        element.transducer.assume_equilibrium()
        run(element, kick_out(element))
        assert find_level(design, body.v) == BLANK


def test_the_stroke_must_be_right_within_a_hundredth(monkeypatch):
    """A wall has the energy 0.49, and levels of case_2 differ by 0.003 to 0.1 in what a kick adds:
    one per cent of the stroke is as much.
    """
    settings = preset('case_2').settings
    monkeypatch.setattr(flight, 'KICK_QUANTITIES', ('gain', 'speed'))
    rooms = kick_margins(chain_of('case_2'), 3, settings.kick)
    assert 0.01 < rooms['gain'] < 0.03
    assert rooms['speed'] > 0.15


@pytest.mark.parametrize('name', KICKED_PRESETS)
def test_no_write_of_the_committed_count_was_wrong(name):
    written = MAPPED[name]['written']
    assert written['writes'] + written['erases'] >= 1000
    assert written['wrong'] == written['failed'] == 0
    assert written['strained'] <= 0.1 * written['writes']


def test_energy_alone_predicts_the_level_of_a_slow_kick():
    """A particle with the energy of a simulated kick, in the landscape of a held wall."""
    design, settings = preset('kick_2')
    wall, chain = KickedWall.of(Specimen(design)), chain_of('kick_2')
    for level, speed in enumerate(settings.kick.wall_speeds):
        assert wall.level(*maps.stored_energy(chain, speed, settings.kick)) == level
    assert wall.level(0.0, 10.0) == 0  # without momentum the next defect holds it
    assert wall.level(0.0, 4.0) == BLANK  # and the free end draws it
    assert wall.level(2.0, 10.0) == design.levels  # it runs out


def test_a_pinned_wall_has_one_mode_below_the_bands():
    design = preset('case_2').design
    lowest, next_one = lowest_modes(Specimen(design), 4, 2)
    assert lowest == pytest.approx(0.0789, rel=0.01)
    least = math.sqrt(design.k_s1 * design.alpha[-2])  # the softest cells are at the right
    assert next_one == pytest.approx(least, rel=0.01)


@pytest.mark.parametrize(('end', 'omega'), [('left', 1.2), ('left', 1.6), ('right', 1.2)])
def test_a_wave_that_passes_the_wall_pulls_it_to_the_left_from_either_end(end, omega):
    """By kappa / omega, the momentum of a unit of energy, which differs between the phases. The
    lattice holds the wall at whole cells: of 7 to 11 that it moves, half a cell is 7 %; what is
    reflected and the packet's width are the rest.
    """
    design = replace(make_uniform(CASE_II), N=240)
    chain = Chain(design, 0.25, PEFRL)
    profile = wall_profile(design, 120.5)
    chain.place(relax_to_equilibrium(Specimen(design), profile, np.zeros(design.N)))
    (before,) = find_walls(design, chain.configuration)
    pulse = ProbeSettings(A=0.1, omega_c=omega, sigma=20.0)
    site = 1 if end == 'left' else design.N
    motion = Pulse(chain.end(site), pulse)
    times = substep_times(math.ceil((motion.duration + 6000.0) / chain.dt), chain.dt, PEFRL)
    held = HeldCell(site, motion.at(times[times <= motion.duration]))
    chain.advance(np.zeros(len(times)), held)
    (after,) = find_walls(design, chain.configuration)
    stiffness = design.k_s2 if end == 'left' else design.k_s1
    way = 120.0 / float(group_velocity(omega, stiffness))
    arrived = packet_energy(pulse, stiffness) * math.exp(-design.eta * way)
    momentum = (after.position - before.position) * design.eta * wall_energy(design)
    assert momentum < 0.0
    assert momentum / arrived == pytest.approx(wave_momentum(Specimen(design), omega), rel=0.25)


def test_the_energies_of_a_move_are_those_of_the_chain():
    """Of a pulse what the end radiates, within the curvature of the band; of a slow kick what the
    wall needs, and waves that are a hundredth of that.
    """
    design, settings = preset('kick_2')
    chain = chain_of('kick_2')
    put_in, _ = maps.stored_energy(chain, settings.kick.wall_speeds[3], settings.kick)
    assert put_in == pytest.approx(kick_energy(design, 3), rel=0.03)
    still = replace(design, eta=1e-9)
    chain = Chain(still, 0.1, PEFRL)
    pulse = ProbeSettings(A=0.01, sigma=16.0, omega_c=1.0)
    motion = Pulse(chain.end(still.N), pulse)
    times = substep_times(math.ceil(motion.duration / chain.dt), chain.dt, PEFRL)
    before = energy(chain).total
    held = HeldCell(still.N, motion.at(times[times <= motion.duration]))
    chain.advance(np.zeros(len(times)), held)
    assert energy(chain).total - before == pytest.approx(
        packet_energy(pulse, still.k_s1), rel=0.05
    )


def test_a_search_finds_kicks_as_wide_as_those_that_ship():
    settings = preset('kick_2').settings
    found = search_kicks(chain_of('kick_2'), settings.kick, settings.transducer.max_speed)
    for level, each in enumerate(found):
        assert each.room >= settings.kick.room(level)
        assert after_kick(chain_of('kick_2'), each.speed, settings.kick) == level


def test_a_search_takes_no_wall_that_was_turned_back(monkeypatch):
    """Level 7 of Case II is reached by speeds of 0.21 to 0.32, and of 0.58 to 1.1 once more."""
    monkeypatch.setattr(flight, 'KICK_SPEEDS', flight.KICK_SPEEDS[::4])
    monkeypatch.setattr(flight, 'EDGE_TOLERANCE', 0.05)
    settings = preset('case_2').settings
    assert 0.2 < search_kicks(chain_of('case_2'), settings.kick)[7].speed < 0.35


def test_a_map_is_kept_as_text():
    def at(x, y):
        return int(x + y) if x < 2.0 else -2

    one = maps.Map('a', 'b', (0.0, 1.0, 2.0), (0.0, -1.0), at)
    told = one.as_dict()
    assert told['rows'] == ['01.', '-0.']
    assert maps.parse_levels(told['rows']).tolist() == [[0, 1, -2], [-1, 0, -2]]


def test_writes_are_counted_and_none_strains_the_element():
    found = count('kick_2', 12, seed=1)
    assert (found['writes'], found['erases']) == (11, 1)
    assert (found['wrong'], found['failed'], found['strained']) == (0, 0, 0)


def test_a_preset_without_kicks_is_refused(capsys, monkeypatch):
    design, settings = preset('case_1')
    unkicked = Preset(design, replace(settings, kick=replace(settings.kick, speeds='')))
    monkeypatch.setattr('mlmem_lab.windows.kicks.preset', lambda name: unkicked)
    assert kicks.run(SimpleNamespace(presets=['case_1'], figure=None)) == 2
    assert 'case_1 has no kicks' in capsys.readouterr().err


# --- the committed windows of a register's kicks ---------------------------------------------


@pytest.mark.parametrize('number', [2, 9, 12])
def test_a_kick_arrives_inside_its_window_and_not_beyond(number):
    """Beyond an edge, at the far side of its error, at least one case fails."""
    design, settings = preset('byte')
    row = load_result(RESULT_FILE)['presets']['byte']['kicks'][number]
    chain = Simulation.of(Specimen(design), settings.time).chain
    cases = cases_ahead(design.levels, 1, row['level'], row['kind'] == 'kink')
    for speed, inside in (
        (row['speed'], True), (row['low'] * 1.01, True), (row['high'] * 0.99, True),
        (row['low'] * 0.99, False), (row['high'] * 1.01, False),
    ):  # fmt: skip
        found = [kicked_behind(chain, settings.kick, each, speed) for each in cases]
        arrived = [(row['level'], *each) == one for each, one in zip(cases, found, strict=True)]
        assert all(arrived) == inside


def test_what_is_ahead_alternates_and_keeps_its_distance():
    assert cases_ahead(8, 1, 4, 0) == [(), (5, 6)]
    assert cases_ahead(8, 1, 4, 1) == [(5,), (5, 6, 7), (7,)]
    assert cases_ahead(8, 2, 4, 1) == [(6,), (7,)]
