"""Names of before the packages were moved: pickles, saved plugins and scripts that hold them still work, and say what is new."""

from __future__ import annotations

import importlib
import pickle
import subprocess
import sys

import pytest

from tussle.former_names import DOORWAYS, FORMER

MOVED = {
    "tussle.columns": "tussle.declare.columns",
    "tussle.neighbors.walk": "tussle.numeric.neighbors.walk",
    "tussle.rays.files": "tussle.world.rays.files",
    "tussle.ros.link": "tussle.plugins.links.ros.link",
    "tussle.stock.autonomy.boids.plugin": "tussle.plugins.stock.autonomy.boids",
    "tussle.stock.autonomy.straight.plugin": "tussle.plugins.stock.autonomy.straight",
    "tussle.historic.autonomy.predator": "tussle.plugins.historic",
    "tussle.historic.sensor.gps": "tussle.plugins.historic",
    "tussle.historic.pid": "tussle.plugins.historic.pid",
    "tussle.plan.sst": "tussle.plugins.plan.sst",
    "tussle.serve.session": "tussle.view.serve.session",
}


@pytest.mark.parametrize(("former", "present"), MOVED.items())
@pytest.mark.filterwarnings("ignore:tussle.* is tussle.* now")
def test_a_former_name_is_the_same_module(former, present):
    assert importlib.import_module(former) is importlib.import_module(present)


def test_it_says_what_is_new():
    script = "from tussle.columns import State; import tussle.columns"
    done = subprocess.run(
        [sys.executable, "-W", "always", "-c", script], capture_output=True, text=True, check=True
    )
    assert done.stderr.count("DeprecationWarning") == 1
    assert (
        "<string>:1: DeprecationWarning: tussle.columns is tussle.declare.columns now; the former name goes in version 0.2"
        in done.stderr
    )


@pytest.mark.parametrize("name", sorted(set(FORMER) - DOORWAYS))
@pytest.mark.filterwarnings("ignore:tussle.* is tussle.* now")
def test_every_former_package_is_there(name):
    assert importlib.import_module(f"tussle.{name}").__name__ == f"tussle.{FORMER[name]}.{name}"


@pytest.mark.parametrize("name", sorted(DOORWAYS))
def test_a_doorway_opens_without_a_warning(name):
    doorway = importlib.import_module(f"tussle.{name}")
    room = importlib.import_module(f"tussle.{FORMER[name]}.{name}")
    names = [each for each in doorway.__all__ if not each.startswith("__")]
    assert names
    assert all(getattr(doorway, each) is getattr(room, each) for each in names)
    if name in ("stock", "historic"):
        assert all(getattr(doorway, each) is getattr(room, each) for each in room.manifest())
        with pytest.raises(AttributeError, match="did you mean 'Boids'"):
            _ = doorway.Bods


@pytest.mark.filterwarnings("ignore:tussle.* is tussle.* now")
@pytest.mark.parametrize(
    ("module", "name"),
    [
        ("tussle.stock.autonomy.straight", "Straight"),
        ("tussle.stock.autonomy.straight.plugin", "Straight"),
        ("tussle.stock.motion.unicycle.plugin", "Unicycle"),
        ("tussle.historic.autonomy.predator", "Predator"),
        ("tussle.historic.sensor.gps", "GPS"),
        ("tussle.historic.motion.simple_car", "SimpleCar"),
    ],
)
def test_a_pickle_of_before_loads(module, name):
    room = importlib.import_module(f"tussle.{module.split('.')[1]}")
    assert pickle.loads(f"c{module}\n{name}\n.".encode()) is getattr(room, name)


@pytest.mark.parametrize("room", ["stock", "historic"])
def test_a_name_that_never_was_is_not_found(room):
    with (
        pytest.raises(ModuleNotFoundError, match=rf"tussle\.plugins\.{room}\.autonomy\.nowhere"),
        pytest.deprecated_call(),
    ):
        importlib.import_module(f"tussle.{room}.autonomy.nowhere")
