"""GoToWaypoint, AuctionAssign, Control3D, ShapeDraw and TrajectoryRecordPlayback, by small cases computed by hand."""

from __future__ import annotations

import csv
import math

import numpy as np
import pytest
from small_worlds import Drift, block, mission

from tussle import Scene, Simulation
from tussle.api import Autonomy, Publish, State, Subscribe
from tussle.errors import ParameterError, PluginError, UnitError
from tussle.messages import CustomKeyPress, RemoveEntity, WaypointList, WorldPointClicked
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.stock import (
    AuctionAssign,
    Boids,
    Control3D,
    GlobalNetwork,
    GoToWaypoint,
    ShapeDraw,
    SingleIntegrator,
    SphereNetwork,
    Still,
    TrajectoryRecordPlayback,
    Unicycle,
    UnicyclePID,
)
from tussle.world.geodesy import Origin

# -- GoToWaypoint -----------------------------------------------------------------------------------------------------------------


class Ear(Autonomy):
    """Remembers the last list of waypoints."""

    n_lists = State(dtype=int)
    first = State("x y z roll pitch yaw tolerance turn")
    lists = Subscribe(WaypointList, network="LocalNetwork")

    def step(self, g):
        rows, heard = self.lists.pairs()
        np.add.at(self.n_lists, rows, 1)
        for number, row in enumerate(rows):
            self.first[:, row] = heard.points[number][:, 0]


def told(waypoint, steps=9, **values):
    own = block(
        count=2,
        position=(3.0, 4.0, 50.0),
        autonomy=[Drift(to=(10.0, 0.0, 0.0)), GoToWaypoint(waypoint=waypoint), Ear()],
    )
    sim = Simulation(mission(own, **values))
    sim.step(steps)
    return sim.read("a.Ear.n_lists")[0][0].tolist(), sim.read("a.Ear.first")[0][0, 1].tolist()


def test_a_waypoint_may_have_coordinates_of_the_entity():
    assert told(GoToWaypoint().waypoint) == ([1, 1], [3.0, 4.0, 0.0, 0.0, 0.0, 0.0, 10.0, math.inf])
    n_lists, first = told("XYZ 0.5 X -7 Z 0 0 90 5 180")
    assert n_lists == [1, 1]
    assert first == pytest.approx([8.0, -7.0, 50.0, 0.0, 0.0, math.pi / 2, 5.0, math.pi])  # 0.5 s later
    assert told("XYZ 0.5 X Y Z 0 0 0 5 -1", steps=6)[0] == [0, 0]


def test_a_waypoint_may_be_geodetic():
    scene = Scene(origin=Origin(math.radians(35.0), math.radians(-120.0), 300.0))
    _, first = told("GPS 0 35 -120 310 0 0 0 5 -1", scene=scene)
    assert first[:3] == pytest.approx([0.0, 0.0, 10.0], abs=1e-6)
    _, first = told("GPS 0 35 -120 Z 0 0 0 5 -1", scene=scene)
    assert first[:3] == pytest.approx([0.0, 0.0, 50.0], abs=1e-3)


@pytest.mark.parametrize(
    ("waypoint", "error"),
    [
        ("", r"'' is not allowed; it takes XYZ or GPS, time"),
        ("UTM 0 X Y 0 0 0 0 10 -1", r"'UTM 0 X .* is not allowed"),
        ("XYZ 0 X Y 0 0 0 0 10", r"is not allowed"),
        ("GPS 0 X Y 0 0 0 0 10 -1", r"only the altitude of a GPS position can be the entity's own"),
        ("XYZ 0 Y X 0 0 0 0 10 -1", r"Y"),
    ],
)
def test_waypoints_that_are_none(waypoint, error):
    with pytest.raises((ParameterError, UnitError), match=error):
        GoToWaypoint(waypoint=waypoint)


# -- AuctionAssign ----------------------------------------------------------------------------------------------------------------


def auction(network, seeds, **values):
    blocks = [
        block("head", autonomy=AuctionAssign(**values)),
        block("near", count=4, position=(5.0, 0.0, 0.0), autonomy=AuctionAssign(auctioneer=False)),
        block("far", position=(500.0, 0.0, 0.0), autonomy=AuctionAssign(auctioneer=False)),
    ]
    sim = Simulation(mission(*blocks, networks=[network], end=9.0), seeds)

    def winners():
        read = [sim.read(f"{name}.AuctionAssign.winner")[0] for name in ("head", "near", "far")]
        return np.concatenate(read, axis=1)

    sim.step(40)
    assert not winners().any()
    sim.step(20)
    return winners(), sim.read("head.AuctionAssign.best_bid")[0][:, 0]


