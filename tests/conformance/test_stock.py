"""Every plugin that ships meets the contract."""

from __future__ import annotations

from pathlib import Path

import pytest

from tussle import stock
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
    # Those that are flown by a controller, which works between the substeps.
    "SimpleAircraft": ["SimpleAircraftControllerPID"],
    "Unicycle": ["UnicyclePID"],
}

RECORD = "id,t,x,y,z,qw,qx,qy,qz,vx,vy,vz\n"
FILES = {
    "TrajectoryRecordPlayback": (
        "trajectory.txt",
        RECORD
        + "".join(f"{i},{k / 10},{i},{k},5,1,0,0,0,{k / 3},1,0\n" for i in range(1, 80) for k in range(12)),
    )
}
"""Files that a plugin reads, by plugin."""


@pytest.mark.parametrize("name", stock.manifest())
def test_plugin_meets_the_contract(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if name in FILES:
        monkeypatch.chdir(tmp_path)
        file, text = FILES[name]
        Path(file).write_text(text)
    check_plugin(stock.load(name))


@pytest.mark.parametrize("name", COMPANIONS)
def test_plugin_meets_the_contract_in_the_company_of_others(name: str) -> None:
    check_plugin(stock.load(name), companions=[stock.load(other)() for other in COMPANIONS[name]])
