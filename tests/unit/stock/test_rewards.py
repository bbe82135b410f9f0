"""Sums of rewards."""

from __future__ import annotations

from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Autonomy, Publish
from tussle.messages import RewardGiven
from tussle.stock import Boundary, EnforceBoundaryInteraction, OpenAIRewards, Still


class Earns(Autonomy):
    """Each entity earns its id in every second step."""

    rewards = Publish(RewardGiven)

    def step(self, g):
        rows = g.step_count % 2 == 0
        self.rewards.publish(rows, entity=g.id[rows], team=g.team[rows], reward=0.5 * g.id[rows])


def test_rewards_are_summed_by_team_and_by_entity():
    far = block("far", team=2, position=(99, 0, 0), autonomy=Earns(), motion=Still())
    game = mission(
        block("near", team=1, count=2, autonomy=Earns(), motion=Still()), far,
        interactions=[Boundary(boundary_id=1), EnforceBoundaryInteraction(active_boundary_ids=(1,))], metrics=[OpenAIRewards()],
    )  # fmt: skip
    sim = Simulation(game, seeds=[1, 2])
    result = sim.run()[0]
    # Five times 0.5 and 1; the third is removed in its first step, whose reward counts.
    assert result.metrics == {"OpenAIRewards": {"reward": {1: 7.5, 2: 1.5}}}
    assert result.scores == {}
    assert sim.read("OpenAIRewards.reward")[0].shape[0] == 2