def test_the_highest_bid_wins_among_those_in_reach():
    winners, bids = auction(GlobalNetwork(name="CommsNetwork"), range(1, 41))
    assert (winners == winners[:, :1]).all()
    assert set(winners[:, 0].tolist()) == set(range(1, 7))  # every entity wins some time, the auctioneer too
    # The largest of six uniform numbers in [-10, 10) has the mean -10 + 20 * 6/7 = 7.14 and the standard deviation 2.47.
    assert bids.mean() == pytest.approx(7.14, abs=3.0 * 2.47 / math.sqrt(40))
    winners, bids = auction(SphereNetwork(name="CommsNetwork", range=50.0), [1, 2, 3], duration=4.5)
    assert winners[:, :5].all()
    assert (winners[:, :5] <= 5).all()
    assert not winners[:, 5].any()


def test_what_missions_call_auction_assign_is_an_auction(tmp_path):
    """There it is a class of Python, which the tag or the file of the plugin names."""
    path = tmp_path / "m.xml"
    path.write_text("""<runscript>
      <run start="0" end="8" dt="0.1"/> <network name="CommsNetwork">GlobalNetwork</network>
      <entity> <team_id>1</team_id> <count>3</count> <motion_model>SingleIntegrator</motion_model>
        <autonomy module="auction_assign" class="AuctionAssign" auctioneer="true">auction_assign</autonomy>
      </entity></runscript>""")
    sim = Simulation(read_mission(path).mission, [1])
    sim.step(60)
    winners = sim.read("team_1.auction_assign.winner")[0]
    assert np.isin(winners, [1, 2, 3]).all()


def test_two_auctions_at_once_are_kept_apart():
    blocks = [
        block("a", count=2, autonomy=AuctionAssign(duration=1.0)),
        block("b", count=5, autonomy=AuctionAssign(auctioneer=False)),
    ]
    sim = Simulation(mission(*blocks, networks=[GlobalNetwork(name="CommsNetwork")], end=3.0), [1, 2, 3])
    sim.step(20)
    best, bidder = (sim.read(f"a.AuctionAssign.{name}")[0] for name in ("best_bid", "best_bidder"))
    assert (best[:, 0] != best[:, 1]).all()
    assert (bidder[:, 0] != bidder[:, 1]).any()
    assert (np.abs(best) <= 10.0).all()


# -- Control3D --------------------------------------------------------------------------------------------------------------------


def test_a_click_leads_to_its_point_and_the_key_stops():
    sim = Simulation(mission(block(position=(0.0, 0.0, 30.0), autonomy=Control3D(max_speed=10.0)), end=60.0))
    sim.step(5)
    assert sim.read("a.pos")[0].tolist() == [[[0.0, 0.0, 30.0]]]
    sim.publish(WorldPointClicked, pos=(30.0, 40.0, 0.0))
    sim.step(12)  # received in the second step
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([6.6, 8.8, 30.0])
    sim.publish(CustomKeyPress, key=";")
    sim.step(10)
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([7.2, 9.6, 30.0])
    sim.publish(CustomKeyPress, key=";")
    sim.step(200)
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([30.0, 40.0, 30.0], abs=1e-5)


def test_a_click_steers_an_aircraft_by_its_heading():
    flier = block(
        position=(0.0, 0.0, 30.0),
        speed=10.0,
        autonomy=Control3D(),
        controller=UnicyclePID(),
        motion=Unicycle(),
    )
    sim = Simulation(mission(flier, end=60.0))
    sim.publish(WorldPointClicked, pos=(0.0, 400.0, 0.0))
    sim.step(3)
    columns = ("desired_heading", "desired_speed", "desired_altitude")
    assert [sim.read(f"a.Control3D.{c}")[0].item() for c in columns] == pytest.approx(
        [math.pi / 2, 20.0, 30.0], abs=0.01
    )


# -- ShapeDraw --------------------------------------------------------------------------------------------------------------------


def test_shapes_of_each_kind_are_drawn_for_a_viewer():
    sim = Simulation(
        mission(block(count=2, position=(1.0, 2.0, 3.0), autonomy=ShapeDraw(size=2.0), motion=Still())),
        [1, 2],
    )
    drawn = []
    sim.state.context.draw.sinks.append(lambda kind, attributes: drawn.append((kind, attributes)))
    sim.step()
    assert [kind for kind, _ in drawn] == ["sphere", "box", "cone", "vectors", "points", "text"]
    sphere = drawn[0][1]
    assert sphere["pos"].T.tolist() == [[7.0, 2.0, 3.0]] * 4
    assert sphere["world"].tolist() == [0, 0, 1, 1]
    assert drawn[5][1]["text"] == ["entity 1", "entity 2"] * 2


