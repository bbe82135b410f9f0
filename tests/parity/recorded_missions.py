"""The existing system's missions, with the plugins of tussle."""

from __future__ import annotations

import math

from tussle import Block, Mission
from tussle.scene import Origin, Scene
from tussle.stock import (
    CPA,
    AvoidEntityMS,
    Boundary,
    GroundCollision,
    HarmonicOscillator,
    HarmonicOscillatorConstController,
    MotorSchemas,
    MoveToGoalMS,
    SimpleAircraft,
    SimpleAircraftControllerPID,
    SimpleCollision,
    SimpleCollisionMetrics,
    Still,
    Straight,
    Unicycle,
    Unicycle3D,
    UnicyclePID,
    WaypointDispatcher,
    WaypointGenerator,
)

SCENE = Scene(origin=Origin.from_degrees(35.721025, -120.767925, 300.0))
WEST = math.pi


def aircraft(name: str, team: int, straight: Straight, **values: object) -> Block:
    return Block(
        name=name, team=team, autonomy=straight, controller=SimpleAircraftControllerPID(), motion=SimpleAircraft(), **values
    )  # fmt: skip


def straight() -> Mission:
    fenced = {"enable_boundary_control": True}
    return Mission(
        name="straight", dt=0.1, end=100.0, end_conditions="time, all_dead", scene=SCENE,
        blocks=[
            aircraft("blue", 1, Straight(**fenced)),
            aircraft("red", 2, Straight(speed=21.0, **fenced), count=30, radius=2.0, heading=WEST),
        ],
        interactions=[
            Boundary(center=(0.0, 0.0, 500.0), lengths=(2000.0, 2000.0, 1000.0)), SimpleCollision(), GroundCollision(),
        ],
        metrics=[SimpleCollisionMetrics()],
    )  # fmt: skip


def straight_no_gui() -> Mission:
    return Mission(
        name="straight-no-gui", dt=0.1, end=100.0, end_conditions="time, all_dead", scene=SCENE,
        blocks=[
            aircraft("blue", 1, Straight(), rate=0.5, slots=2),
            aircraft("red", 2, Straight(), rate=0.5, slots=2, interval_sd=0.1, heading=WEST),
        ],
        interactions=[SimpleCollision()], metrics=[SimpleCollisionMetrics()],
    )  # fmt: skip


def unicycle() -> Mission:
    start = {
        "team": 1,
        "heading": "90 deg",
        "roll": "45 deg",
        "climb": "-45 deg",
        "controller": UnicyclePID(),
    }
    goal = lambda north: MotorSchemas(behaviors=[MoveToGoalMS(goal=(100.0, north, 30.0))])  # noqa: E731
    return Mission(
        name="unicycle", dt=0.1, end=100.0, end_conditions="time, all_dead", scene=SCENE,
        blocks=[
            Block(name="flat", autonomy=goal(30.0), motion=Unicycle(use_pitch=True, enable_roll=True), **start),
            Block(name="free", autonomy=goal(40.0), motion=Unicycle3D(), **start),
        ],
        interactions=[SimpleCollision(), GroundCollision()], metrics=[SimpleCollisionMetrics()],
    )  # fmt: skip


def harmonic_oscillator() -> Mission:
    return Mission(
        name="harmonic-oscillator", dt=0.01, end=1000.0,
        blocks=[
            Block(
                name="oscillator", team=1, controller=HarmonicOscillatorConstController(acceleration_z=-100.0),
                motion=HarmonicOscillator(natural_frequency=5.0, damping_ratio=0.1),
            )
        ],
    )  # fmt: skip


def waypoint_follower() -> Mission:
    behaviors = [
        AvoidEntityMS(sphere_of_influence=10.0, minimum_range=2.0),
        MoveToGoalMS(use_initial_heading=True),
    ]
    return Mission(
        name="waypoint_follower", dt=0.1, end=1000.0, end_conditions="time, all_dead", scene=SCENE,
        blocks=[
            Block(
                name="aircraft", team=1, autonomy=[WaypointDispatcher(), MotorSchemas(max_speed=25.0, behaviors=behaviors)],
                controller=SimpleAircraftControllerPID(), motion=SimpleAircraft(),
            ),
            Block(name="station", team=1, autonomy=WaypointGenerator(), motion=Still()),
        ],
        interactions=[SimpleCollision()], metrics=[SimpleCollisionMetrics()],
    )  # fmt: skip


def batch_example_mission() -> Mission:
    corners = [(100.0, 0.0), (100.0, 100.0), (0.0, 100.0), (0.0, 0.0)]
    waypoints = [(0.0, x, y, 0.0, 0.0, 0.0, 0.0, 5.0, -1.0) for x, y in corners]
    behaviors = [
        AvoidEntityMS(sphere_of_influence=10.0, minimum_range=2.0),
        MoveToGoalMS(use_initial_heading=True),
    ]
    return Mission(
        name="batch-example-mission", dt=0.1, end=1000.0, end_conditions="time, all_dead", scene=SCENE,
        blocks=[
            Block(
                name="uuv_entity", team=1, controller=UnicyclePID(), motion=Unicycle3D(speed_max=30.0),
                autonomy=[
                    WaypointGenerator(network_name="LocalNetwork", mode="racetrack", waypoints=waypoints),
                    WaypointDispatcher(waypointlist_network="LocalNetwork"),
                    MotorSchemas(max_speed=25.0, behaviors=behaviors),
                ],
            ),
            Block(name="target", team=2, motion=Still()),
        ],
        interactions=[SimpleCollision()], metrics=[SimpleCollisionMetrics(), CPA()],
    )  # fmt: skip


MISSIONS = {
    m.__name__: m
    for m in (
        straight,
        straight_no_gui,
        unicycle,
        harmonic_oscillator,
        waypoint_follower,
        batch_example_mission,
    )
}
RECORDED_AS = {name: name for name in MISSIONS} | {
    "straight_no_gui": "straight-no-gui",
    "harmonic_oscillator": "harmonic-oscillator",
    "batch_example_mission": "batch-example-mission",
}


def mission(name: str) -> Mission:
    """A mission by the recording's name. Whoever reads missions from their files replaces the body of this function."""
    return MISSIONS[name.replace("-", "_")]()
