# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Lines to an emulated rig, most without clock or thread: every answer is immediate; and drivers
of a local simulation.
"""

import contextlib
import threading
import time

from mlmem import Driver, MemoryElement, Settings
from mlmem.instrument.drivers import Simulation
from mlmem.physics import CASE_II
from mlmem_ros.rig import Rig
from mlmem_ros.rig.frames import Parser, encode_frame
from mlmem_tools.rig.emulated import EmulatedRig, LineProperties, RigServer

PAUSE = 1e-3
"""Seconds for which a line is silent at a time, so that a driver that waits keeps no core busy."""

ADDRESS = 'tcp://nowhere:1?lead=0.01&patience=0.05'


def encode(frame):
    return encode_frame(*frame)


class TamperedLine:
    """Both directions of a line; either may be tampered with, frame by frame.

    What tampers gets a frame and returns what comes of it: bytes.
    """

    filler = b''

    def __init__(self, rig, inward=None, outward=None):
        self.rig = rig
        self.inward, self.outward = inward or encode, outward or encode
        self.closed = False
        self._parsers, self._come = (Parser(), Parser()), b''
        rig.begin(self._take)

    def _take(self, data):
        for frame in self._parsers[1].feed(data):
            self._come += self.outward(frame)

    def send(self, data):
        if self.closed:
            raise OSError('the line is closed')
        for frame in self._parsers[0].feed(data):
            self.rig.take(self.inward(frame))
        self.rig.pass_time(0.0)

    def receive(self, seconds):
        if not self._come:  # nothing will, but a driver counts the time in which it listened
            time.sleep(min(seconds, PAUSE))
        come, self._come = self._come, b''
        return come

    def close(self):
        self.closed = True


class PatientRig(EmulatedRig):
    """Its clock waits for set-points instead of running dry, for a busy machine may hold up the
    driver for longer than its lead.
    """

    def _advance_clock(self, seconds):
        if self._playing:
            seconds = min(seconds, (len(self._ticks) - self._due) * self.tick_seconds)
        super()._advance_clock(seconds)


def emulated(settings=None, **options):
    """Return an emulated rig that plays set-points as they arrive."""
    return EmulatedRig(CASE_II, settings or Settings(), at_once=True, **options)


def driven(line, settings=None, address=ADDRESS):
    """Return a device with its element at the other end of a line."""
    settings = settings or Settings()
    return MemoryElement(CASE_II, settings, driver=Rig(CASE_II, settings, address, line))


@contextlib.contextmanager
def serving(rig, line=None, port=0):
    """Serve a rig in a thread, by default without a delay; yield its server."""
    server = RigServer(rig, line or LineProperties(), port=port)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        yield server
    finally:
        server.close()
        thread.join()


class LocalDriver(Driver):
    """A simulation without a line, which shows the motion of its ends and nothing else."""

    def __init__(self, design=CASE_II):
        self._simulation = Simulation.build_blank(design, Settings().time)
        self.dt, self.nodes = self._simulation.dt, self._simulation.nodes

    def advance(self, *given):
        return self._simulation.advance(*given)

    def end(self, site):
        return self._simulation.end(site)


def make_failing_driver(where, act):
    """Return a driver that calls a function while opening, playing or closing."""
    if where == 'opening':
        act()
    driver = LocalDriver()
    setattr(driver, {'playing': 'advance'}.get(where, 'close'), act)
    return driver


def raising(error):
    """Return a function that raises an error, whatever it is given."""

    def fail(*_):
        raise error

    return fail
