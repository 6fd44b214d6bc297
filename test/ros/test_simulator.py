# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulator's tools over real DDS: clients of the standard simulation_interfaces."""

import pytest

from mlmem_ros.ros.node import simulator

if simulator.load_types() is None:
    pytest.skip('simulation_interfaces is not built: make interfaces', allow_module_level=True)

from action_msgs.msg import GoalStatus
from nodes import starting
from rclpy.action import ActionClient
from robot import EVERY_ONE, Robot
from simulation_interfaces import action, srv
from simulation_interfaces.msg import EntityFilters, Result, SimulationState, SimulatorFeatures

STOPPED, PLAYING = SimulationState.STATE_STOPPED, SimulationState.STATE_PLAYING
PAUSED, NO_WORLD = SimulationState.STATE_PAUSED, SimulationState.STATE_NO_WORLD
OK, FAILED = Result.RESULT_OK, Result.RESULT_OPERATION_FAILED
ALREADY = srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE
NOT_REACHED = srv.SetSimulationState.Response.STATE_TRANSITION_ERROR

STREAMED = {'publish.field_every': 1, 'publish.wall_every': 1}


class Tool:
    """What a simulator's user has: a client of each service, in the node of a robot."""

    def __init__(self, robot):
        self.robot = robot

    def call(self, kind, name, **request):
        client = self.robot.node.create_client(kind, self.robot.name(name))
        try:
            self.robot.wait(client.service_is_ready, name)
            future = client.call_async(kind.Request(**request))
            return self.robot.wait(lambda: future.done() and future.result(), 'an answer')
        finally:
            self.robot.node.destroy_client(client)

    @property
    def state(self):
        return self.call(srv.GetSimulationState, 'get_simulation_state').state.state

    def set(self, state):
        wanted = SimulationState(state=state)
        return self.call(srv.SetSimulationState, 'set_simulation_state', state=wanted).result

    def step(self, steps=1):
        return self.call(srv.StepSimulation, 'step_simulation', steps=steps).result

    def reset(self, scope=0):
        return self.call(srv.ResetSimulation, 'reset_simulation', scope=scope).result


@pytest.fixture(scope='module')
def given():
    return {'element': 'bits_1', 'actions': True, **STREAMED}


@pytest.fixture
def tool(memory):
    """A tool of the module's element, whose time runs."""
    with Robot(memory.element) as robot:
        tool = Tool(robot)
        tool.set(PLAYING)
        yield tool


def ticks(tool):
    """The number of ticks so far, as `~/pause` answers it."""
    return tool.robot.pause(True)['tick']


def test_features_list_what_the_node_serves(tool):
    features = tool.call(srv.GetSimulatorFeatures, 'get_simulator_features').features
    assert {*features.features} == {
        SimulatorFeatures.SIMULATION_RESET,
        SimulatorFeatures.SIMULATION_STATE_GETTING,
        SimulatorFeatures.SIMULATION_STATE_SETTING,
        SimulatorFeatures.SIMULATION_STATE_PAUSE,
        SimulatorFeatures.STEP_SIMULATION_SINGLE,
        SimulatorFeatures.STEP_SIMULATION_MULTIPLE,
        SimulatorFeatures.STEP_SIMULATION_ACTION,
    }


def test_entities_are_the_elements_of_the_process(tool):
    answer = tool.call(srv.GetEntities, 'get_entities')
    assert (answer.result.result, answer.entities) == (OK, [tool.robot.name('')[:-1]])


def test_entities_with_a_filter_are_rejected(tool):
    answer = tool.call(srv.GetEntities, 'get_entities', filters=EntityFilters(filter='(a+)+$'))
    assert (answer.result.result, answer.entities) == (Result.RESULT_FEATURE_UNSUPPORTED, [])


def test_simulation_state_pauses_plays_and_stops(tool):
    assert tool.state == PLAYING
    assert tool.set(PLAYING).result == ALREADY
    assert (tool.set(PAUSED).result, tool.state) == (OK, PAUSED)
    assert (tool.set(STOPPED).result, tool.state) == (OK, STOPPED)
    assert (tool.set(PAUSED).result, tool.state) == (OK, PAUSED)
    assert ticks(tool) == 0  # no step of physics since the launch
    assert (tool.set(PLAYING).result, tool.state) == (OK, PLAYING)
    assert tool.set(SimulationState.STATE_QUITTING).result == Result.RESULT_FEATURE_UNSUPPORTED


def test_reset_forgets_state_and_time(tool):
    assert tool.robot.write(1).success
    tool.set(PAUSED)
    before = ticks(tool)
    assert before > 0
    assert (tool.reset().result, tool.state, ticks(tool)) == (OK, PAUSED, 0)
    tool.set(PLAYING)
    assert tool.robot.answer(tool.robot.send('read'))['level'] == -1
    only_time = tool.reset(srv.ResetSimulation.Request.SCOPE_TIME)
    assert only_time.result == Result.RESULT_FEATURE_UNSUPPORTED
    assert 'together' in only_time.error_message


