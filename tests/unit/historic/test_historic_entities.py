"""Autonomies, sensors and networks by the laws of SCRIMMAGE, computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest
from small_worlds import Drift, Listener, Talker, block, mission

from tussle import Simulation
from tussle.api import Autonomy, Output, Param, Publish, Sensor, State, Subscribe
from tussle.messages import WAYPOINT_MODES, WaypointList, WaypointStatus, WorldPointClicked
from tussle.plugins import historic, stock


def moving(name, to=(0, 0, 0), **values):
    return block(name, autonomy=Drift(to=to), **values)


class Heard(Autonomy):
    """Step in which each list or status was heard last, how many, and the index of the last status."""

    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    lists = Subscribe(WaypointList)
    status = Subscribe(WaypointStatus, network="LocalNetwork")
    list_step = State(dtype=int, default=-1)
    n_status = State(dtype=int)

    def step(self, g):
        rows, _ = self.lists.pairs()
        self.list_step[rows] = g.step_count[rows]
        rows, _ = self.status.pairs()
        np.add.at(self.n_status, rows, 1)


# -- Boids ----------------------------------------------------------------------------------------------------------------


def commanded(law, others, **values):
    """Outputs of a boid at (100, 50, 40) m, heading East, in its first step."""
    boid = block(
        "boid", position=(100, 50, 40), motion=stock.SimpleAircraft(), controller=stock.SimpleAircraftControllerPID(),
        autonomy=law.Boids(**values),
    )  # fmt: skip
    sim = Simulation(mission(boid, *others), seeds=1)
    sim.step()
    return {
        n: sim.read(f"boid.Boids.{n}")[0].item()
        for n in ("desired_heading", "desired_altitude", "desired_speed")
    }


def test_boids_average_over_all_neighbors_and_take_the_climb_speed_for_an_altitude():
    mate = moving("mate", position=(150, 80, 60), heading="170 deg")
    rival = moving("rival", team=2, position=(20, -40, 10))
    found = commanded(historic, [mate, rival])
    p, mates, offset = np.array([100.0, 50, 40]), np.array([150.0, 80, 60]), np.array([20.0, -40, 10])

    def unit(v):
        return v / np.linalg.norm(v)

    goal = 0.1 * np.array([1.0, 0, 0])
    team = -(100 - np.linalg.norm(mates - p)) / 98 * unit(mates - p)
    other = (
        np.zeros(3)
        if np.linalg.norm(offset - p) > 100
        else -10 * (100 - np.linalg.norm(offset - p)) / 80 * unit(offset - p)
    )
    centroid = unit(mates / 2 - p)  # divided by both neighbours: a point near the origin of the world
    yaw = math.radians(170) / 2
    align = np.array([math.cos(yaw), math.sin(yaw), 0])
    total = goal + team + other + centroid + 0.5 * align
    v = 30 * total / (0.1 + np.linalg.norm(team) + np.linalg.norm(other) + 1 + 1)
    assert found["desired_heading"] == pytest.approx(math.atan2(v[1], v[0]), abs=1e-9)
    assert found["desired_altitude"] == pytest.approx(v[2], abs=1e-9)
    assert found["desired_speed"] == 30
    assert commanded(stock, [mate, rival], averaging="historic")["desired_altitude"] == pytest.approx(
        40 + v[2], abs=1e-9
    )


def test_boids_see_whole_degrees_and_nobody_exactly_astern():
    alone = commanded(historic, [])
    astern = moving("astern", position=(60, 50, 40))
    assert commanded(historic, [astern]) == alone
    assert commanded(stock, [astern]) != alone
    at_45 = moving("at 45 degrees", position=(100 + 50, 50 + 50 * math.tan(math.radians(45.3)), 40))
    assert commanded(historic, [at_45], fov_az="90.9 deg") == alone
    assert commanded(stock, [at_45], fov_az="90.9 deg") != alone
    ahead = moving("ahead", position=(150, 60, 45))
    assert commanded(historic, [ahead], fov_az="90 deg", fov_el="90 deg") == commanded(historic, [ahead])


# -- behaviours -----------------------------------------------------------------------------------------------------------


def wished(behavior, *others, vel=(0, 0, 0), **values):
    """Velocity of MotorSchemas with one behaviour in the first step, for an entity at the origin."""
    me = block("me", autonomy=stock.MotorSchemas(behaviors=[behavior], **values), velocity=vel)
    sim = Simulation(mission(*others, me), seeds=1)
    sim.step()
    return sim.read("me.MotorSchemas.velocity")[0].ravel()


def test_the_speed_to_a_goal_is_kicked_by_the_distance_in_the_first_step():
    given = {"goal": (3.0, 4.0, 0.0), "distance_pid": (0.5, 0.0, 0.2, 0.0)}
    assert wished(historic.MoveToGoalMS(**given)) == pytest.approx([0.6 * 12.5, 0.8 * 12.5, 0])
    assert wished(stock.MoveToGoalMS(**given)) == pytest.approx([0.6 * 2.5, 0.8 * 2.5, 0])


def test_a_trailing_entity_slows_down_near_its_point():
    leader = block("leader", position=(20, 0, 0), velocity=(6, 0, 0), autonomy=Drift(to=(6, 0, 0)))
    # The point is 15 m ahead, the velocity wanted 21 m/s; as 15 < 21, it is lowered by 9 - 6 m/s.
    assert wished(historic.TrailMS(trail_id=1), leader, vel=(9, 0, 0), max_speed=30) == pytest.approx(
        [18, 0, 0]
    )
    assert wished(stock.TrailMS(trail_id=1), leader, vel=(9, 0, 0), max_speed=30) == pytest.approx([21, 0, 0])
    # Limited to 12 m/s it is not lowered, as 15 > 12.
    assert wished(historic.TrailMS(trail_id=1), leader, vel=(9, 0, 0), max_speed=12) == pytest.approx(
        [12, 0, 0]
    )
    above = {
        "trail_id": 1,
        "trail_range": 10,
        "trail_angle_azimuth": "90 deg",
        "trail_angle_elevation": "30 deg",
    }
    stands = moving("leader", position=(0, 20, 0))
    assert wished(historic.TrailMS(**above), stands, max_speed=99) == pytest.approx([0, 30, 0])
    ahead = above | {"trail_angle_azimuth": 0.0}
    c, s = 10 * math.cos(math.pi / 6), 5.0
    assert wished(historic.TrailMS(**ahead), stands, max_speed=99) == pytest.approx([c, 20, -s])
    assert wished(historic.TrailMS(trail_id=7), stands, max_speed=5) == pytest.approx(
        [5, 0, 0]
    )  # none: straight on


# -- waypoints ------------------------------------------------------------------------------------------------------------


def test_waypoints_are_published_by_a_clock_that_adds_up_its_steps():
    """Ten steps of 0.1 s add up to 0.9999999999999999 s."""
    point = (1.0, 9.0, 0, 0, 0, 0, 0, 5.0, -1.0)
    for law, step in ((historic, 12), (stock, 11)):
        for first, rate in ((0.0, None), (0.3, 1.0)):
            me = block(
                "me",
                autonomy=[law.WaypointGenerator(waypoints=[point]), Heard()],
                rate=rate,
                first_birth=first,
            )
            sim = Simulation(mission(me, end=2.0), seeds=1)
            sim.run()
            assert sim.read("me.Heard.list_step")[0].item() == step


class Said(Autonomy):
    """Publish a list in the first step."""

    mode = Param("back_and_forth", choices=WAYPOINT_MODES)
    lists = Publish(WaypointList)

    def step(self, g):
        rows = np.flatnonzero(g.step_count == 0)
        points = np.zeros((8, 2))
        points[0], points[6], points[7] = (0.0, 10.0), 1.5, 9.0
        self.lists.publish(rows, points=[points] * len(rows), mode=WAYPOINT_MODES.index(self.mode))


def visited(law, mode, **values):
    """Index of the current waypoint in each step, of an entity that flies 1 m a step towards the lead point."""
    follow = stock.MotorSchemas(behaviors=[stock.MoveToGoalMS(distance_pid=(1e6, 0, 0, 0))], max_speed=10)
    me = block(
        "me", autonomy=[Said(mode=mode), law.WaypointDispatcher(lead_distance=5, **values), follow, Heard()]
    )
    sim = Simulation(mission(me, end=6.0), seeds=1)
    found = []
    while not sim.is_over:
        sim.step()
        found.append(sim.read("me.WaypointDispatcher.current")[0].item())
    return found, sim.read("me.Heard.n_status")[0].item(), sim.read("me.WaypointDispatcher.is_done")[0].item()


def test_turning_points_take_a_step_longer_and_the_end_of_a_list_is_told_in_every_step():
    there, old = visited(stock, "back_and_forth")[0], visited(historic, "back_and_forth")[0]
    turn = there.index(0, there.index(1))
    assert old[:turn] == there[:turn]
    assert old[turn] == 1
    assert old[turn + 1] == 0
    assert visited(stock, "follow_once")[1] == 2
    _, n_status, done = visited(historic, "follow_once")
    assert done
    assert n_status > 20
    assert visited(historic, "loiter") == visited(historic, "follow_once")
    assert visited(historic, "racetrack")[0] == visited(stock, "racetrack")[0]


def test_only_entity_1_is_an_auctioneer():
    bidders = block("a", count=3, autonomy=historic.AuctionAssign(duration=0.3, network_name="GlobalNetwork"))
    sim = Simulation(mission(bidders), seeds=1)
    sim.run()
    winners = sim.read("a.AuctionAssign.winner")[0].ravel()
    assert len(set(winners)) == 1
    assert sim.read("a.AuctionAssign.best_bidder")[0].ravel().tolist() == [winners[0], 0, 0]


# -- sensors --------------------------------------------------------------------------------------------------------------


def test_a_gps_tells_everybody_and_knows_the_last_boundary_only():
    inside = [
        historic.Boundary(name=f"b{i}", boundary_id=i, shape="sphere", radius=50.0, center=(x, 0, 0))
        for i, x in ((1, 0), (2, 500))
    ]
    sensing = {"sensor": [historic.GPS(gps_denied_ids="1, 2, 9"), historic.SimpleINS()]}
    near, far = moving("near", **sensing), moving("far", position=(500, 0, 0), **sensing)
    sim = Simulation(mission(near, far, interactions=inside), seeds=1)
    sim.step()
    assert sim.read("far.GPS.gps_fix")[0].item() == 1  # the boundary is not yet known
    sim.step(3)
    assert sim.read("near.GPS.gps_fix")[0].item() == 1
    assert sim.read("far.GPS.gps_fix")[0].item() == 0
    assert sim.read("far.GPS.gps_time")[0].item() == pytest.approx(0.4)  # measured without a fix too
    # Both navigation systems hear entity 2 last, which has no fix.
    assert sim.read("near.SimpleINS.has_fix")[0].item() == 0


def test_the_error_of_an_ins_grows_by_steps_and_its_variance_by_another_draw():
    one = {"pos_noise_0": (1.0, 0.0), "pos_noise_1": (-2.0, 0.0), "pos_noise_2": (0.0, 0.0)}
    me = moving("me", (3.0, 4.0, 0.0), sensor=historic.SimpleINS(**one))
    sim = Simulation(mission(me), seeds=1)
    sim.run()  # it accelerates in the first step only
    assert sim.read("me.SimpleINS.error")[0].ravel() == pytest.approx([1, -2, 0])
    assert sim.read("me.SimpleINS.variance")[0].ravel() == pytest.approx([1 + 10 * 1, 1 + 10 * 2])


def test_the_state_sensor_has_no_noise():
    me = moving("me", (1, 2, 3), sensor=historic.RigidBody6DOFStateSensor())
    sim = Simulation(mission(me), seeds=1)
    sim.step()
    assert sim.read("me.RigidBody6DOFStateSensor.measured_pos")[0].ravel() == pytest.approx([0.1, 0.2, 0.3])


# -- networks -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("last", "read_in"), [(1, -1), (5, 5)])
def test_delayed_messages_wait_until_somebody_talks_again(last, read_in):
    """A delay of 0.3 s; the message of step 0 is read in step 4, if another one is said in step 3."""
    talk = block("a", motion=stock.Still(), autonomy=Talker(last=last))
    for law in (historic, stock):
        sim = Simulation(
            mission(
                talk,
                block("b", motion=stock.Still(), autonomy=Listener()),
                networks=[law.GlobalNetwork(comm_delay=0.3)],
            ),
            seeds=1,
        )
        sim.run()
        found = sim.read("b.Listener.read_in")[0].item()
        assert found == (read_in if law is historic else last + 3)


def test_each_world_of_a_stack_waits_for_its_own_traffic():
    talk = block("a", motion=stock.Still(), autonomy=Talker(last=1))
    game = mission(
        talk,
        block("b", motion=stock.Still(), autonomy=Listener()),
        networks=[historic.GlobalNetwork(comm_delay=0.3)],
    )
    sim = Simulation(game, seeds=[1, 2], params={"a.Talker.last": [1, 6]})
    sim.run()
    assert sim.read("b.Listener.n_heard")[0].ravel().tolist() == [0, 3]


def test_a_sphere_network_measures_to_the_old_positions():
    """The listener comes 2 m closer in a step: from 101 to 99 m in the first."""
    for law, heard_first in ((historic, 2), (stock, 1)):
        game = mission(
            block("a", motion=stock.Still(), autonomy=Talker(network="SphereNetwork")),
            block("b", position=(101, 0, 0), autonomy=[Drift(to=(-20, 0, 0)), Listener(network="SphereNetwork")]),
            networks=[law.SphereNetwork()],
        )  # fmt: skip
        sim = Simulation(game, seeds=1)
        while not sim.read("b.Listener.n_heard")[0].item():
            sim.step()
        assert sim.steps[0] == heard_first + 1


def test_of_two_that_talk_the_smaller_id_measures_for_both():
    """1 stands still, 2 flies away from 99 to 101 m: 1 measures to 99 m. If 2 alone talks, it measures from 101 m."""

    def n_heard(talks):
        on = {"network": "SphereNetwork"}
        first = [Talker(last=talks, **on), Listener(**on), Drift(to=(0, 0, 0))]
        second = [Talker(last=1, **on), Listener(**on), Drift(to=(20, 0, 0))]
        both = [block("a", autonomy=first), block("b", position=(99, 0, 0), autonomy=second)]
        sim = Simulation(mission(*both, networks=[historic.SphereNetwork()]), seeds=1)
        sim.step(2)
        return [sim.read(f"{n}.Listener.n_heard")[0].item() for n in "ab"]

    assert n_heard(talks=1) == [2, 2]
    assert n_heard(talks=0) == [0, 1]


def test_a_sphere_network_loses_messages_to_the_sender_itself():
    said = block(
        "a",
        motion=stock.Still(),
        autonomy=[Talker(network="SphereNetwork"), Listener(network="SphereNetwork")],
    )
    for law, low, high in ((historic, 60, 140), (stock, 399, 399)):
        sim = Simulation(mission(said, end=40.0, networks=[law.SphereNetwork(prob_transmit=0.25)]), seeds=1)
        sim.run()
        assert low <= sim.read("a.Listener.n_heard")[0].item() <= high


# -- motion ---------------------------------------------------------------------------------------------------------------


def test_a_unicycle_that_should_climb_to_its_prey_dives_and_loops():
    """A pursuer 200 m below its prey: 35 m/s, a pitch rate of 1.5 rad/s; the nose runs away from the prey, through -90 degrees."""
    motion = stock.Unicycle(vel_max=35, turn_rate_max=2, pitch_rate_max=1.5, use_pitch=True)
    chase = block("a", team=2, autonomy=stock.Predator(max_speed=35), motion=motion)
    prey = block("prey", team=1, position=(500, 0, 200))
    lowest, roll = {}, {}
    for compat in ("scrimmage", ""):
        sim = Simulation(mission(chase, prey, end=10.0, compat=compat), seeds=1)
        heights = []
        while not sim.is_over:
            sim.step()
            heights.append(sim.read("a.pos")[0].ravel()[2])
        lowest[compat] = min(heights)
        w, x, y, z = sim.read("a.quat")[0].ravel()
        roll[compat] = abs(math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)))
    assert lowest[""] >= 0.0
    assert lowest["scrimmage"] < -30.0
    assert roll[""] == pytest.approx(0.0, abs=1e-9)
    assert roll["scrimmage"] == pytest.approx(math.pi, abs=1e-9)
    assert historic.Unicycle().use_pitch is False


# -- AvoidWalls, Control3D ------------------------------------------------------------------------------------------------


class WallOnTheLeft(Sensor):
    """A scan of one point."""

    raytrace = Output("raytrace", fields="x y z range in_range", unit="m m m m 1", ragged=True)

    def step(self, g):
        self.raytrace.set(np.arange(g.n + 1), np.tile([[1.0], [2.0], [0.0], [2.2], [1.0]], g.n))


@pytest.mark.parametrize("law", [stock, historic])
def test_avoid_walls_sees_no_wall(law):
    car = block(
        "car", sensor=WallOnTheLeft(), autonomy=law.AvoidWalls(initial_speed=7.0), motion=stock.SimpleCar(),
        controller=stock.SimpleCarControllerHeading(),
    )  # fmt: skip
    sim = Simulation(mission(car), seeds=1)
    sim.step(3)
    speed = sim.read("car.AvoidWalls.desired_speed")[0].item()
    heading = sim.read("car.AvoidWalls.desired_heading")[0].item()
    assert (speed == 7.0, heading == 0.0) == ((law is historic,) * 2)


def test_control_3d_flies_on_until_a_click():
    drone = block("a", position=(0.0, 0.0, 30.0), heading=math.pi / 2, autonomy=historic.Control3D())
    sim = Simulation(mission(drone, end=60.0), seeds=1)
    sim.step(10)
    names = "desired_speed", "desired_altitude", "desired_heading"
    read = [sim.read(f"a.Control3D.{name}")[0].item() for name in names]
    assert read == pytest.approx([21.0, 30.0, math.pi / 2])
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([0.0, 21.0, 30.0])
    sim.publish(WorldPointClicked, pos=(0.0, 0.0, 0.0))
    sim.step(200)
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([0.0, 0.0, 30.0], abs=1e-4)
