"""Those who hold a formation keep their places behind a leader."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.mission import read_mission
from tussle.stock import AltitudeAboveTerrain, GoTo, HoldFormation, SingleIntegrator


def flight(n=4, leaders=1, **values):
    lead = Block(
        name="lead", team=2, count=leaders, position=(0, 0, 50), placement="uniform", half_width=(0, 80, 0), scatter_first=leaders > 1,
        autonomy=GoTo(waypoints=((0, 1000, 50),), speed=5.0), motion=SingleIntegrator(),
    )  # fmt: skip
    wing = Block(
        name="wing", team=1, count=n, position=(0, -40, 50), placement="uniform", half_width=(60, 30, 10), scatter_first=True,
        autonomy=HoldFormation(**{"spacing": 10.0, "gain": 0.5, "max_speed": 12.0, **values}), motion=SingleIntegrator(),
        sensor=AltitudeAboveTerrain(altitude_noise=(0.0, 0.0)),
    )  # fmt: skip
    return Mission(blocks=[lead, wing], dt=0.1, end=100)


def offsets(simulation):
    """Offsets of the wings to the first leader, (n, 3)."""
    return simulation.read("wing.pos")[0][0] - simulation.read("lead.pos")[0][0, 0]


@pytest.mark.parametrize(
    ("shape", "places"),
    [
        ("vee", [(-10, -10), (10, -10), (-20, -20), (20, -20)]),
        ("line", [(-10, 0), (10, 0), (-20, 0), (20, 0)]),
        ("column", [(0, -10), (0, -20), (0, -30), (0, -40)]),
    ],
)
def test_places_are_taken_in_the_order_of_ids(shape, places):
    """The leader flies north: the first place of a vee is behind it to the left, in the west."""
    with Simulation(flight(shape=shape), 1) as simulation:
        simulation.step(400)
        assert np.allclose(offsets(simulation), [(*place, 0) for place in places], atol=0.05)


def test_who_is_left_closes_up():
    with Simulation(flight(), 1) as simulation:
        simulation.step(300)
        simulation.write("wing.health", [[0.0, 1.0, 1.0, 1.0]])
        simulation.step(300)
        assert np.allclose(offsets(simulation)[1:, :2], [(-10, -10), (10, -10), (-20, -20)], atol=0.05)


def test_who_loses_its_leader_joins_the_next_and_none_flies_on():
    with Simulation(flight(leaders=3), seeds=[1, 2]) as simulation:
        simulation.step(10)
        pos, wings = simulation.read("lead.pos")[0], simulation.read("wing.pos")[0]
        nearest = np.argmin(np.linalg.norm(wings[:, :, None] - pos[:, None], axis=-1), axis=-1) + 1
        assert simulation.read("wing.HoldFormation.leader")[0].tolist() == nearest.tolist()
        simulation.write("lead.health", [[0.0, 1.0, 1.0], [0.0, 0.0, 0.0]])
        simulation.step(3)
        leader = simulation.read("wing.HoldFormation.leader")[0]
        assert set(leader[0].tolist()) <= {2, 3}
        assert set(leader[1].tolist()) == {0}
        assert np.isfinite(simulation.read("wing.vel")[0]).all()


def test_the_terrain_is_kept_clear_of():
    with Simulation(flight(clearance=70.0), 1) as simulation:
        simulation.step(2)  # the altimeter measures at the end of a step
        assert np.allclose(simulation.read("wing.HoldFormation.desired_altitude")[0], 70.0)


@pytest.mark.slow
def test_aircraft_hold_their_formations_over_hills():
    mission = read_mission(
        "formation_flight", {"leaders": 5, "wings": 30, "end": 300, "spacing": 25}, strict=True
    ).mission
    with Simulation(mission, 2) as simulation:
        simulation.run()
        wings, lead = simulation.read("wings.pos")[0][0], simulation.read("leaders.pos")[0][0]
        leader = simulation.read("wings.HoldFormation.leader")[0][0]
        height = simulation.read("wings.AltitudeAboveTerrain.true_altitude_above_terrain")[0][0]
    for id in set(leader.tolist()):  # noqa: A001 - as everywhere
        behind = wings[leader == id] - lead[id - 1]
        rank = np.arange(len(behind))
        row, side = rank // 2 + 1, 1 - 2 * (rank % 2)
        assert np.abs(behind[:, 0] + 25.0 * row).max() < 20.0
        assert np.abs(behind[:, 1] - 25.0 * row * side).max() < 15.0
    assert height.min() > 40.0
