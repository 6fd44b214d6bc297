# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A log that can be read, and a small element in service."""

import dataclasses
import math
import threading
import time

import pytest
from suite import TIMEOUT_S

from mlmem import MemoryElement, factory, load_element
from mlmem.element_file import use_kicks
from mlmem.loop.timetable import SteadyPacer
from mlmem_ros.host import Host, SessionPlan, ThrottledLog
from mlmem_ros.host.settings import GROUPS, Parameters, StateSettings

ELEMENT = use_kicks(load_element('case_2'))
"""Eight levels as the paper's, written by kicks."""


@pytest.fixture(scope='module', autouse=True)
def owned_devices(one_owner):
    """See `one_owner`."""


class Lines(list):
    """A log: pairs of severity and text."""

    def write(self, severity, text):
        self.append((severity, text))

    def of(self, severity):
        return [text for kind, text in self if kind == severity]


@pytest.fixture
def log():
    return Lines()


@pytest.fixture
def throttled(log):
    return ThrottledLog(log.write)


@pytest.fixture(scope='session')
def parameters():
    """The parameters of a host; a test replaces some."""
    groups = {**GROUPS, 'state': StateSettings(interval=0.0)}
    return Parameters(ELEMENT.design, 'skip', ELEMENT.settings, **groups)


@pytest.fixture(scope='session')
def calibration():
    return MemoryElement(ELEMENT).calibration


class Service:
    """A host with its element in service, at greatest speed, with a clock of nanoseconds."""

    def __init__(self, log, given):
        self.given = given
        self.failed = threading.Event()
        self.events = []
        self.host = Host(log.write, time.time_ns, failed=self.failed.set)

    def activate(self, pacer=None, paused=False):
        self.host.adopt_device(self.host.prepare_device(self.given))
        plan = SessionPlan('/mlmem', self.given.record)
        self.host.activate(
            self.given, plan, self.events.extend, pacer or SteadyPacer(), 0.0, paused=paused
        )
        return self.host

    def record(self, settings):
        return self.host.record(SessionPlan('/mlmem', settings))

    def poison(self):
        """Put NaN into the material, and wait until the loop has failed."""
        host = self.host
        host.loop.call(lambda: host.element.chain.v.__setitem__(100, math.nan)).result(TIMEOUT_S)
        assert self.failed.wait(TIMEOUT_S)


@pytest.fixture
def file(tmp_path):
    return tmp_path / 'element.json'


@pytest.fixture
def kept(file):
    return {'state': StateSettings(path=str(file), interval=0.0)}


@pytest.fixture
def serve(log, parameters, calibration, monkeypatch):
    """Make a service: serve(state=StateSettings(...), ...); it ends with the test."""
    monkeypatch.setattr(factory, 'factory_calibration', lambda *_: calibration)
    services = []

    def serve(**given):
        service = Service(log, dataclasses.replace(parameters, **given))
        services.append(service)
        return service

    yield serve
    for service in services:
        service.host.close()