# -- TrajectoryRecordPlayback -----------------------------------------------------------------------------------------------------

HEAD = ["world", "t", "id", *"xyz", "qw", "qx", "qy", "qz", "vx", "vy", "vz"]


def record(path, n_steps):
    """Fly a flock and write its states as `tussle export --csv` does."""
    flock = block(count=4, variance=(400.0, 400.0, 25.0), autonomy=Boids(), motion=SingleIntegrator())
    sim = Simulation(mission(flock, end=9.0), [3, 4])
    with path.open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(HEAD)
        for k in range(n_steps + 1):
            state = [sim.read(f"a.{name}")[0] for name in ("pos", "quat", "vel")]
            for world in (1, 0):
                for i in range(4):
                    table.writerow(
                        [world, 0.1 * k, i + 1, *np.concatenate([s[world, i] for s in state]).tolist()]
                    )
            sim.step()
    return sim


def playback(n_steps=20, **values):
    values = {"enable_playback": True, "trajectory_filename": "run.csv", **values}
    flock = block(count=4, variance=(400.0, 400.0, 25.0), autonomy=TrajectoryRecordPlayback(**values))
    sim = Simulation(mission(flock, end=9.0), 3, on_error="raise")
    sim.step(n_steps)
    return sim


def test_a_recorded_flight_is_flown_again_and_ends_with_the_record(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    recorded = record(tmp_path / "run.csv", 30)
    sim = playback(30)
    again = Simulation(mission(block(count=4, variance=(400.0, 400.0, 25.0), autonomy=Boids()), end=9.0), 3)
    again.step(30)
    assert sim.read("a.pos")[0] == pytest.approx(again.read("a.pos")[0], abs=1e-9)
    assert sim.read("a.TrajectoryRecordPlayback.desired_heading")[0] == pytest.approx(
        again.read("a.yaw")[0], abs=1e-9
    )
    sim.step(1)
    assert not sim.read("a.pos")[1].any()
    stays = playback(40, remove_at_end=False)
    assert stays.read("a.pos")[1].all()
    one = playback(20, trajectory_id=2)
    velocity = one.read("a.TrajectoryRecordPlayback.velocity")[0]
    assert (velocity == velocity[:, 1:2]).all()
    assert recorded.n_worlds == 2


@pytest.mark.parametrize(
    ("text", "error"),
    [
        (None, r"run.csv: No such file or directory; it takes a table of `tussle export --csv`"),
        ("", r"run.csv: cannot be read: Empty CSV"),
        ("id,t,x,y\n1,0,0,0\n", r"run.csv: column 'z' is missing; there are: id, t, x, y"),
        (",".join(HEAD) + "\n0,0,9" + ",0" * 10 + "\n", r"run.csv has no entity 1; there are: 9"),
        (",".join(HEAD) + "\n0,0,1" + ",0" * 9 + ",fast\n", r"column 'vz' has values that are no numbers"),
        (",".join(HEAD) + "\n0,0,1" + ",0" * 9 + ",nan\n", r"run.csv, line 2: vz is not a finite number"),
    ],
)
def test_records_that_are_none(tmp_path, monkeypatch, text, error):
    monkeypatch.chdir(tmp_path)
    if text is not None:
        (tmp_path / "run.csv").write_text(text)
    with pytest.raises(PluginError, match=error):
        playback(1)


@pytest.mark.parametrize("name", ["/etc/passwd", "../run.csv"])
def test_a_record_lies_below_the_current_directory(name):
    with pytest.raises(ParameterError, match=r"it takes the name of a file below the current directory"):
        TrajectoryRecordPlayback(trajectory_filename=name)
    shipped = stock.examples()["TrajectoryRecordPlayback"].with_name("eight.csv")
    TrajectoryRecordPlayback(trajectory_filename=str(shipped))


class Undertaker(Autonomy):
    """Asks for the removal of the entity with its id plus one, in step 2."""

    removal = Publish(RemoveEntity)

    def step(self, g):
        rows = np.flatnonzero(g.step_count == 2)
        self.removal.publish(rows, entity=g.id[rows] + 1, why=["asked"] * len(rows))


def test_who_is_to_be_removed_is_gone_after_the_step():
    sim = Simulation(mission(block(count=3), block("b", autonomy=[Drift(), Undertaker()])), [1, 2])
    sim.step(3)
    assert sim.read("b.pos")[1].all()
    other = Simulation(mission(block("b", autonomy=[Drift(), Undertaker()]), block(count=3)), [1, 2])
    other.step(2)
    assert other.read("a.pos")[1].all()
    other.step(1)
    assert other.read("a.pos")[1].tolist() == [[False, True, True]] * 2
