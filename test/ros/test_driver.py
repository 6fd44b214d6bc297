# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A node over a driver that wants to end the process: everybody is told, and nobody waits."""

from robot import Robot

DRIVER = """\
import sys
from mlmem.instrument.drivers import Simulation

class Quits(Simulation):
    def __init__(self, design, settings, address):
        made = Simulation.of(design, settings.time)
        super().__init__(made.chain)
        self.played = 0

    def advance(self, *given):
        self.played += 1
        if self.played > 20 and given[0].any():
            sys.exit('over')
        return super().advance(*given)
"""


def test_driver_that_quits_stops_the_device(start, tmp_path, monkeypatch):
    (tmp_path / 'quits.py').write_text(DRIVER)
    monkeypatch.syspath_prepend(tmp_path)
    node = start({'device.driver': 'quits:Quits', 'write.method': 'strain'})
    why = 'the device has stopped: the driver quits:Quits has failed while playing: SystemExit'
    with Robot() as robot:
        failed = robot.write(1)
        assert not failed.success
        assert failed['error'].startswith(why)

        robot.wait(lambda: robot.state == 'unconfigured', 'the end of the device')
        refused = robot.trigger('read')
        assert refused['error'].startswith(f'inactive: {why}')
        loop = lambda report: report.status[0]  # noqa: E731
        assert robot.next('/diagnostics', lambda report: loop(report).message.startswith(why))
    assert node.running
    assert f'[ERROR] [mlmem]: {why}' in node.output
