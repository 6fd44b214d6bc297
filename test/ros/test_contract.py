# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""The running node does what the tables of the ROS contract say, with any driver.

The element is the paper's Case II: 225 cells, eight levels
(three bits), level n with the wall at cell 25 (n + 1).
"""

import functools
import itertools
import math

import pytest
from robot import BLANK, LENGTH, Robot, values
from suite import sampled

from mlmem_ros.contract.streams import STREAMS
from mlmem_ros.contract.topics import DIAGNOSTICS_TOPIC

CELLS, PERIOD, LEVELS = 225, 25, 8
SIMULATED = ('field', 'wall', 'image', 'markers')
SCALE = 0.01  # scale.length: metres per cell


@pytest.fixture(scope='module', params=sampled(('sim', 'rig'), lambda driver: driver == 'sim'))
def driver(request):
    """A simulation, and an emulated rig in another process."""
    return request.param


def site(level):
    return PERIOD * (level + 1)


def test_topics_out_have_their_types_and_qualities(robot, driver):
    for stream in (*STREAMS.values(), DIAGNOSTICS_TOPIC):
        name = robot.name(stream.name)
        find = functools.partial(robot.node.get_publishers_info_by_topic, name)
        if stream.name == 'word' or (driver != 'sim' and stream.name in SIMULATED):
            assert not find()
            continue
        info, *_ = robot.wait(find, f'a publisher of {name}')  # every node has /diagnostics
        found = info.qos_profile
        assert info.topic_type == stream.type
        assert found.reliability.name.lower() == stream.qos.reliability
        assert found.durability.name.lower() == stream.qos.durability


def test_messages_of_an_idle_element_have_own_stamps(robot):
    heard = [robot.next('joint_states', lambda state: state.velocity[1] == 0.0) for _ in range(3)]
    assert len({str(state.header.stamp) for state in heard}) == len(heard)


def test_write_level_topic_writes_and_reports(robot):
    robot.publish('write_level', data=3)
    outcome = robot.latest('outcome', lambda status: values(status).get('level') == '3')
    assert (values(outcome)['procedure'], values(outcome)['code']) == ('write', '011')
    robot.latest('level', lambda level: level.data == 3)
    read = robot.trigger('read')
    assert (read.success, read['level'], read['code']) == (True, 3, '011')
    assert read['delay'] > 2 * site(3)  # there and back, at less than one cell a time unit


def test_self_test_checks_all_levels_and_restores_content(robot, driver):
    assert robot.write(2).success
    response = robot.call('self_test')
    assert response.id == robot.element
    assert response.passed == b'\1'
    assert {status.level for status in response.status} == {b'\0'}
    names = [status.name.removeprefix(f'{robot.element[1:]}: ') for status in response.status]
    assert {f'level {level}' for level in range(LEVELS)} < set(names)
    assert {'transducer left', 'transducer right', 'actuator', 'erase', 'restore'} < set(names)
    assert robot.trigger('read')['level'] == 2
    if driver == 'sim':
        assert robot.next('wall').data[0] == pytest.approx(site(2), abs=1.0)


def test_probe_gives_an_echo_for_each_end_with_a_wall(robot):
    robot.write(3)
    robot.latest('outcome')
    echoes, outcomes = robot.received('echo'), robot.received('outcome')
    before, ended = len(echoes), len(outcomes)
    robot.publish('probe')
    robot.wait(lambda: len(robot.received('outcome')) > ended, 'the outcome of the probe')
    assert len(robot.received('echo')) == before + 2
    for echo in echoes[before:]:
        channel, sample = echo.layout.dim
        assert (channel.label, channel.size) == ('channel', 3)
        assert sample.label == 'sample'
        assert (channel.stride, sample.stride) == (3 * sample.size, sample.size)
        assert echo.layout.data_offset == 0
        assert len(echo.data) == 3 * sample.size
        t, v_m, v_c = (echo.data[i * sample.size : (i + 1) * sample.size] for i in range(3))
        assert all(late > early for early, late in itertools.pairwise(t))
        assert all(map(math.isfinite, echo.data))
        assert max(map(abs, v_m)) > 1e-4  # the pulse's amplitude is 0.01, its echo's a hundredth
        assert max(map(abs, v_c)) > 1e-5


def test_range_is_the_distance_to_the_wall_if_any(robot):
    """REP 117: +inf is "nothing came back", not an error."""
    robot.write(4)
    robot.received('range')
    robot.trigger('read')
    message = robot.latest('range', lambda message: math.isfinite(message.range))
    assert message.range == pytest.approx(site(4) * SCALE, abs=PERIOD / 2 * SCALE)
    assert message.min_range <= message.range <= message.max_range
    assert message.header.frame_id
    erased = robot.trigger('erase')
    assert (erased.success, erased['level']) == (True, BLANK)
    assert robot.trigger('read')['level'] == BLANK
    robot.latest('level', lambda level: level.data == BLANK)
    robot.latest('range', lambda message: message.range == math.inf)


def test_field_and_wall_are_the_simulated_truth(robot, driver):
    if driver != 'sim':
        pytest.skip('a real element does not tell where its wall is')
    robot.received('field'), robot.received('wall')
    level = robot.write(5)['level']
    wall = robot.next('wall')
    (position,) = wall.data
    assert position == pytest.approx(site(level), abs=3.0)  # pinned within the width of the wall
    field = robot.next('field')
    assert len(field.data) == CELLS
    assert all(map(math.isfinite, field.data))
    # One of the two phases on either side of the wall, far from it.
    left, right = field.data[50], field.data[200]
    assert abs(right - left) > 0.5
    assert field.data[100] == pytest.approx(left, abs=0.1 * abs(right - left))
    assert field.data[180] == pytest.approx(right, abs=0.1 * abs(right - left))


def strain_of(robot):
    """Return the strain from the last joint state: displacement of the end over length."""
    state = robot.latest('joint_states')
    return state.position[state.name.index('substrate')] / LENGTH


def strain_is(robot, strain):
    return abs(strain_of(robot) - strain) < 1e-6


def test_strain_follows_set_points_and_trajectories(robot):
    """At 10 us per time unit the limit is 10/s."""
    for strain in (0.01, -0.01, 0.0):
        robot.publish('strain', data=strain)
        robot.wait(functools.partial(strain_is, robot, strain), f'a strain of {strain}')
    state = robot.latest('joint_states')
    assert sorted(state.name) == ['substrate', 'transducer']
    assert [len(state.position), len(state.velocity)] == [2, 2]
    assert math.isfinite(state.effort[state.name.index('substrate')])
    robot.follow((10, 0.02), (1000, 0.02), (1020, -0.01))  # long enough for a busy machine
    robot.wait(lambda: strain_is(robot, 0.02), 'the first strain, which is held')
    robot.wait(lambda: strain_is(robot, -0.01), 'the last strain')
    robot.follow((20, 0.0, 0.0))
    robot.wait(lambda: strain_is(robot, 0.0), 'no strain')


def test_pause_holds_time_and_step_makes_one_tick(robot):
    assert strain_of(robot) == pytest.approx(0.0, abs=1e-6)
    refused = robot.count_refused()
    assert not robot.trigger('step').success  # time runs
    assert robot.count_refused() == refused + 1
    with robot.paused():
        robot.publish('strain', data=0.06)  # takes 600 time units, 30 ticks
        ticks = []

        def moved():  # joint states come every few ticks
            ticks.append(robot.trigger('step')['tick'])
            return abs(strain_of(robot)) > 1e-6

        robot.wait(moved, 'a joint state with another strain')
        assert ticks == list(range(ticks[0], ticks[-1] + 1))
        most = 1.125 * len(ticks) / 30  # of a smooth ramp x^2 (3 - 2 x), after so many ticks
        assert 0.0 < strain_of(robot) <= 0.06 * min(most, 1.0) + 1e-9
    robot.wait(lambda: strain_is(robot, 0.06), 'the strain after the pause')
    robot.publish('strain', data=0.0)
    robot.wait(lambda: strain_is(robot, 0.0), 'no strain')


def test_driving_during_a_write_is_rejected_until_abort(start_shared):
    """The write, by strain, takes more than a second; a strain of 0.07 is above all of its own."""
    given = {'write.method': 'strain', 'scale.time': 4e-4, 'publish.joint_states_every': 10}
    with Robot(start_shared(given, name='real_time').element) as robot:
        answer, states = robot.begin_strained_write(1), robot.received('joint_states')
        robot.publish('strain', data=0.07)
        robot.publish('probe')
        robot.publish('write_level', data=5)
        robot.get('target_level')  # when it is answered, the topics have been received
        assert not answer.done()
        assert robot.trigger('abort').success
        written = robot.answer(answer)
        assert not written.success
        assert 'abort' in written['error']
        robot.wait(lambda: strain_is(robot, 0.0), 'no strain after the abort')
        assert max(state.position[0] for state in states) < 0.06 * LENGTH
        robot.set(time__speed=40.0)
        assert robot.write(1)['level'] == 1  # it still works, whatever state the abort left
