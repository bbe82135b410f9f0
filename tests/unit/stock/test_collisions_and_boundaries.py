"""Collisions and regions, by small cases computed by hand."""

from __future__ import annotations

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Metric, State, Subscribe
from tussle.messages import BoundaryCrossed, BoundaryShape, EntityCollided
from tussle.stock import Boundary, EnforceBoundaryInteraction, SimpleCollision


class Log(Metric):
    """Collisions told: how many, and the last pair."""

    n = State(dtype=int, per="world")
    first = State(dtype=int, per="world")
    second = State(dtype=int, per="world")

    def step(self, w):
        told = w.inbox(EntityCollided)
        np.add.at(self.n, told.world, 1)
        self.first[told.world], self.second[told.world] = told.first, told.second


class Crossings(Metric):
    """Entries into boundaries."""

    entries = State(dtype=int, per="world")

    def step(self, w):
        told = w.inbox(BoundaryCrossed)
        np.add.at(self.entries, told.world[told.inside], 1)


def meet(*entities, **referee):
    """Entities of (x, speed in x, team)."""
    referee.setdefault("startup_collision_range", 0.0)
    blocks = [
        block(f"e{i}", team=team, position=(x, 0, 0), autonomy=Drift(to=(v, 0, 0)))
        for i, (x, v, team) in enumerate(entities)
    ]
    return mission(*blocks, interactions=[SimpleCollision(**referee)], metrics=[Log()], end_conditions="time")


def left(game):
    sim = Simulation(game)
    sim.run()
    return [bool(sim.read(f"{b.name}.pos")[1][0, 0]) for b in game.blocks], sim


def test_two_that_come_nearer_than_the_range_are_gone():
    sim = Simulation(meet((0.0, 10.0, 1), (10.0, -10.0, 2)))
    while not sim.is_over and sim.result()[0].alive == {1: 1, 2: 1}:
        sim.step()
    # 10 m apart, 2 m a step nearer: 2 m after four steps is not below 2 m; 0 m after five is.
    assert sim.steps[0] == 5
    assert sim.read("Log.n")[0].tolist() == [1]
    assert (sim.read("Log.first")[0][0], sim.read("Log.second")[0][0]) == (1, 2)


@pytest.mark.parametrize("removes", [False, True])
@pytest.mark.parametrize("shape", ["cylinder", "polygon"])
def test_a_no_fly_volume_reports_who_enters_and_removes_them_if_asked(shape, removes):
    """Between z = 10 m and 30 m: above, below and beside it one may fly."""
    starts = {"in": (-30, 0, 20), "above": (-30, 0, 31), "below": (-30, 0, 9), "beside": (-30, 10.1, 20)}
    blocks = [block(name, position=pos, autonomy=Drift(to=(10, 0, 0))) for name, pos in starts.items()]
    square = ((-10, -10), (10, -10), (10, 10), (-10, 10))
    volume = Boundary(
        boundary_id=7, shape=shape, center=(0, 0, 20), lengths=(1, 1, 20), radius=10, polygon_points=square
    )
    rule = EnforceBoundaryInteraction(active_boundary_ids=(), no_fly_boundary_ids=(7,))
    game = mission(
        *blocks, interactions=[volume, rule] if removes else [volume], metrics=[Crossings()], end=6.0, end_conditions="time"
    )  # fmt: skip
    alive, sim = left(game)
    assert alive == [not removes, True, True, True]
    assert sim.read("Crossings.entries")[0].tolist() == [1]
    assert volume.region().contains(np.array([[9.9, 0, 20.0], [0, 0, 30.1], [0, 10.1, 20]]).T).tolist() == [
        True,
        False,
        False,
    ]


def test_the_range_is_strict():
    assert left(meet((0.0, 0.0, 1), (2.0, 0.0, 2)))[0] == [True, True]
    assert left(meet((0.0, 0.0, 1), (1.999999, 0.0, 2)))[0] == [False, False]


def test_all_pairs_of_a_cluster_count():
    alive, _ = left(meet((0.0, 0.0, 1), (1.5, 0.0, 2), (3.0, 0.0, 3), (9.0, 0.0, 4)))
    assert alive == [False, False, False, True]


def test_switches_for_team_mates_and_others():
    three = [(0.0, 0.0, 1), (1.0, 0.0, 1), (10.0, 0.0, 1), (11.0, 0.0, 2)]
    assert left(meet(*three))[0] == [False] * 4
    assert left(meet(*three, enable_team_collisions=False))[0] == [True, True, False, False]
    assert left(meet(*three, enable_non_team_collisions=False))[0] == [False, False, True, True]