def test_steps_are_answered_after_their_events(tool):
    """In lockstep the next node may act on them: a message is on its way before the answer."""
    robot = tool.robot
    robot.next('field')  # from now on it hears all of them
    tool.set(PAUSED)
    begun, seen = ticks(tool), len(robot.received('field'))
    assert tool.step(8).result == OK  # no more than a subscriber's queue holds
    assert len(robot.received('field')) == seen + 8
    assert ticks(tool) == begun + 8


def test_steps_while_playing_are_rejected(tool):
    assert (tool.step().result, tool.step().error_message) == (
        FAILED,
        'step works only while paused; pause first',
    )
    tool.set(PAUSED)
    assert (tool.step(0).result, tool.step(0).error_message) == (
        FAILED,
        'steps must be at least 1',
    )


def test_write_in_lockstep_is_the_same_after_a_reset(tool):
    """The element, its noise and its time begin as they did."""
    robot, outcomes = tool.robot, []
    tool.set(PAUSED)
    for _ in range(2):
        assert tool.reset().result == OK
        writing = robot.ask('write', level=1)
        while not writing.done():
            assert tool.step(20).result == OK
        outcomes.append(dict(robot.answer(writing)))
    assert outcomes[0]['level'] == 1
    assert outcomes[0] == outcomes[1]


class Stepping:
    """rclpy's client of the action, as any tool has it, beside all feedback: the client drops what
    it takes after the end.
    """

    def __init__(self, tool):
        self.robot = tool.robot
        self.client = ActionClient(
            self.robot.node, action.SimulateSteps, self.robot.name('simulate_steps')
        )
        self.robot.wait(self.client.server_is_ready, 'the action')
        self.said = []
        self.robot.node.create_subscription(
            action.SimulateSteps.Impl.FeedbackMessage,
            self.robot.name('simulate_steps/_action/feedback'),
            self.said.append,
            EVERY_ONE,
        )

    def send(self, steps):
        goal = action.SimulateSteps.Goal(steps=steps)
        return self.robot.response(self.client.send_goal_async(goal))

    def all_told(self, handle, steps):
        """Return the numbers of steps done and left that a goal has told, once that is all."""
        told = [each.feedback for each in self.said if each.goal_id == handle.goal_id]
        counts = [(each.completed_steps, each.remaining_steps) for each in told]
        return counts if len(counts) >= steps else None

    def result(self, handle):
        ended = self.robot.response(handle.get_result_async())
        return ended.status, ended.result.result.result


@pytest.fixture
def stepping(tool):
    tool.set(PAUSED)
    stepping = Stepping(tool)
    yield stepping
    stepping.client.destroy()


def test_step_action_reports_every_step(stepping, tool):
    while not stepping.said:  # until feedback finds its way
        stepping.result(stepping.send(1))
    begun = ticks(tool)
    handle = stepping.send(8)
    assert stepping.result(handle) == (GoalStatus.STATUS_SUCCEEDED, OK)
    told = stepping.robot.wait(lambda: stepping.all_told(handle, 8), 'all feedback')
    assert told == [(done, 8 - done) for done in range(1, 9)]
    assert ticks(tool) == begun + 8


@pytest.mark.parametrize('ended', ['canceled', 'paused', 'resumed'])
def test_steps_end_early_when_canceled_paused_or_resumed(stepping, tool, ended):
    handle = stepping.send(2**63)
    stepping.robot.wait(lambda: stepping.said, 'the first step')
    if ended == 'canceled':
        stepping.robot.response(handle.cancel_goal_async())
        assert stepping.result(handle) == (GoalStatus.STATUS_CANCELED, FAILED)
    else:
        assert tool.set(PLAYING if ended == 'resumed' else PAUSED).result == OK
        assert stepping.result(handle) == (GoalStatus.STATUS_ABORTED, FAILED)
    assert tool.state == (PLAYING if ended == 'resumed' else PAUSED)
    if ended != 'resumed':
        before = ticks(tool)
        assert ticks(tool) == before


def test_real_element_is_not_reset():
    """To stop a simulation is to forget; what is real forgets by an erase alone."""
    with starting('rig') as start, Robot(start(name='real').element) as robot:
        tool = Tool(robot)
        features = tool.call(srv.GetSimulatorFeatures, 'get_simulator_features').features
        assert SimulatorFeatures.SIMULATION_RESET not in features.features
        for refused, code in ((tool.reset(), FAILED), (tool.set(STOPPED), NOT_REACHED)):
            assert refused.result == code
            assert refused.error_message == 'a real element cannot be reset; erase it'
        assert tool.state == PLAYING
