# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""What a transducer must do: its force does the work that the element stores."""

from dataclasses import replace

import pytest

from mlmem import load_element
from mlmem.element_file import use_kicks
from mlmem.moves.kick import KickMotion
from mlmem.physics import Chain
from mlmem.physics.energy import energy
from mlmem_tools.checks import Verdict, transducer
from mlmem_tools.checks.concern import Subject


def test_force_of_a_kick_does_the_work_that_is_stored():
    """The sum of force times speed of every step, without damping; first order in the step."""
    design, settings = load_element('kick_2').design_and_settings
    chain = Chain(replace(design, eta=1e-9), 0.05)
    kick = KickMotion(chain.end(1), design.D_s2, 0.1, replace(settings.kick, hold=0.0))
    before = energy(chain).total
    asked = transducer.simulate_kick(chain, kick)
    put_in = energy(chain).total - before
    assert asked['power'].sum() * chain.dt == pytest.approx(put_in, rel=0.01)
    assert asked['stroke'].max() == pytest.approx(design.D_s2 - design.D_s1, rel=1e-5)
    assert asked['speed'].max() == pytest.approx(0.1 * settings.kick.peak_speed_ratio, rel=1e-3)


def test_check_says_it_in_si_and_warns_of_what_is_not_made():
    design, settings = use_kicks(load_element('case_2')).design_and_settings
    found = {each.name: each for each in transducer.check(Subject(design, settings))}
    assert found['transducer_stroke'].values['write'] == pytest.approx(
        settings.scale.length * (design.D_s2 - design.D_s1)
    )
    assert found['transducer_speed'].values['erase'] == pytest.approx(
        settings.scale.speed * settings.kick.peak_speed_ratio * settings.kick.erase_speed, rel=0.02
    )
    assert {each.verdict for each in found.values()} == {Verdict.PASS}
    slow = replace(settings, transducer=replace(settings.transducer, max_speed=0.3))
    found = {each.name: each for each in transducer.check(Subject(design, slow))}
    assert found['transducer_speed'].verdict is Verdict.WARN
    assert 'it is not made' in found['transducer_speed'].text
    strained = replace(slow, write=replace(slow.write, method='strain'))  # it needs no kick
    found = {each.name: each for each in transducer.check(Subject(design, strained))}
    assert found['transducer_speed'].verdict is Verdict.PASS


def test_force_contains_the_jump_at_the_end_of_a_late_kick():
    """A unit mass at the end of 3 x^2 - 2 x^3, x = (1 - l) s + l s^2 needs 6 D (1 + l)^2 / T^2.

    The spring to the next cell changes that by at most k_r D.
    """
    design, settings = load_element('robust_3').design_and_settings
    found = {each.name: each for each in transducer.check(Subject(design, settings))}
    step, kick = design.D_s2 - design.D_s1, settings.kick
    duration = step / kick.wall_speeds[-1]
    jump = 6.0 * step * (1.0 + kick.late) ** 2 / duration**2
    force = found['transducer_force'].values['write'] / settings.scale.force
    assert force == pytest.approx(jump, abs=step)
