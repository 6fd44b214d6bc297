# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A driver of a user's own: what it raises reaches the log with its traceback."""

import pytest

from mlmem import Driver, DriverError, Refused, Settings, SettingsError, Write
from mlmem.instrument.drivers import Simulation
from mlmem.physics import CASE_II
from mlmem_ros.host.settings import DeviceSettings


class Sour(Driver):
    """Raises where its address says."""

    def __init__(self, design, settings, address):
        self._where = address
        self._simulation = Simulation.of(CASE_II, Settings().time)
        self.dt, self.nodes = self._simulation.dt, self._simulation.nodes
        self.end = self._simulation.end
        self._pass('opening')

    def _pass(self, here):
        if here == self._where:
            raise LookupError('turned sour')

    def advance(self, *given):
        self._pass('playing')
        return self._simulation.advance(*given)

    def end(self, site):
        """Return what the simulation measures."""

    def close(self):
        self._pass('closing')


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
def test_exception_of_a_driver_is_logged(serve, log, where):
    service = serve(device=DeviceSettings(f'{__name__}:Sour', where))
    if where == 'opening':
        with pytest.raises(DriverError, match='failed while opening: LookupError'):
            service.activate()
    else:
        host = service.activate()
    if where == 'playing':
        with pytest.raises(Refused, match=r'the device has stopped: .*turned sour'):
            host.submit(Write(0)).answer.result(30.0)
        host.fail()
    elif where == 'closing':
        host.close()
    (trace,) = [line for line in log.of('error') if 'Traceback' in line]
    assert "raise LookupError('turned sour')" in trace
    assert f'failed while {where}: ' in trace


def test_exception_of_a_driver_module_is_logged(serve, log, tmp_path, monkeypatch):
    (tmp_path / 'sour.py').write_text('1 / 0\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SettingsError, match='sour cannot be imported: ZeroDivisionError'):
        serve(device=DeviceSettings('sour:Bench')).activate()
    assert any('sour.py", line 1' in line for line in log.of('error'))
