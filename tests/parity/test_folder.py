"""All missions of SCRIMMAGE can be played by its own laws with its data, unless it cannot play them itself."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from recordings import folder, load
from replay import fly

from tussle.cli.options import MissionOptions
from tussle.cli.play import is_mission, state_of
from tussle.mission import read_mission

VARIABLE = "TUSSLE_SCRIMMAGE_DATA"
REFUSED = {
    "delay-test.xml": "SCRIMMAGE does not have it either",
    "quad-airsim-ex1.xml": "AirSimSensor is dropped",
    "test/test_api.xml": "APITester is dropped",
    "test/test_missing_autonomy.xml": "no plugin writes channel",
    "test/test_missing_controller.xml": "no plugin writes channel",
}
WAITING = {
    "arducopter.xml": "ArduPilot",
    "arduplane.xml": "ArduPilot",
    "arduplane_multiple.xml": "ArduPilot",
    "joystick-DubinsAirplane.xml": "a joystick at /dev/input/js0",
    "joystick-jsbsim-groundstart.xml": "a joystick at /dev/input/js0",
    "joystick-jsbsim.xml": "a joystick at /dev/input/js0",
    "moos-ex1.xml": "MOOS-IvP",
    "moos-ex2.xml": "targ_henry.moos, which launch.sh",
    "rigid_body_6dof.xml": "ROS",
}


def data() -> Path | None:
    """The folder of SCRIMMAGE's data: named by the environment, else one beside the recordings; None if there is none."""
    named = os.environ.get(VARIABLE)
    path = Path(named) if named else (folder() or Path()) / "scrimmage-data" / "data"
    return path if path.is_dir() else None


def needed_data() -> Path:
    """The folder of SCRIMMAGE's data; the test is skipped without it or JSBSim."""
    pytest.importorskip("jsbsim")
    found = data()
    if found is None:
        pytest.skip(f"needs SCRIMMAGE's data beside the recordings, or {VARIABLE}")
    return found


def mission_folder() -> Path:
    place = folder()
    assert place is not None
    return place / "missions"


def missions() -> list[str]:
    place = folder()
    if place is None:
        return []
    root = place / "missions"
    return [str(p.relative_to(root)) for p in sorted(root.rglob("*.xml")) if is_mission(p)]


@pytest.mark.parametrize("name", missions())
def test_it_plays_or_waits_for_something_that_is_named(name: str) -> None:
    root = mission_folder()
    options = MissionOptions(
        mission=str(root / name), compat="scrimmage", data_path=[needed_data(), root], strict=False
    )
    state, why = state_of(options)
    if name in REFUSED:
        assert state == "refused"
        assert REFUSED[name] in why
    elif name in WAITING:
        assert state == "waits"
        assert WAITING[name] in why
    else:
        assert (state, why) == ("plays", "")


def test_aircraft_of_jsbsim_fly_near_their_recordings() -> None:
    """For 10 s; the recording is one of JSBSim 1.1, whose propeller starts otherwise. Where they were thrown over, they were 77 m off."""
    file = mission_folder() / "straight_jsbsim.xml"
    mission = read_mission(file, {"run.end": 10.0}, search=[needed_data()], compat="scrimmage").mission
    assert fly(mission, load("straight_jsbsim")).max_error < 12.0
