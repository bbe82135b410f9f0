"""Every plugin that ships meets the contract."""

from __future__ import annotations

import socket
from pathlib import Path

import pytest
from actor_process import actor_server
from autopilot_peers import JsonServant, Px4Crowd, ScrimmageServant, free_ports
from moos_database import MoosDatabase
from moos_helm import MoosHelm

from tussle.api import Plugin
from tussle.plugins import historic, stock
from tussle.stock import Boundary
from tussle.testing import check_plugin

COMPANIONS = {
    # Those that hear of something only when somebody tells them; the kit cannot make up a shape.
    "Straight": ["Boundary"],
    "SimpleCaptureMetrics": ["SimpleCapture"],
    "SimpleCapture": ["SimpleCaptureMetrics"],
    "SimpleCollisionMetrics": ["SimpleCollision", "GroundCollision"],
    "WaypointDispatcher": ["WaypointGenerator"],
    "MoveToGoalMS": ["WaypointDispatcher"],
    "GoToWaypoint": ["WaypointDispatcher"],
    "Convoy": ["Escort"],
    "Escort": ["Convoy"],
    # Those that are flown by a controller, which works between the substeps.
    "SimpleAircraft": ["SimpleAircraftControllerPID"],
    "Unicycle": ["UnicyclePID"],
    "SimpleQuadrotor": ["SimpleQuadrotorControllerLQR"],
    "RigidBody6DOF": ["RigidBody6DOFControllerPID"],
    "UUV6DOF": ["UUV6DOFLinearEnergy"],
}
NEEDED = {"MultirotorControllerPID": ["Multirotor"], "MultirotorControllerOmega": ["Multirotor"]}
"""Companions without which a plugin cannot be played."""
LIGHT = ("FixedWing6DOFRascal",)
"""Variants of a plugin that is checked, too light for the kit's steps with a tenth or ten times of its parameters."""

FILES = {
    "MapGen2D": ("map", "rooms.pgm"),
    "GraphInteraction": ("graph_file", "town.graphml"),
    "JoystickAutonomy": ("device", "stick.js0"),
    "JoystickController": ("device", "stick.js0"),
}
"""Parameter, and file of the example, of plugins that read a file."""
RECORD = "id,t,x,y,z,qw,qx,qy,qz,vx,vy,vz\n" + "".join(
    f"{i},{k / 10},{i},{k},5,1,0,0,0,{k / 3},1,0\n" for i in range(1, 80) for k in range(12)
)
"""Trajectories of the entities of the kit's game."""

BOUNDARIES = [
    Boundary(name="west", boundary_id=1, team=1, shape="sphere", center=(-4.0, 0.0, 4.0), radius=8.0),
    Boundary(name="east", boundary_id=2, team=2, shape="sphere", center=(4.0, 0.0, 4.0), radius=8.0),
    *(Boundary(name=f"wide {i}", boundary_id=i, lengths=(30.0, 12.0, 12.0)) for i in (3, 4)),
]
ON_REGIONS = (
    "BoundaryDefense", "CaptureInBoundaryInteraction", "EnforceBoundaryInteraction", "FlagCaptureInteraction", "TakeFlag",
)  # fmt: skip
"""Those that cannot work without the boundaries that they name."""


SLOW = ("JSBSimCompiled", "JSBSimControl", "JSBSimModel")


@pytest.mark.parametrize(
    "name",
    [
        pytest.param(name, marks=pytest.mark.slow if name in SLOW else ())
        for name in {path: name for name, path in stock.manifest().items()}.values()
    ],
)
def test_plugin_meets_the_contract(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest
) -> None:
    if "ROS" in name:
        request.getfixturevalue("ros_domain" if "ROS2" in name else "roscore")
    if name == "GraphInteraction":
        pytest.importorskip("networkx")
    if name == "TrajectoryRecordPlayback":
        monkeypatch.chdir(tmp_path)
        Path("trajectory.txt").write_text(RECORD)
    if name in LIGHT:
        monkeypatch.setattr("tussle.testing.check.check_limits", lambda game: None)
    params = {FILES[name][0]: str(stock.examples()[name].with_name(FILES[name][1]))} if name in FILES else {}
    if name in ("JSBSimControl", "JSBSimModel"):
        pytest.importorskip("jsbsim")
        aircraft = {"aircraft": "hawk"} if name == "JSBSimControl" else {"script_name": "patrol.xml"}
        params = {**aircraft, "jsbsim_root": str(stock.examples()["JSBSimModel"].with_name("hawk"))}
    if name == "JSBSimCompiled":
        params = {"aircraft": "hawk", "jsbsim_root": str(stock.examples()["JSBSimModel"].with_name("hawk"))}
    if name == "DIS":
        params = {"time_warp": 0.0}  # no wait for the clock
    if name in ("GRPCCommandString", "RLSimple", "RLConsensus"):
        pytest.importorskip("grpc_tools")
        with socket.create_server(("127.0.0.1", 0)) as server:
            params = {"port": server.getsockname()[1]}
    if name in ("RLSimple", "RLConsensus"):
        with actor_server(tmp_path, params["port"]):
            return check_plugin(stock.load(name), **params)
    companions = [stock.load(other)() for other in NEEDED.get(name, ())]
    if name == "MOOSAutonomy":
        return check_with_helms(stock.load(name))
    if name in ("ArduPilot", "PX4"):
        return check_with_autopilots(name)
    return check_plugin(
        stock.load(name), companions=BOUNDARIES if name in ON_REGIONS else companions, **params
    )


def check_with_helms(cls: type[Plugin], n: int = 40) -> None:
    """Check MOOSAutonomy; each of the kit's entities has a community and a helm."""
    with MoosDatabase(n) as database, MoosHelm(*range(database.port, database.port + n)):
        check_plugin(cls, moos_port=database.port, port_step=1, moos_time_warp=1000.0, timeout=300.0)
        assert database.violations == []


def check_with_autopilots(name: str, n: int = 40) -> None:
    """Check ArduPilot or PX4; each of the kit's entities has an autopilot."""
    how = {"time_warp": 1000.0, "timeout": 300.0}
    if name == "PX4":
        pytest.importorskip("pymavlink")
        port = free_ports(n, 1, socket.SOCK_STREAM)
        with Px4Crowd(*range(port, port + n)):
            check_plugin(stock.load(name), port=port, **how)
        return
    port = free_ports(
        3 * n
    )  # for the id k: 3 k - 3 of JSON; 3 k - 2 and 3 k - 1 of the protocol of SCRIMMAGE
    ports = [range(port + k, port + 3 * n, 3) for k in range(3)]
    how |= {"json_port": port, "ardupilot_port_base": port - 2, "port_instance_multiplier": 3}
    with JsonServant(*ports[0]), ScrimmageServant(*zip(ports[2], ports[1], strict=True)):
        check_plugin(stock.load(name), **how)


@pytest.mark.parametrize(
    "name",
    [
        name
        for name, path in historic.manifest().items()
        # Motion models break the rules on purpose, and controllers are row laws like those that ship, but for one.
        if not {"motion", "controller"} & set(path.split(".")) or name == "MotionBattery"
    ],
)
def test_plugin_with_the_law_of_scrimmage_meets_the_contract(name: str) -> None:
    check_plugin(historic.load(name), companions=BOUNDARIES if name in ON_REGIONS else ())


@pytest.mark.parametrize("name", COMPANIONS)
def test_plugin_meets_the_contract_in_the_company_of_others(name: str) -> None:
    check_plugin(stock.load(name), companions=[stock.load(other)() for other in COMPANIONS[name]])
