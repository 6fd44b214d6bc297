# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A driver of a user's own: what it raises reaches the log with its traceback."""

import pytest
from timeouts import TIMEOUT_S

from mlmem import Driver, DriverError, Refused, SettingsError, Write
from mlmem_ros.host.settings import DeviceSettings
from test.rig.lines import make_failing_driver, raising


class Sour(Driver):
    """Raises where its address says."""

    def __new__(cls, design, settings, address):
        return make_failing_driver(address, raising(LookupError('turned sour')))


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
            host.submit(Write(0)).answer.result(TIMEOUT_S)
        host.release_failed()
    elif where == 'closing':
        host.close()
    (trace,) = [line for line in log.of('ERROR') if 'Traceback' in line]
    assert 'LookupError: turned sour' in trace
    assert f'failed while {where}: ' in trace


def test_exception_of_a_driver_module_is_logged(serve, log, tmp_path, monkeypatch):
    (tmp_path / 'sour.py').write_text('1 / 0\n')
    monkeypatch.syspath_prepend(tmp_path)
    with pytest.raises(SettingsError, match='sour cannot be imported: ZeroDivisionError'):
        serve(device=DeviceSettings('sour:Bench')).activate()
    assert any('sour.py", line 1' in line for line in log.of('ERROR'))
