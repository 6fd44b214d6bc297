# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The driver printed in docs/drivers.md works; invalid drivers are refused with a reason."""

import re
import sys
import threading
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from mlmem import Driver, DriverError, Erase, MemoryElement, Read, Settings, SettingsError, Write
from mlmem.instrument import drivers
from mlmem.instrument.drivers import Simulation, Watchdog
from mlmem.physics import CASE_II, HeldCell, substep_times
from mlmem.settings import TimeSettings

from .lines import calibration

PAGE = Path(__file__).parents[2] / 'docs' / 'drivers.md'
UM = 1e4  # micrometres of a cell


class Error(Exception):
    pass


class Card:
    """An imaginary card that interpolates linearly between set-points."""

    def __init__(self, address, rate):
        if address != 'slot 2':
            raise Error('nothing there')
        self.rate, self.fails = rate, False
        time = TimeSettings(integrator='noh_bathe')  # two set-points a step, 80 steps a tick
        self._simulation = Simulation.of(CASE_II, time)
        self._before, self._heard = np.zeros(3), np.empty((0, 2))

    def now(self):
        return UM * np.array([self._simulation.end(1), self._simulation.end(CASE_II.N)])

    def write(self, out):
        rows = np.vstack((self._before, out / UM))
        steps, dt = len(out), self._simulation.dt
        at, course = substep_times(steps, dt, self._simulation), np.arange(steps + 1) * dt
        held_cell, self._before = None, rows[-1]
        for column, site in ((1, 1), (2, CASE_II.N)):
            held = rows[1:, column][np.isfinite(rows[1:, column])]
            if len(held):
                when = at[: 2 * len(held)]
                position = np.interp(when, course[1 : len(held) + 1], held)
                held_cell = HeldCell(site, np.stack((position, np.gradient(position, when))))
        heard = self._simulation.advance(np.interp(at, course, rows[:, 0]), held_cell).T
        self._heard = np.concatenate((self._heard, heard))

    def read(self, samples):
        if self.fails:
            raise Error('cable')
        read, self._heard = self._heard[:samples], self._heard[samples:]
        return UM * read, False

    def close(self):
        self.closed = True


@pytest.fixture
def bench(monkeypatch, tmp_path):
    """Write the page's driver into a file that can be imported."""
    daq = ModuleType('imaginary_daq')
    daq.Card, daq.Error = Card, Error
    monkeypatch.setitem(sys.modules, 'imaginary_daq', daq)
    (code,) = re.findall(r'```python\n(.*?)```', PAGE.read_text(), re.DOTALL)
    assert code.count('\n') <= 150
    (tmp_path / 'bench.py').write_text(code)
    monkeypatch.syspath_prepend(tmp_path)
    yield 'bench:Bench'
    sys.modules.pop('bench', None)


def test_driver_of_the_page_writes_and_reads(bench):
    settings = Settings()
    driver = drivers.open_driver(bench, 'slot 2', CASE_II, settings)
    assert driver.driver._card.rate == pytest.approx(40e3)  # 80 samples in 2 ms
    element = MemoryElement(CASE_II, settings, calibration(), driver)
    for command in (Write(3), Read('both'), Erase(), Write(1)):
        outcome = element.perform(command)
        assert outcome.success, outcome.error
    reading = element.perform(Read()).reading
    assert reading.delay == pytest.approx(element.calibration.left.delays[1], abs=2.0)
    driver.driver._card.fails = True
    with pytest.raises(DriverError, match='the card has failed: cable'):
        element.advance()
    driver.close()
    assert driver.driver._card.closed


class Hangs(Driver):
    """Hangs in one of its methods until the test is over."""

    def __init__(self, where, until):
        self._where, self._until = where, until
        time = TimeSettings(integrator='noh_bathe')  # two set-points a step, 80 steps a tick
        self._simulation = Simulation.of(CASE_II, time)
        self.dt, self.nodes = self._simulation.dt, self._simulation.nodes
        self._pass('opening')

    def _pass(self, here):
        if here == self._where:
            self._until.wait()

    def advance(self, *given):
        self._pass('playing')
        return self._simulation.advance(*given)

    def end(self, site):
        return self._simulation.end(site)

    def close(self):
        self._pass('closing')


