"""Branches of missions that ship: the same up to their step, other luck after it, and the same bits in any stack."""

from __future__ import annotations

import pytest

from tussle import Simulation
from tussle.mission import read_mission, to_xml

STEP, KEY = 12, 2**63 + 5
MISSIONS = {
    "predator_prey": {"prey": 15, "run.end": 4},
    "capture_the_flag": {"run.end": 4},
    "boundary_defense": {"run.end": 4},
    "NoisyState": {"run.end": 4},
    "RandomAttrit": {"run.end": 12},
}
RANDOM = ("NoisyState",)


def hashes(sim, world):
    """State hashes of a world at the start of each step."""
    found = []
    sim.observers.append(lambda s: found.append(s.state_hash(world)))
    sim.run()
    return [*found, sim.state_hash(world)]


@pytest.mark.parametrize("name", MISSIONS)
def test_a_branch_of_a_shipped_mission(name, tmp_path):
    mission = read_mission(name, MISSIONS[name]).mission
    whole = hashes(Simulation(mission, 3), 0)
    stack = Simulation(mission, [9, 8, 7], threads=2)
    stack.reset([2, 0], [3, 3], rekeys=[((STEP, KEY),), ((STEP, KEY), (STEP + 9, 1))])
    branched = hashes(stack, 2)
    file = tmp_path / "branch.xml"
    file.write_text(to_xml(mission.replace(rekeys=((STEP, KEY),)), 3))
    again = read_mission(file)
    assert hashes(Simulation(again.mission, again.seed), 0) == branched
    assert branched[: STEP + 1] == whole[: STEP + 1]
    if name in RANDOM:  # the others draw only their start within so few steps
        assert len({branched[-1], stack.state_hash(0), whole[-1]}) == 3
