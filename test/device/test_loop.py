# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""Commands that a loop is handed, its answers, pauses and single ticks, and its end."""

import math
import threading
import time
from unittest.mock import Mock

import pytest
from rejection import expect_rejection

from mlmem import Abort, Disturb, EchoReceived, Loop, Outcome, Read, Refused, SetStrain, Write
from mlmem.loop.mailbox import MAX_PENDING_REQUESTS, Cancel, OpenRequests, Request

from . import rig
from .loops import PATIENCE, Clock, hold, refusal, result, until

pytestmark = pytest.mark.timeout(60)


@pytest.mark.parametrize('kind', [RuntimeError, SystemExit])
def test_command_that_raises_is_answered_and_ends_loop(start, kind):
    element, fault = rig.device(), kind('a fault of the program')
    element.apply = Mock(side_effect=fault)
    loop = start(element)
    assert loop.submit(Read()).answer.exception(PATIENCE) is fault
    until(lambda: loop.failure is fault)
    assert refusal(loop.submit(Read())) == f'the device has stopped: {fault}'


@pytest.mark.parametrize('kind', [RuntimeError, SystemExit, KeyboardInterrupt])
@pytest.mark.parametrize('part', ['listener', 'now', 'wait'])
def test_loop_stops_when_a_part_of_it_fails(start, part, kind):
    """A listener, or a ROS clock whose context is gone. Whatever it raises: a thread that ends
    in silence would leave its clients waiting.
    """

    def fail(*_):
        raise kind('it has gone')

    def listen(commands, events):
        if commands and part == 'listener':
            fail()

    clock = Clock()
    loop = start(rig.device(), listen, pacer=clock, speed=1.0)
    if part != 'listener':
        setattr(clock, part, fail)
    for _ in range(2):
        assert refusal(loop.submit(Read())) == 'the device has stopped: it has gone'
    assert str(loop.failure) == 'it has gone'


def test_procedure_is_answered_after_its_outcome_was_published(start):
    """Or a client would still find the old level on ~/level."""
    events, answered = [], []

    def publish(commands, told):
        events.extend(told)
        answered.extend(request.answer.done() for event in told if isinstance(event, Outcome))

    loop = start(rig.device(1), publish)
    hold(loop)
    request, second = loop.submit(Write(2)), loop.submit(Read())
    loop.pause(False)
    assert second.answer.exception(PATIENCE).code.value == 'busy'
    assert not second.answer.cancel()
    outcome = result(request)
    assert (outcome.success, outcome.reading.level) == (True, 2)
    loop.shut_down()
    assert answered == [False]
    assert [type(event) for event in events] == 4 * [EchoReceived] + [Outcome]
    assert rig.true_level(loop.element) == 2


def test_cancel_ends_procedure_of_its_own_command_in_next_tick(start):
    stamped = []
    loop = start(rig.device(1), lambda commands, _: stamped.extend(commands), speed=1.0)
    hold(loop)
    mine = loop.submit(Write(3))
    for _ in range(80):  # it has read what is there, and strains
        result(loop.step().answer)
    canceled = loop.cancel(mine)
    began = result(loop.step().answer)
    assert result(mine).error == 'aborted: canceled by its client'
    assert loop.element.procedure == 'abort'
    loop.pause(False)
    loop.set_speed(0.0)
    assert result(canceled).procedure == 'abort'
    assert loop.element.actuator.strain == 0.0
    assert stamped[1:] == [(began - 1, Abort('canceled by its client'))]  # as any abort is told


def test_cancel_does_not_end_another_clients_procedure(start):
    loop = start(rig.device(1))
    hold(loop)
    mine, equal = loop.submit(Read()), loop.submit(Read())
    result(loop.step().answer)
    assert equal.answer.exception(PATIENCE).code.value == 'busy'
    late = loop.cancel(equal)
    loop.pause(False)
    assert result(late) is None
    assert result(mine).success
    assert loop.cancel(None).answer.exception(PATIENCE).code == 'out_of_range'
    assert result(loop.cancel(mine)) is None  # it has ended


@pytest.mark.parametrize('started', [True, False])
def test_pending_requests_are_rejected_when_loop_stops(started):
    loop = Loop(rig.device(2), lambda *_: None, speed=0.0)
    loop.pause(True)
    running = None
    if started:
        loop.start()
        running = loop.submit(Write(0)).answer
        result(loop.step().answer)
    waiting = [loop.submit(each).answer for each in (Write(1), SetStrain(0.0), Abort())]
    called = None if started else loop.call(int)
    loop.shut_down()
    if running:
        assert result(running).code == 'aborted'
    for answer in filter(None, (called, *waiting)):
        assert answer.done()
        assert refusal(answer) == 'the device is shut down'
        assert answer.exception().code == 'inactive'
    assert refusal(loop.submit(Read())) == 'the device is shut down'
    assert refusal(loop.step().answer) == 'the device is shut down'
    loop.shut_down()  # once more does no harm


