# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Workers for the tests: pytest collects once, and forks processes that take file after file.

Imports and collection take 5 s of processor, which workers that are started take each.
"""

import os
import shutil
import signal
import sys
import traceback
from itertools import groupby
from multiprocessing.connection import Pipe, wait
from pathlib import Path

import pytest

# Before numpy is loaded: our matrices are small, and BLAS threads that wait for each other take
# the cores from the other workers.
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

PLACE = 4
"""Bytes of a file's place in the queue, which is a pipe."""


def pytest_addoption(parser):
    parser.addoption('--workers', type=int, default=1, help='processes that run the tests')


@pytest.hookimpl(tryfirst=True)
def pytest_runtestloop(session):
    """Run the tests in several processes if that is asked for, and all could be collected."""
    options, here = session.config.option, hasattr(session.config, 'workerinput')
    if here or options.workers < 2 or options.collectonly or session.testsfailed:
        return None
    Workers(session).run(options.workers)
    return True


@pytest.fixture(scope='session', autouse=True)
def graph():
    """Give each worker a ROS graph of its own, if anything here may join one."""
    if testing := sys.modules.get('mlmem_ros.testing'):
        testing.isolate.cache_clear()  # a worker has that of the process that forked it
        testing.isolate()
        yield
        shutil.rmtree(Path(os.environ['ROS_LOG_DIR']).parent, ignore_errors=True)
    else:
        yield


class Workers:
    """The processes. The tests of a file run in their order, in one of them."""

    def __init__(self, session):
        self._session = session
        files = [list(items) for _, items in groupby(session.items, key=lambda item: item.path)]
        self._files, (self._queue, filled) = files, os.pipe()
        for place in range(len(files)):
            os.write(filled, place.to_bytes(PLACE, 'big'))
        os.close(filled)
        self._running = {}  # process and the place of its item, by the end of its pipe
        session.config._tmp_path_factory.getbasetemp()  # made now, it is everybody's

    def run(self, count):
        """Run all tests, or as many as pytest would."""
        try:
            for _ in range(count):
                self._fork([])
            while self._running:
                for pipe in wait(list(self._running)):
                    self._hear(pipe)
                if reason := self._session.shouldfail:
                    raise self._session.Failed(reason)
                if reason := self._session.shouldstop:
                    raise self._session.Interrupted(reason)
        finally:
            for process, _ in self._running.values():
                os.kill(process, signal.SIGTERM)
                os.waitpid(process, 0)

    def _fork(self, first):
        """Fork a process that runs the first items, and then files of the queue."""
        ours, its = Pipe(duplex=False)
        if process := os.fork():
            its.close()
            self._running[ours] = process, None
            return
        status = 1
        try:
            Worker(self._session, its, first, self._next_file).run()
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            os._exit(status)

    def _next_file(self):
        place = os.read(self._queue, PLACE)
        return self._files[int.from_bytes(place, 'big')] if place else []

    def _hear(self, pipe):
        """Call here what was called in another process."""
        hook, config = self._session.config.hook, self._session.config
        process, present = self._running[pipe]
        try:
            name, told = pipe.recv()
        except EOFError:
            name, told = 'end', None
        if name == 'present':
            self._running[pipe] = process, told
        elif name == 'report':
            told = hook.pytest_report_from_serializable(config=config, data=told)
            hook.pytest_runtest_logreport(report=told)
        elif name == 'finished':
            hook.pytest_runtest_logfinish(**told)
        elif name == 'warning':
            hook.pytest_warning_recorded.call_historic(kwargs=told)
        else:
            del self._running[pipe]
            if status := os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]):
                self._crashed(present, status)

    def _crashed(self, present, status):
        """Report the item that ended its process; another one goes on with its file."""
        if present is None:
            raise RuntimeError(f'a worker ended with status {status}')
        item, *rest = self._session.items[present:]
        self._session.config.hook.pytest_runtest_logreport(
            report=pytest.TestReport(
                item.nodeid, item.location, {}, 'failed', f'it ended its process: {status}', 'call'
            )
        )
        self._fork([each for each in rest if each.path == item.path])


class Worker:
    """What a process runs, and tells."""

    def __init__(self, session, pipe, first, next_file):
        self._session, self._first, self._next_file = session, first, next_file
        self._tell, config = lambda told: None, session.config
        config.workerinput = {}  # as in a worker of xdist: who writes at the end does not here
        config.pluginmanager.unregister(name='terminalreporter')
        config.pluginmanager.register(self)  # is told of the warnings until now
        self._tell = pipe.send
        if capture := config.pluginmanager.get_plugin('capturemanager'):
            capture.stop_global_capturing()  # into the files of the process that forked this one
            capture.start_global_capturing()
            capture.suspend_global_capture()

    def run(self):
        self._session.config.hook.pytest_runtestloop(session=self._session)
        self._session._setupstate.teardown_exact(None)  # of the session's fixtures

    def pytest_runtestloop(self, session):
        """Run the first items, then files, until there are no more."""
        places = {item: place for place, item in enumerate(session.items)}
        items = self._first
        while items := items or self._next_file():
            for item, following in zip(items, [*items[1:], session], strict=True):
                self._tell(('present', places[item]))
                session.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
            items = []
        self._tell(('present', None))
        return True

    def pytest_runtest_logreport(self, report):
        data = self._session.config.hook.pytest_report_to_serializable(
            config=self._session.config, report=report
        )
        self._tell(('report', data))

    def pytest_runtest_logfinish(self, nodeid, location):
        self._tell(('finished', {'nodeid': nodeid, 'location': location}))

    def pytest_warning_recorded(self, warning_message, when, nodeid, location):
        warning_message.source = None  # the object that a ResourceWarning is about
        told = {'warning_message': warning_message, 'when': when, 'nodeid': nodeid}
        self._tell(('warning', told | {'location': location}))