def test_at_the_start_only():
    game = meet((0.0, 0.0, 1), (1.0, 0.0, 2), (10.0, 10.0, 1), (19.0, 0.0, 2), startup_collisions_only=True)
    assert left(game)[0] == [False, False, True, True]


def test_those_that_overlap_at_the_start_are_gone_before_the_first_step():
    sim = Simulation(meet((0.0, 0.0, 1), (1.0, 0.0, 2), (50.0, 0.0, 3)))
    assert sim.result()[0].alive == {1: 0, 2: 0, 3: 1}


def test_room_in_height_alone():
    crowd = block("a", count=6, placement="uniform", half_width=(0, 0, 30))
    deep = Simulation(
        mission(
            crowd,
            interactions=[
                SimpleCollision(init_alt_deconflict=True, startup_collision_range=3.0, collision_range=0.0)
            ],
        )
    )
    z = np.sort(deep.read("a.pos")[0][0, :, 2])
    assert np.diff(z).min() >= 3.0


class Fence(Metric):
    """Who crossed: sum of ids that went out, and in."""

    went_out = State(dtype=int, per="world")
    went_in = State(dtype=int, per="world")
    number = State(dtype=int, per="world")

    def step(self, w):
        told = w.inbox(BoundaryCrossed)
        np.add.at(self.went_out, told.world[~told.inside], told.entity[~told.inside])
        np.add.at(self.went_in, told.world[told.inside], told.entity[told.inside])
        self.number[told.world] = told.boundary


@pytest.mark.parametrize(
    ("region", "out", "into"),
    [
        ({"shape": "cuboid", "lengths": (2.0, 2.0, 2.0)}, 1, 2),
        ({"shape": "sphere", "radius": 1.0}, 1, 2),
        ({"shape": "plane", "center": (1.0, 0, 0), "normal": (1.0, 0, 0)}, 1, 2),
        ({"shape": "sphere", "radius": 100.0}, 0, 0),
    ],
)
def test_crossings_are_told_once_with_direction(region, out, into):
    game = mission(
        block("a", autonomy=Drift(to=(3.0, 0, 0))),  # from 0 to 3: out at 1
        block("b", position=(3.0, 0, 0), autonomy=Drift(to=(-2.6, 0, 0))),  # from 3 to 0.4: in at 1
        interactions=[Boundary(boundary_id=5, **region)],
        metrics=[Fence()],
    )
    sim = Simulation(game, seeds=[1, 2])
    sim.run()
    assert sim.read("Fence.went_out")[0].tolist() == [out, out]
    assert sim.read("Fence.went_in")[0].tolist() == [into, into]
    assert sim.read("Fence.number")[0].tolist() == [5 if out else 0] * 2


def test_rotation_of_a_cuboid_counts():
    def crossings(**values):
        game = mission(
            block(autonomy=Drift(to=(3.0, 0, 0))),
            interactions=[Boundary(lengths=(2.0, 20.0, 2.0), **values)],
            metrics=[Fence()],
        )
        sim = Simulation(game)
        sim.run()
        return int(sim.read("Fence.went_out")[0][0])

    assert crossings() == 1
    assert crossings(rpy=(0.0, 0.0, np.pi / 2)) == 0


class Hears(Autonomy):
    """Remembers the step in which a shape was heard, and how often."""

    shapes = Subscribe(BoundaryShape)
    read_in = State(dtype=int, default=-1)
    n = State(dtype=int)

    def step(self, g):
        rows, heard = self.shapes.latest()
        self.read_in[rows] = g.step_count[rows]
        self.n[rows] += 1
        assert all(shape.contains(np.zeros((3, 1)))[0] for shape in heard.shape)


def test_the_shape_is_told_once_in_each_world():
    sim = Simulation(mission(block(autonomy=[Drift(), Hears()]), interactions=[Boundary()]), seeds=[1, 2])
    sim.step(4)
    sim.reset([0])
    sim.step(4)
    assert sim.read("a.Hears.read_in")[0].tolist() == [[1], [1]]
    assert sim.read("a.Hears.n")[0].tolist() == [[1], [1]]


def test_the_region_answers_by_service():
    class Asks(Metric):
        inside = State(dtype=bool, per="entity")

        def step(self, w):
            self.inside[:] = w.call("is_inside", w.pos)
            assert self.inside.tolist() == [True, False]

    Simulation(
        mission(
            block(autonomy=Drift(to=(0, 0, 0))),
            block("b", position=(9, 0, 0)),
            interactions=[Boundary()],
            metrics=[Asks()],
        )
    ).run()
