"""RLSimple and RLConsensus play with actors of SCRIMMAGE's Python interface."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import MissionError, ParameterError, PluginError
from tussle.mission import read_mission, to_xml
from tussle.plugins.stock.autonomy.rl_simple import adapted
from tussle.stock import (
    OpenAIRewards,
    RLConsensus,
    RLConsensusSensor,
    RLSimple,
    RLSimpleSensor,
    SingleIntegrator,
)

ACTORS = """
class Homing:
    def __init__(self, space, params):
        self.space, self.gain, self.calls = space, float(params["radius"]) / 4, 0

    def act(self, observation):
        x, t = observation
        assert t == self.calls, (t, self.calls)
        self.calls += 1
        return int(x < 0), [-self.gain]

def actor_init_func(action_space, obs_space, params):
    assert obs_space.shape == (2,)
    assert action_space[1].high == 10
    return Homing(action_space, params)

def northward(action_space, obs_space, params):
    return lambda observation: (1, 99.0)

def nothing(action_space, obs_space, params):
    return None
"""
MISSION = """<runscript><run end="8" dt="1"/><metrics>OpenAIRewards</metrics>
<entity><team_id>1</team_id><x>6</x><motion_model>SingleIntegrator</motion_model>
<controller>SingleIntegratorControllerSimple</controller><sensor order="0">RLSimpleSensor</sensor>
<autonomy x_discrete="true" ctrl_y="true" max_speed="10" MORE>RLSimple</autonomy></entity></runscript>"""


@pytest.fixture
def game(tmp_path):
    """Read the mission with the actors of a file."""

    def read(more="", files=("actors.py",)):
        (tmp_path / "actors.py").write_text(ACTORS)
        (tmp_path / "m.xml").write_text(MISSION.replace("MORE", more))
        return read_mission(tmp_path / "m.xml", plugin_files=[tmp_path / file for file in files]).mission

    return read


def played(mission):
    """Positions along x and y at the end, and the rewards."""
    with Simulation(mission) as sim:
        result = sim.run()[0]
        pos = sim.read(f"{mission.blocks[0].name}.pos")[0]
    return [float(pos[0, 0, 0]), float(pos[0, 0, 1])], result.metrics["OpenAIRewards"]["reward"][1]


def test_the_actor_of_a_plugin_file_moves_the_robot(game, tmp_path):
    pytest.importorskip("gymnasium")
    # It observes x = 6, 5, ..., -1, of which 1, 0 and -1 are near.
    assert played(game()) == ([0.0, -4.0], 3.0)
    assert played(game('module="actors" actor_init_func="northward"'))[0] == [14.0, 80.0]
    (tmp_path / "again.xml").write_text(to_xml(game(), 1))
    again = read_mission(tmp_path / "again.xml", plugin_files=[tmp_path / "actors.py"]).mission
    assert played(again) == played(game())


def test_without_an_actor_it_goes_to_and_fro(game):
    assert played(game(files=())) == ([6.0, 0.0], 0.0)
    assert played(game('radius="8"', files=())) == ([6.0, 0.0], 8.0)
    assert played(game('radius="7"', files=())) == ([6.0, 0.0], 4.0)


def test_a_mission_names_no_code(game):
    with pytest.raises(
        MissionError, match="no plugin file has a function 'fly' whose first parameter is action_space"
    ):
        game('module="actors" actor_init_func="fly"', files=())
    with pytest.raises(
        MissionError, match=r"RLSimple.module = 'actors': a mission names no code; .*--plugin-path"
    ):
        game('module="actors"', files=())
    with pytest.raises(MissionError, match="did you mean 'northward'"):
        game('actor_init_func="northwards"')


def test_wrong_actors_and_actions_are_told(game):
    with pytest.raises(PluginError, match="nothing returned 'None'; it returns a callable"):
        played(game('actor_init_func="nothing"'))
    with pytest.raises(PluginError, match=r"northward chose .*; an action has 1 finite numbers"):
        played(one_number())


def one_number():
    """A game of one number, whose actor gives two."""

    def northward(action_space, obs_space, params):
        return lambda observation: (1, 2.0)

    block = Block(
        name="a",
        team=1,
        autonomy=adapted(RLSimple, northward)(),
        sensor=RLSimpleSensor(),
        motion=SingleIntegrator(),
    )
    return Mission(blocks=[block], end=3, dt=1, metrics=[OpenAIRewards()])


def test_a_snapshot_has_the_actors(game):
    with Simulation(game(), seeds=[1, 2]) as sim:
        sim.step(3)
        snapshot = sim.snapshot()
        sim.step(4)
        wanted = sim.state_hash()
        sim.restore(snapshot)
        sim.step(4)
        assert sim.state_hash() == wanted


def consensus(seen, **values):
    """A game of four robots at x = 0, 1, 1.5, 9, whose actors keep what they see."""

    def actor_init(action_space, obs_space, params):
        def act(observation):
            seen.append(observation.tolist())
            return [0.0]

        return act

    blocks = [
        Block(
            name=f"r{i}", team=i, position=(x, 0, 0), sensor=RLConsensusSensor(include_id=i == 2), motion=SingleIntegrator(),
            autonomy=adapted(RLConsensus, actor_init)(x_discrete=False, **values),
        )
        for i, x in enumerate([0.0, 1.0, 1.5, 9.0], start=1)
    ]  # fmt: skip
    return Mission(blocks=blocks, end=1, dt=1, metrics=[OpenAIRewards()])


def test_consensus_rewards_the_share_of_near_others():
    seen = []
    result = Simulation(consensus(seen, radius=1.25, reward_type="others")).run()[0]
    assert result.metrics["OpenAIRewards"]["reward"] == {1: 0.25, 2: 0.5, 3: 0.25, 4: 0.0}
    assert seen == [[0, 1, 1.5, 9], [2, 0, 1, 1.5, 9], [0, 1, 1.5, 9], [0, 1, 1.5, 9]]
    result = Simulation(consensus([], radius=2)).run()[0]
    assert result.metrics["OpenAIRewards"]["reward"] == {1: 1, 2: 1, 3: 0, 4: 0}


def test_robots_of_other_worlds_are_not_near():
    with Simulation(consensus([], radius=1.25, reward_type="others"), seeds=[1, 2, 3]) as sim:
        results = sim.run()
    assert all(result.metrics["OpenAIRewards"]["reward"][2] == 0.5 for result in results)


def test_a_block_without_living_robots_observes_nothing():
    with Simulation(consensus([]).replace(end=3)) as sim:
        sim.step()
        sim.write("r2.health", [[0.0]])
        sim.step(2)
        assert sim.read("r1.RLConsensusSensor.observation")[0][0, 0].size == 3


def test_modules_of_missions_are_those_of_the_plugin(game):
    with pytest.raises(ParameterError, match="names no code"):
        RLConsensus(module="mine")
    assert np.isclose(RLSimple().max_speed, 10)
