# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""One wall that is read by waveform: four deep defects."""

import pytest

from mlmem import Erase, MemoryElement, Read, Write
from mlmem.errors import SettingsError
from mlmem.move_settings import KickSettings, WriteSettings
from mlmem.physics import Design, Specimen, find_walls
from mlmem.readers.register import pin_walls
from mlmem.settings import (
    ActuatorSettings,
    ReadSettings,
    RegisterSettings,
    Settings,
    TransducerSettings,
)

DESIGN = Design(
    N=54, J=9, J_s=18, j_0=9.0, d=0.0265, beta=-0.6234, gamma=-0.0017, eta=0.0349, tail=17
)
"""Four levels whose defects are a tenth of the wall's energy deep."""


def make_settings(end='left', spacing=0):
    return Settings(
        actuator=ActuatorSettings(present=False),
        write=WriteSettings(method='kick', final_settle=300.0),
        kick=KickSettings(
            speeds='0.013 0.129 0.255 0.475', late=0.0411, hold=20.0, settle=100.0, erase_speed=0.5
        ),
        transducer=TransducerSettings(max_speed=4.0),
        read=ReadSettings(method='waveform', end=end),
        register=RegisterSettings(
            spacing=spacing, omega_c=0.8925, sigma=6.0, listen=300.0, min_margin=0.3
        ),
    )


@pytest.mark.parametrize('end', ['left', 'both'])
def test_waveform_read_of_ideal_element_tells_every_level(end):
    element = MemoryElement(DESIGN, make_settings(end))
    assert element.perform(Read()).reading.content == -1
    for level in (2, 0, 3, 1):
        assert element.perform(Write(level)).success
        reading = element.perform(Read()).reading
        assert (reading.content, reading.walls) == (level, 1)
        (wall,) = find_walls(DESIGN, element.chain.configuration)
        assert wall.position == pytest.approx(DESIGN.defect_site(level), abs=1.5)
    assert element.perform(Erase()).success
    assert find_walls(DESIGN, element.chain.configuration) == []


def test_waveform_read_of_two_walls_is_rejected():
    element = MemoryElement(DESIGN, make_settings())
    element.chain.place(pin_walls(Specimen(DESIGN), (1, 3)))
    element.transducer.assume_equilibrium()
    outcome = element.perform(Read())
    assert not outcome.success
    assert element.reading.content == -2


def test_waveform_method_with_spacing_is_rejected():
    with pytest.raises(SettingsError) as caught:
        make_settings(spacing=1)
    assert caught.value.field in ('read.method', 'register.spacing')
