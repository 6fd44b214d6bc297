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
from lines import make_failing_driver, raising

from mlmem import DriverError, Erase, MemoryElement, Read, Settings, SettingsError, Write
from mlmem.instrument import drivers
from mlmem.instrument.drivers import Simulation, Watchdog
from mlmem.physics import CASE_II, SUBSTEPS_PER_STEP, HeldCell, substep_times
from mlmem.settings import TimeSettings

PAGE = Path(__file__).parents[2] / 'docs' / 'drivers.md'
UM = 1e4  # micrometres of a cell


class Card:
    """An imaginary card that interpolates linearly between set-points."""

    def __init__(self, address, rate):
        if address != 'slot 2':
            raise OSError('nothing there')
        self.rate, self.fails = rate, False
        self._simulation = Simulation.build_blank(CASE_II, TimeSettings(), finer=2)  # 80 steps
        self._before, self._heard = np.zeros(3), np.empty((0, 2))

    def now(self):
        return UM * np.array([self._simulation.end(1), self._simulation.end(CASE_II.N)])

    def write(self, out):
        rows = np.vstack((self._before, out / UM))
        steps, dt = len(out), self._simulation.dt
        at, course = substep_times(steps, dt), np.arange(steps + 1) * dt
        held_cell, self._before = None, rows[-1]
        for column, site in ((1, 1), (2, CASE_II.N)):
            held = rows[1:, column][np.isfinite(rows[1:, column])]
            if len(held):
                when = at[: SUBSTEPS_PER_STEP * len(held)]
                position = np.interp(when, course[1 : len(held) + 1], held)
                held_cell = HeldCell(site, np.stack((position, np.gradient(position, when))))
        heard = self._simulation.advance(np.interp(at, course, rows[:, 0]), held_cell).T
        self._heard = np.concatenate((self._heard, heard))

    def read(self, samples):
        if self.fails:
            raise OSError('cable')
        read, self._heard = self._heard[:samples], self._heard[samples:]
        return UM * read, False

    def close(self):
        self.closed = True


@pytest.fixture
def bench(monkeypatch, tmp_path):
    """Write the page's driver into a file that can be imported."""
    daq = ModuleType('imaginary_daq')
    daq.Card, daq.Error = Card, OSError
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
    element = MemoryElement(CASE_II, driver=driver)
    for command in (Write(1), Read('both'), Erase(), Write(0)):
        outcome = element.perform(command)
        assert outcome.success, outcome.error
    reading = element.perform(Read()).reading
    assert reading.delay == pytest.approx(element.calibration.left.delays[0], abs=2.0)
    driver.driver._card.fails = True
    with pytest.raises(DriverError, match='the card has failed: cable'):
        element.advance()
    driver.close()
    assert driver.driver._card.closed


def use(where, act, **options):
    """Open, advance and close a driver that calls a function in one of these."""
    driver = Watchdog('bench:Bench', lambda: make_failing_driver(where, act), 1e-4, **options)
    MemoryElement(CASE_II, driver=driver).advance()
    driver.close()


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
@pytest.mark.parametrize('error', [TypeError('no number'), SystemExit(2), KeyboardInterrupt()])
def test_driver_that_raises_anything_fails(where, error):
    why = re.escape(f'bench:Bench has failed while {where}: {error!r}')
    with pytest.raises(DriverError, match=why) as caught:
        use(where, raising(error))
    assert caught.value.__cause__ is error


@pytest.mark.parametrize('where', ['opening', 'playing', 'closing'])
def test_driver_that_hangs_times_out(where):
    over = threading.Event()
    try:
        with pytest.raises(DriverError, match=f'hangs: {where} takes longer than 0.05'):
            use(where, lambda *_: over.wait(), timeout=0.05)
    finally:
        over.set()


@pytest.mark.parametrize(
    ('error', 'name', 'address', 'word'),
    [
        (SettingsError, 'Rig', '', "'Rig'"),
        (SettingsError, 'bench:', '', "'bench:'"),
        (SettingsError, 'no_such_package:Rig', '', 'cannot be imported'),
        (SettingsError, 'bench:Rig', '', 'one of the classes in bench'),
        (SettingsError, 'bench:LEAD', '', 'a subclass of mlmem.Driver'),
        (SettingsError, 'pathlib:Path', '', 'a subclass of mlmem.Driver'),
        *(
            (SettingsError, 'rig', address, r'^device\.address must be')
            for address in (
                *('', 'slot 2', 'tcp://host', 'tcp://:1', 'tcp://host:x', 'udp://h:1'),
                *(f'tcp://127.0.0.1:1?{each}' for each in ('lead=0', 'lead=nan', 'patience=soon')),
                'serial:///dev/no_such_port?baud=12345',
            )
        ),
        (DriverError, 'bench:Bench', 'slot 7', 'no card at slot 7: nothing there'),
        (DriverError, 'rig', 'tcp://127.0.0.1:1', 'no rig at tcp://127.0.0.1:1'),
        (DriverError, 'rig', 'serial:///dev/no_such_port', 'no rig at serial:///dev/no_such_port'),
    ],
)
def test_driver_that_cannot_be_opened_says_why(bench, error, name, address, word):
    with pytest.raises(error, match=word):
        drivers.open_driver(name, address, CASE_II, Settings())
