# Copyright 2026 The mlmem_ros authors
# SPDX-License-Identifier: Apache-2.0
"""A simulator's tools over real DDS: clients of the standard simulation_interfaces."""

import pytest

pytest.importorskip('simulation_interfaces', reason='it is not built: make interfaces')

from lines import LocalDriver
from robot import Robot
from simulation_interfaces import srv
from simulation_interfaces.msg import EntityFilters, Result, SimulationState, SimulatorFeatures

STOPPED, PLAYING = SimulationState.STATE_STOPPED, SimulationState.STATE_PLAYING
PAUSED, NO_WORLD = SimulationState.STATE_PAUSED, SimulationState.STATE_NO_WORLD
OK, FAILED = Result.RESULT_OK, Result.RESULT_OPERATION_FAILED
UNSUPPORTED = Result.RESULT_FEATURE_UNSUPPORTED
ALREADY = srv.SetSimulationState.Response.ALREADY_IN_TARGET_STATE
NOT_REACHED = srv.SetSimulationState.Response.STATE_TRANSITION_ERROR


class Tool(Robot):
    """What a simulator's user has: a client of each service."""

    @property
    def simulation_state(self):
        return self.call('get_simulation_state', srv.GetSimulationState).state.state

    @property
    def features(self):
        answer = self.call('get_simulator_features', srv.GetSimulatorFeatures)
        return set(answer.features.features)

    @property
    def ticks(self):
        """The number of ticks so far, as `~/pause` answers it."""
        return self.pause(True)['tick']

    def simulate(self, state):
        state = SimulationState(state=state)
        return self.call('set_simulation_state', srv.SetSimulationState, state=state).result.result

    def step(self, steps=1):
        return self.call('step_simulation', srv.StepSimulation, steps=steps).result.result

    def reset(self, scope=0):
        return self.call('reset_simulation', srv.ResetSimulation, scope=scope).result.result


GIVEN = {'element': 'bits_1', 'publish.field_every': 1, 'publish.wall_every': 1}


@pytest.fixture
def tool(memory):
    """A tool of the module's element, whose time runs."""
    with Tool(memory.element) as tool:
        tool.simulate(PLAYING)
        yield tool


def test_features_list_what_the_node_serves(tool):
    assert tool.features == {
        SimulatorFeatures.SIMULATION_RESET,
        SimulatorFeatures.SIMULATION_STATE_GETTING,
        SimulatorFeatures.SIMULATION_STATE_SETTING,
        SimulatorFeatures.SIMULATION_STATE_PAUSE,
        SimulatorFeatures.STEP_SIMULATION_SINGLE,
        SimulatorFeatures.STEP_SIMULATION_MULTIPLE,
    }


def test_entities_are_listed_but_not_filtered(tool):
    for text, expected in (('', (OK, [tool.element])), ('(a+)+$', (UNSUPPORTED, []))):
        answer = tool.call('get_entities', srv.GetEntities, filters=EntityFilters(filter=text))
        assert (answer.result.result, answer.entities) == expected


def test_simulation_state_pauses_plays_and_stops(tool):
    assert tool.simulation_state == PLAYING
    assert tool.simulate(PLAYING) == ALREADY
    for state in (PAUSED, STOPPED, PAUSED):
        assert (tool.simulate(state), tool.simulation_state) == (OK, state)
    assert tool.ticks == 0  # no step of physics since the launch
    assert (tool.simulate(PLAYING), tool.simulation_state) == (OK, PLAYING)
    assert tool.simulate(SimulationState.STATE_QUITTING) == UNSUPPORTED


def test_reset_forgets_state_and_time(tool):
    assert tool.write(1).success
    assert tool.ticks > 0
    assert (tool.reset(), tool.simulation_state, tool.ticks) == (OK, PAUSED, 0)
    tool.simulate(PLAYING)
    assert tool.trigger('read')['level'] == -1
    assert tool.reset(srv.ResetSimulation.Request.SCOPE_TIME) == UNSUPPORTED


def test_steps_are_answered_after_their_events(tool):
    """In lockstep the next node may act on them: a message is on its way before the answer."""
    tool.next('field')  # from now on it hears all of them
    tool.simulate(PAUSED)
    begun, seen = tool.ticks, len(tool.received('field'))
    assert tool.step(8) == OK  # no more than a subscriber's queue holds
    assert len(tool.received('field')) == seen + 8
    assert tool.ticks == begun + 8


def test_steps_while_playing_or_none_are_rejected(tool):
    assert tool.step() == FAILED
    tool.simulate(PAUSED)
    assert tool.step(0) == FAILED
    assert tool.step() == OK


def test_write_in_lockstep_is_the_same_after_a_reset(tool):
    """The element, its noise and its time begin as they did."""
    outcomes = []
    tool.simulate(PAUSED)
    for _ in range(2):
        assert tool.reset() == OK
        writing = tool.request('write', level=1)
        while not writing.done():
            assert tool.step(20) == OK
        outcomes.append(dict(tool.answer(writing)))
    assert outcomes[0]['level'] == 1
    assert outcomes[0] == outcomes[1]


class Bench(LocalDriver):
    """What a laboratory has, as far as the node knows."""

    def __init__(self, design, *_):
        super().__init__(design)


def test_real_element_is_not_reset(start):
    """To stop a simulation is to forget; what is real forgets by an erase alone."""
    node = start({'device.driver': f'{__name__}:Bench'}, name='real')
    with Tool(node.element) as tool:
        assert SimulatorFeatures.SIMULATION_RESET not in tool.features
        assert (tool.reset(), tool.simulate(STOPPED)) == (FAILED, NOT_REACHED)
        assert tool.simulation_state == PLAYING
