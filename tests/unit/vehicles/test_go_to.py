"""GoTo with every vehicle: what it visits, in which order, and where it ends."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output, Param, Publish
from tussle.errors import WiringError
from tussle.messages import Waypoint
from tussle.stock import (
    AircraftToSingleIntegratorController,
    DoubleIntegrator,
    DoubleIntegratorControllerVelYaw,
    DoubleIntegratorControllerWaypoint,
    DubinsAirplane,
    DubinsAirplane3D,
    DubinsAirplaneController,
    GoTo,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    SimpleCar,
    SimpleCarControllerHeading,
    SimpleQuadrotor,
    SimpleQuadrotorControllerLQR,
    SingleIntegrator,
    SingleIntegratorControllerSimple,
    SingleIntegratorControllerWaypoint,
    Unicycle,
    Unicycle3D,
    UnicycleControllerPoint,
    UnicyclePID,
)

ROUTE = ((100.0, 0.0, 60.0), (100.0, 150.0, 40.0), (-50.0, 150.0, 50.0))
FAST = {"vel_max": 20.0, "turn_rate_max": 1.0, "pitch_rate_max": 1.0}
AGILE = {"max_vel": 10.0, "max_acc": 5.0}

STOPPING = {
    "velocity": ((), SingleIntegrator()),
    "velocity passed through": (SingleIntegratorControllerSimple(), SingleIntegrator()),
    "position to velocity": (SingleIntegratorControllerWaypoint(gain=0.3), SingleIntegrator()),
    "heading to velocity": (AircraftToSingleIntegratorController(), SingleIntegrator()),
    "heading to acceleration": (DoubleIntegratorControllerVelYaw(), DoubleIntegrator(**AGILE)),
    "position to acceleration": (DoubleIntegratorControllerWaypoint(), DoubleIntegrator(**AGILE)),
    "position and heading": (SimpleQuadrotorControllerLQR(max_vel=10.0), SimpleQuadrotor()),
    "unicycle": (UnicyclePID(), Unicycle(**FAST)),
    "point ahead": (UnicycleControllerPoint(gain=0.3), Unicycle(**FAST)),
    "unicycle 3D": (UnicyclePID(), Unicycle3D(speed_max=20.0)),
    "car": (SimpleCarControllerHeading(p_gain=0.5, i_gain=0.0), SimpleCar()),
}
FLYING_ON = {
    "aircraft": (SimpleAircraftControllerPID(), SimpleAircraft(max_velocity=25.0)),
    "Dubins": (DubinsAirplaneController(), DubinsAirplane(speed_min=10.0)),
    "Dubins 3D": (DubinsAirplaneController(), DubinsAirplane3D(speed_min=10.0)),
}


def traveller(name, controller, motion, **values):
    """One vehicle at (0, 0, 50) that faces East."""
    values.setdefault("waypoints", ROUTE)
    return Block(
        name=name, position=(0, 0, 50), variance=(0, 0, 0), autonomy=GoTo(**values), controller=controller, motion=motion
    )  # fmt: skip


def visits(sim, names, n_steps, tolerance):
    """Order in which each vehicle came to the points of the route."""
    found = {name: [] for name in names}
    for _ in range(0, n_steps, 3):
        sim.step(3)
        for name in names:
            flat = 2 if name == "car" else 3
            offset = np.array(ROUTE)[:, :flat] - sim.read(f"{name}.pos")[0][0, 0, :flat]
            near = np.flatnonzero(np.linalg.norm(offset, axis=1) <= tolerance)
            if len(near) and found[name][-1:] != [near[0]]:
                found[name].append(int(near[0]))
    return found


def test_every_vehicle_that_can_stop_visits_all_points_and_stops_at_the_last():
    blocks = [traveller(name, *parts, tolerance_in_2d=name == "car") for name, parts in STOPPING.items()]
    sim = Simulation(Mission(blocks=blocks, dt=0.2, end=120.0))
    assert visits(sim, STOPPING, 600, 8.0) == {name: [0, 1, 2] for name in STOPPING}
    for name in STOPPING:
        assert np.linalg.norm(sim.read(f"{name}.vel")[0][0, 0]) < 0.05, name
        pos = sim.read(f"{name}.pos")[0][0, 0]
        flat = 2 if name == "car" else 3
        assert np.linalg.norm((pos - ROUTE[2])[:flat]) < 5.0, name
    for name in ("velocity", "position to velocity", "position to acceleration"):
        assert sim.read(f"{name}.pos")[0][0, 0] == pytest.approx(ROUTE[2], abs=0.05), name


@pytest.mark.slow
def test_vehicles_that_cannot_stop_fly_round_and_round():
    blocks = [
        traveller(name, *parts, mode="loop", speed=15.0, tolerance=40.0) for name, parts in FLYING_ON.items()
    ]
    sim = Simulation(Mission(blocks=blocks, dt=0.2, end=120.0, motion_multiplier=4))
    for name, order in visits(sim, FLYING_ON, 600, 45.0).items():
        assert order == [k % 3 for k in range(len(order))], name
        assert len(order) >= 6, name
        assert 35.0 < sim.read(f"{name}.pos")[0][0, 0, 2] < 65.0, name


class Herald(Autonomy):
    """Names a goal at a time."""

    at = Param(30.0, unit="s")
    goals = Publish(Waypoint, network="LocalNetwork")

    def step(self, g):
        self.goals.publish(np.abs(g.t - self.at) < 0.01, pos=np.array([[7.0], [8.0], [9.0]]))


def test_at_the_end_of_the_list_it_turns_back_or_goes_where_a_message_says():
    back = traveller("back", (), SingleIntegrator(), mode="reverse")
    told = traveller("told", (), SingleIntegrator(), mode="loop").replace(
        autonomy=[Herald(), GoTo(waypoints=ROUTE, mode="loop")]
    )
    idle = traveller("idle", DoubleIntegratorControllerVelYaw(), DoubleIntegrator(), waypoints=())
    sim = Simulation(Mission(blocks=[back, told, idle.replace(heading="50 deg")], end=75.0))
    assert visits(sim, ("back",), 750, 8.0)["back"] == [0, 1, 2, 1, 0]
    assert sim.read("told.pos")[0][0, 0] == pytest.approx([7, 8, 9])
    assert sim.read("told.GoTo.current")[0][0, 0] == 2  # where it was going
    assert sim.read("idle.pos")[0][0, 0].tolist() == [0, 0, 50]
    assert sim.read("idle.GoTo.heading")[0][0, 0] == pytest.approx(math.radians(50))


def test_a_waypoint_that_is_passed_within_a_step_is_reached_and_the_last_one_is_not_overshot():
    """70 m in each step of 1 s, and points 100 m apart with a tolerance of 1 m."""
    line = traveller(
        "a", (), SingleIntegrator(), waypoints=((100, 0, 50), (200, 0, 50), (230, 0, 50)), tolerance=1.0, speed=70.0, slowing_distance=0.0
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[line], dt=1.0, end=20.0))
    path = []
    for _ in range(10):
        sim.step()
        path.append(float(sim.read("a.pos")[0][0, 0, 0]))
    # It turns for the points that it has passed only when it has: at 140 m, at 210 m.
    assert path[:3] == [70.0, 140.0, 210.0]
    assert path[-1] == 230.0


def test_points_nearer_to_each_other_than_a_step_are_all_passed():
    row = tuple((10.0 * x, 0.0, 50.0) for x in range(1, 30))
    line = traveller("a", (), SingleIntegrator(), waypoints=row, tolerance=1.0, speed=70.0)
    sim = Simulation(Mission(blocks=[line], dt=1.0, end=20.0))
    sim.step(5)
    assert sim.read("a.pos")[0][0, 0, 0] == pytest.approx(280.0, abs=11.0)
    sim.run()
    assert sim.read("a.pos")[0][0, 0] == pytest.approx([290.0, 0.0, 50.0])


def test_a_waypoint_inside_the_turning_circle_is_skipped_after_a_turn():
    controller, motion = SimpleAircraftControllerPID(), SimpleAircraft(turning_radius=40.0, max_velocity=25.0)
    near = {"waypoints": ((0.0, 45.0, 50.0), (500.0, 500.0, 50.0)), "speed": 25.0}
    keeps = traveller("keeps", controller, motion, **near, max_turns=0.0)
    sim = Simulation(Mission(blocks=[traveller("a", controller, motion, **near), keeps], dt=0.1, end=120.0))
    with pytest.warns(RuntimeWarning, match="GoTo: an entity skips a waypoint that it has circled"):
        sim.run()
    assert sim.read("a.GoTo.current")[0][0, 0] == 1
    assert sim.read("keeps.GoTo.current")[0][0, 0] == 0


def test_a_vehicle_whose_channels_fit_none_of_the_three_forms_is_refused():
    with pytest.raises(WiringError, match=r"controllers that connect them: .*UnicyclePID"):
        Simulation(Mission(blocks=[traveller("a", (), Unicycle())]))


class Level(Autonomy):
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")

    def step(self, g):
        self.desired_heading[:], self.desired_altitude[:], self.desired_speed[:] = 0.4, 60.0, 20.0


def test_the_heading_and_the_height_of_a_dubins_airplane_decay_exponentially():
    """Commands are held for a step of h s, in which the heading turns at a constant rate: the error is (1 - h k)^n of the first."""
    block = Block(
        name="a", position=(0, 0, 50), variance=(0, 0, 0), autonomy=Level(), controller=DubinsAirplaneController(), motion=DubinsAirplane()
    )  # fmt: skip
    sim = Simulation(Mission(blocks=[block], end=3.0, dt=0.01))
    sim.run()
    assert (0.4 - sim.read("a.yaw")[0][0, 0]) / 0.4 == pytest.approx(0.99**300, rel=1e-9)
    # z' = V sin(atan(0.5 e / V)), which is 0.5 e / sqrt(1 + (0.5 e / V)^2): at most 3 % less
    assert 0.995**300 < (60.0 - sim.read("a.pos")[0][0, 0, 2]) / 10.0 < 0.995 ** (300 * 0.97)