def test_finish_releases_strain_without_waiting_for_clock(start):
    element = rig.device(2)
    clock = Clock(end=0.0)  # stands still until the write is in the inbox
    loop = start(element, pacer=clock, speed=1.0)
    writing = loop.submit(Write(3))
    clock.end = 0.3  # and again in the middle of the write, in tick 150
    until(lambda: clock.time >= 0.3)
    assert not writing.answer.done()
    assert abs(element.actuator.strain) > 0.01
    loop.shut_down()
    assert result(writing).code == 'aborted'
    assert element.actuator.strain == 0.0
    assert element.procedure == ''
    assert refusal(loop.submit(Read())) == 'the device is shut down'


def test_too_many_pending_commands_are_rejected(start):
    loop = start(rig.device())
    hold(loop)
    answers = [loop.submit(SetStrain(0.0)) for _ in range(MAX_PENDING_REQUESTS + 5)]
    for late in answers[MAX_PENDING_REQUESTS:]:
        assert late.answer.exception(PATIENCE).code.value == 'busy'
    loop.pause(False)
    assert all(result(answer) is None for answer in answers[:MAX_PENDING_REQUESTS])


def test_withdrawn_or_replaced_request_is_not_executed(start):
    """An IMU goes on while time is paused: only its newest message is kept."""
    stamped = []
    loop = start(rig.device(), lambda commands, events: stamped.extend(commands))
    hold(loop)
    assert loop.submit(Write(1)).answer.cancel()
    asked = [SetStrain(0.01), *(Disturb(1e-6 * n) for n in range(1000))]
    answers = [loop.submit(command) for command in asked]
    with expect_rejection(Refused, 'out_of_range', 'acceleration'):
        loop.submit(Disturb(math.nan)).answer.result(0.0)
    assert all(request.answer.result(0.0) is None for request in answers[1:-1])
    assert len(loop._box.shakes) == 1
    result(loop.step())
    assert result(answers[0]) is None
    assert [command for _, command in stamped] == [asked[0], asked[-1]]
    assert loop.failure is None


def test_pause_is_not_overrun(start):
    clock = Clock()
    loop = start(rig.device(), lambda *_: time.sleep(1e-4), pacer=clock, speed=1.0)
    until(lambda: loop.element.ticks > 3)
    hold(loop)
    clock.time += 100.0
    loop.pause(False)
    ticks = loop.element.ticks
    until(lambda: loop.element.ticks > ticks + 3)
    assert loop.statistics.overruns == 0


def test_steps_are_exact_numbers_of_ticks(start):
    loop = start(rig.device())
    error = loop.step().answer.exception(PATIENCE)  # it runs
    assert error.code.value == 'conflict'
    ticks = hold(loop)
    for n in range(1, 6):
        assert result(loop.step().answer) == ticks + n
    many = [loop.step().answer for _ in range(10)]
    assert [result(tick) for tick in many] == [ticks + 6 + n for n in range(10)]
    assert result(loop.step(7)) == ticks + 22
    for wrong in (0, -1, 1.0, None):
        assert loop.step(wrong).answer.exception(PATIENCE).code == 'out_of_range'
    time.sleep(0.02)
    assert loop.element.ticks == ticks + 22
    stepping = loop.step(10**6)
    until(lambda: loop.element.ticks > ticks + 22)
    loop.pause(True)  # which ends ticks that were asked for
    assert result(stepping) == ticks + 22 + stepping.asked.done < ticks + 10**6


def test_single_tick_is_answered_even_if_pause_ends_first(start):
    loop = start(rig.device())
    hold(loop)
    blocked = threading.Event()
    holding = loop.call(blocked.wait)  # the loop's thread is busy until we let it
    tick = loop.step().answer
    loop.pause(False)
    blocked.set()
    result(holding)
    assert result(tick) > 0


@pytest.mark.parametrize('leaves', ['canceled', 'past its deadline'])
def test_places_move_up_when_a_request_leaves(leaves):
    requests = OpenRequests(rig.device(), None, None, most=3)
    running, *waiting = (Request(Write(1), waits=True) for _ in range(4))
    for request in (running, *waiting):
        requests.apply(request)
    assert [request.place for request in (running, *waiting)] == [0, 1, 2, 3]
    first = waiting[0]
    if leaves == 'canceled':
        requests.apply(Request(Cancel(first)))
    else:
        first.deadline = 0.0
        requests.refuse_expired()
    codes = {'canceled': 'other', 'past its deadline': 'busy'}
    assert first.answer.exception(0.0).code == codes[leaves]
    assert [request.place for request in waiting] == [0, 1, 2]
