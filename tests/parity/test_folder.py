"""All missions of SCRIMMAGE can be played by its own laws with its data, unless it cannot play them itself."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from recordings import folder

from tussle.cli.options import MissionOptions
from tussle.cli.play import is_mission, state_of

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


def missions() -> list[str]:
    place = folder()
    if place is None:
        return []
    root = place / "missions"
    return [str(p.relative_to(root)) for p in sorted(root.rglob("*.xml")) if is_mission(p)]


@pytest.mark.parametrize("name", missions())
def test_it_plays_or_waits_for_something_that_is_named(name: str) -> None:
    place = folder()
    assert place is not None
    if data() is None:
        pytest.skip(f"needs SCRIMMAGE's data beside the recordings, or {VARIABLE}")
    pytest.importorskip("jsbsim")
    root = place / "missions"
    options = MissionOptions(
        mission=str(root / name), compat="scrimmage", data_path=[data() or Path(), root], strict=False
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
