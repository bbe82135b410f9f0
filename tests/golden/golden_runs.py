"""Plays golden missions and examples of plugins, and knows the hashes that are kept."""

from __future__ import annotations

import json
from functools import cache
from importlib.util import find_spec
from pathlib import Path

from missions import NAMES, SEEDS, STEPS, mission

from tussle import Simulation
from tussle.mission import read_mission
from tussle.plugins import stock

FILE = Path(__file__).with_name("golden.json")
STOCK = Path(stock.__file__).parent
EXAMPLE_STEPS = 100
"""Steps of an example that are played."""
EXTRAS = {"interaction/graph_interaction": "networkx", "interaction/map_gen_2d": "PIL"}
"""Package that an example needs, of those that `import tussle` does not."""
JSBSIM = ("controller/jsbsim_controllers", "motion/jsbsim_model")
"""Plugins whose examples are flown by JSBSim, so that their hashes depend on the machine; tests/unit/jsbsim plays them."""
LEARNED = ("autonomy/learned",)
"""Likewise by a policy in onnxruntime; tests/unit/stock/test_learned.py plays it."""
SERVED = (
    "autonomy/ardupilot", "autonomy/flight_gear_multiplayer", "autonomy/moos", "autonomy/px4", "autonomy/ros_autonomy",
    "controller/ros_controllers", "interaction/dis", "interaction/grpc_command_string", "interaction/ros_clock_server",
    "interaction/ros_shape_viz", "sensor/ros_compass",
    "sensor/ros_altimeter", "sensor/ros_imu_sensor",
    "autonomy/ros_autonomy/ros2", "interaction/ros_clock_server/ros2",
    "sensor/ros_compass/ros2", "sensor/ros_imu_sensor/ros2",
)  # fmt: skip
"""Plugins whose examples need a server or peers; tests of their own play them."""


@cache
def examples() -> tuple[str, ...]:
    """Modules of the plugins whose examples can be played with the installed packages."""
    names = sorted({module_of(path) for path in stock.examples().values()})
    return tuple(
        n
        for n in names
        if n not in (*JSBSIM, *LEARNED, *SERVED) and (n not in EXTRAS or find_spec(EXTRAS[n]))
    )


def module_of(example: Path) -> str:
    """Module of a plugin, such as "autonomy/boids": a folder with its example, or a file with the example beside it."""
    path = example.parent if example.name == "example.xml" else example.with_suffix("")
    return path.relative_to(STOCK).as_posix()


def example_of(module: str) -> Path:
    """Return the example of a module."""
    folder = STOCK / module
    return folder / "example.xml" if folder.is_dir() else folder.with_suffix(".xml")


def play_example(name: str, seeds=1) -> list[str]:
    """State hash of each world after the first steps of an example, which is read without notes."""
    loaded = read_mission(example_of(name))
    assert loaded.notes == ()
    with Simulation(loaded.mission, seeds=seeds, on_error="raise") as sim:
        sim.step(EXAMPLE_STEPS)
        return hashes_now(sim)


def play_examples(every: int = 1) -> dict[str, str]:
    """State hash of each example that can be played, or of every nth of them."""
    return {name: play_example(name)[0] for name in examples()[::every]}


@cache
def kept_examples() -> dict[str, str]:
    """Module of a plugin -> hash of its example."""
    return json.loads(FILE.read_text(encoding="utf-8"))["examples"]


@cache
def golden() -> dict[str, dict[str, list[str]]]:
    """Mission -> seed (as text) -> hashes after half of the mission's steps and after all."""
    return json.loads(FILE.read_text(encoding="utf-8"))["hashes"]


def kept(name: str, seed: int) -> str:
    """Hash that is kept of a mission's last step."""
    return golden()[name][str(seed)][1]


def simulation(name: str, seeds, **values) -> Simulation:
    """A golden mission that stops at the first failure."""
    return Simulation(mission(name), seeds=seeds, on_error="raise", **values)


def hashes_now(sim: Simulation) -> list[str]:
    """State hash of each world."""
    return [sim.state_hash(world) for world in range(sim.n_worlds)]


def final_hashes(name: str, seeds, **values) -> list[str]:
    """State hash of each world after the mission's steps."""
    with simulation(name, seeds, **values) as sim:
        sim.step(STEPS[name])
        return hashes_now(sim)


def play(name: str) -> dict[str, list[str]]:
    """What golden.json keeps of a mission, from one stack."""
    sim = simulation(name, SEEDS)
    half = STEPS[name] // 2
    sim.step(half)
    first = hashes_now(sim)
    sim.step(STEPS[name] - half)
    return {str(seed): [a, b] for seed, a, b in zip(SEEDS, first, hashes_now(sim), strict=True)}


def play_all(names=NAMES) -> dict[str, dict[str, list[str]]]:
    """The same of several missions."""
    return {name: play(name) for name in names}
