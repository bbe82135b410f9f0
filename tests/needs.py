"""What tests need that `pip install '.[test]'` does not bring, or not for each Python: whether it is there, and what to type to get it.

Without it a test is skipped, and what pytest prints at its end says so. Where the variable TUSSLE_TEST_ALL is set, as .ci/run does when it
has installed everything, the test fails instead. `python tests/needs.py` prints the packages of Debian that bring what can be had so.
"""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
HEADERS = Path("/usr/include")
# The first has no windows of its own to draw: a page takes a third of the CPU time.
BROWSERS = "chromium-headless-shell", "chromium", "chromium-browser", "google-chrome"
ROSCPP = "ros/ros.h", "nav_msgs/Odometry.h", "sensor_msgs/LaserScan.h", "geometry_msgs/Twist.h"
FASTDDS = "fastdds/dds/domain/DomainParticipant.hpp"
ROSPY = (
    "python3-rospy python3-roslaunch python3-nav-msgs python3-sensor-msgs python3-std-srvs python3-tf2-msgs "
    "python3-visualization-msgs"
)


@dataclass(frozen=True)
class Need:
    """Something that tests need.

    Attributes:
        name: What it is.
        is_there: Whether it is installed.
        packages: Packages of Debian that bring it.
        command: What to type where there are none.
        is_optional: .ci/run goes on where it cannot install it, and the tests are skipped there too.
    """

    name: str
    is_there: Callable[[], bool]
    packages: str = ""
    command: str = ""
    is_optional: bool = False

    @property
    def reason(self) -> str:
        """Why a test is skipped."""
        return f"needs {self.name}: {self.command or f'apt-get install {self.packages}'}"


def program(*names: str) -> str | None:
    """Path of the first of some programs that is there: on the PATH, or installed by npm."""
    return next((found for name in names if (found := shutil.which(name, path=_path()))), None)


def axe() -> Path | None:
    """The script of axe-core, which checks pages, where npm has installed it."""
    folders = (Path(each).parent for each in _path().split(os.pathsep) if each.endswith(".bin"))
    return next(
        (script for folder in folders if (script := folder / "axe-core" / "axe.min.js").exists()), None
    )


def _path() -> str:
    return f"{os.environ.get('PATH', '')}{os.pathsep}{ROOT / 'node_modules' / '.bin'}"


def _has_program(*names: str) -> Callable[[], bool]:
    return lambda: program(*names) is not None


def _has_module(name: str) -> Callable[[], bool]:
    return lambda: find_spec(name) is not None


def _has_headers(*names: str) -> Callable[[], bool]:
    return lambda: program("g++") is not None and all((HEADERS / name).exists() for name in names)


def _has_rospy() -> bool:
    from tussle.errors import MissingExtraError
    from tussle.plugins.links.ros.node import load_rospy

    try:
        load_rospy()
    except MissingExtraError:
        return False
    return True


def _has_renderer() -> bool:
    from tussle.errors import ViewError
    from tussle.view.export.film.renderer import find_window

    try:
        find_window()
    except ViewError:
        return False
    return True


def package(name: str, module: str, until: int) -> Need:
    """A package that `.[test]` brings for Python 3.(until - 1) and older: there is none for newer versions."""
    return Need(
        f"{name}, which is packaged for Python 3.{until - 1} and older",
        _has_module(module),
        command="pip install '.[test]'",
        is_optional=sys.version_info >= (3, until),
    )


NEEDS = {
    "axe": Need("axe-core", lambda: axe() is not None, command="npm install", is_optional=True),
    "browser": Need("a browser", _has_program(*BROWSERS), "chromium-headless-shell fonts-dejavu-core"),
    "cyclonedds": package("Cyclone DDS", "cyclonedds", 14),
    "fastdds": Need("Fast DDS", _has_headers(FASTDDS), "g++ libfastrtps-dev libfastcdr-dev"),
    "g++": Need("a compiler of C++", _has_program("g++"), "g++"),
    "mkdocs": Need("MkDocs", _has_module("mkdocstrings_handlers"), command="pip install '.[docs]'"),
    "moos": Need(
        "MOOS-IvP",
        lambda: all(map(program, ("MOOSDB", "pHelmIvP"))),
        command="build MOOSDB and pHelmIvP of https://github.com/moos-ivp/moos-ivp",
        is_optional=True,
    ),
    "node": Need("Node.js", _has_program("node"), "nodejs npm"),
    "ompl": package("OMPL", "ompl", 14),
    "opendis": Need("opendis", _has_module("opendis"), command="pip install --no-deps opendis"),
    "rerun": Need("Rerun", _has_module("rerun"), command="pip install '.[rerun]'"),
    "renderer": Need("OSMesa or EGL", _has_renderer, "libosmesa6"),
    "rosbag": Need("rosbag", _has_program("rosbag"), "python3-rosbag"),
    "roscore": Need("ROS 1", _has_program("roscore"), ROSPY),
    "roscpp": Need(
        "roscpp",
        _has_headers(*ROSCPP),
        "g++ libroscpp-dev libnav-msgs-dev libsensor-msgs-dev libgeometry-msgs-dev",
    ),
    "rosnode": Need("rosnode", _has_program("rosnode"), "python3-rosnode python3-rosservice"),
    "rospy": Need("ROS 1", _has_rospy, ROSPY),
    "rostopic": Need("rostopic", _has_program("rostopic"), "python3-rostopic"),
    "rtamt": package("rtamt", "rtamt", 13),
    "stable_baselines3": Need(
        "stable-baselines3",
        _has_module("stable_baselines3"),
        command="pip install stable-baselines3",
        is_optional=True,
    ),
    "supersuit": package("SuperSuit", "supersuit", 13),
    "tensorboard": Need(
        "TensorBoard", _has_module("tensorboard"), command="pip install '.[tensorboard]'", is_optional=True
    ),
    "torch": Need("PyTorch", _has_module("torch"), command="pip install '.[train]'", is_optional=True),
    "vmas": Need("VMAS", _has_module("vmas"), command="pip install vmas", is_optional=True),
    "tsc": Need("TypeScript", _has_program("tsc"), command="npm install", is_optional=True),
}


def require(*names: str) -> None:
    """Skip the test, or all tests of a module or fixture, where one of NEEDS is not installed."""
    import pytest

    for name in names:
        need = NEEDS[name]
        if not need.is_there():
            assert need.is_optional or "TUSSLE_TEST_ALL" not in os.environ, need.reason
            pytest.skip(need.reason, allow_module_level=True)


if __name__ == "__main__":
    print(*sorted({package for need in NEEDS.values() for package in need.packages.split()}), sep="\n")