class Raises(Hangs):
    """Raises in one of its methods."""

    def _pass(self, here):
        if here == self._where:
            raise self._until


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
@pytest.mark.parametrize('error', [TypeError('no number'), SystemExit(2), KeyboardInterrupt()])
def test_driver_that_raises_anything_fails(where, error):
    def live():
        driver = Watchdog('bench:Bench', lambda: Raises(where, error), 1e-4)
        element = MemoryElement(CASE_II, Settings(), calibration(), driver)
        element.advance()
        driver.close()

    why = re.escape(f'the driver bench:Bench has failed while {where}: {error!r}')
    with pytest.raises(DriverError, match=why) as caught:
        live()
    assert caught.value.__cause__ is error


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
def test_driver_that_hangs_times_out(where):
    over = threading.Event()

    def live():
        driver = Watchdog('bench:Bench', lambda: Hangs(where, over), 1e-4, patience=0.05)
        element = MemoryElement(CASE_II, Settings(), calibration(), driver)
        element.advance()
        driver.close()

    try:
        with pytest.raises(
            DriverError, match=f'bench:Bench hangs: {where} takes longer than 0.05'
        ):
            live()
    finally:
        over.set()


@pytest.mark.parametrize(
    ('name', 'why'),
    [
        ('Rig', "device.driver must be sim, rig or package.module:Class; got 'Rig'"),
        ('bench:', "device.driver must be sim, rig or package.module:Class; got 'bench:'"),
        ('no_such_package:Rig', "no_such_package cannot be imported: .*No module named 'no_such"),
        ('bench:Rig', 'device.driver bench:Rig: bench has no Rig'),
        ('bench:LEAD', 'LEAD must be a subclass of mlmem.Driver; got .0.02'),
        ('pathlib:Path', 'Path must be a subclass of mlmem.Driver'),
    ],
)
def test_invalid_driver_is_rejected(bench, name, why):
    with pytest.raises(SettingsError, match=why):
        drivers.open_driver(name, '', CASE_II, Settings())


def test_driver_that_cannot_be_opened_says_why(bench, monkeypatch):
    with pytest.raises(DriverError, match='no card at slot 7: nothing there'):
        drivers.open_driver(bench, 'slot 7', CASE_II, Settings())
    monkeypatch.setattr(Card, 'now', lambda self: None)
    with pytest.raises(
        DriverError, match=r'the driver bench:Bench has failed while opening: TypeError'
    ):
        drivers.open_driver(bench, 'slot 2', CASE_II, Settings())


@pytest.mark.parametrize(
    'address', ['', 'slot 2', 'tcp://host', 'tcp://:1', 'tcp://host:x', 'udp://h:1']
)
def test_invalid_address_is_rejected(address):
    with pytest.raises(SettingsError, match=r'device.address of a rig must be tcp://HOST:PORT or'):
        drivers.open_driver('rig', address, CASE_II, Settings())


@pytest.mark.parametrize('options', ['lead=0', 'lead=nan', 'patience=soon', 'lead='])
def test_invalid_option_is_rejected(options):
    with pytest.raises(SettingsError, match=r'in device.address must be a number above 0'):
        drivers.open_driver('rig', f'tcp://127.0.0.1:1?{options}', CASE_II, Settings())


def test_missing_rig_is_reported():
    with pytest.raises(DriverError, match=r'no rig at tcp://127.0.0.1:1: .*refused'):
        drivers.open_driver('rig', 'tcp://127.0.0.1:1', CASE_II, Settings())
    with pytest.raises(DriverError, match='no rig at serial:///dev/no_such_port: No such file'):
        drivers.open_driver('rig', 'serial:///dev/no_such_port', CASE_II, Settings())
