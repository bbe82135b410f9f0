"""What a plugin refers to by name is looked up before the first step: blocks, regions, files."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Controller, MotionModel, Plugin
from tussle.errors import TussleError
from tussle.plugins import stock

OWN_NAMES = {
    ("Learned", "block"): "a block of the task",
    ("BulletCollision", "shape"): "no name",
}
OTHER_TEXTS = {
    "FlightGearMultiplayer.aircraft_model": "a file of FlightGear",
    "csv_filename": "a file that is written",
    "module": "a module of the mission's plugin file",
    "task": "a name in the metadata of a file",
    "moos_host": "an address",
    "moos_community": "a name",
    "trim": "a word",
    "ground_collision_altitude": "a height",
    "jsbsim_root": "found with the aircraft",
    "script_name": "found with the aircraft",
}
FILES = {
    "MapGen2D": "map",
    "GraphInteraction": "graph_file",
    "Learned": "policy",
    "TrajectoryRecordPlayback": "trajectory_filename",
    "MOOSAutonomy": "moos_mission_file",
    "JSBSimControl": "aircraft",
    "JSBSimModel": "aircraft",
    "JSBSimCompiled": "aircraft",
    "JoystickAutonomy": "device",
    "JoystickController": "device",
}
"""Plugins that read a file that the mission names, and the parameter."""


KINDS = {Autonomy: "autonomy", Controller: "controller", MotionModel: "motion"}


def params(pattern: str, is_text: bool = True) -> list[tuple[str, str]]:
    """Plugin and name of the parameters whose name or description has a word."""
    return [
        (plugin, name)
        for plugin in stock.manifest()
        for name, param in stock.load(plugin).params().items()
        if param.is_text == is_text
        and not param.choices
        and re.search(pattern, f"{name} {param.doc}", re.IGNORECASE)
    ]


def mission(plugin: Plugin) -> Mission:
    """A mission of one entity with a plugin."""
    kind = next((name for kind, name in KINDS.items() if isinstance(plugin, kind)), "")
    parts = {"motion": stock.load("Still")()} | ({kind: plugin} if kind else {})
    return Mission(blocks=[Block(name="a", **parts)], dt=0.1, end=1.0, interactions=[] if kind else [plugin])


@pytest.mark.parametrize(("plugin", "name"), params(r"\bblocks?\b"))
def test_a_block_that_is_not_there_is_refused_with_the_mission(plugin, name):
    if (plugin, name) in OWN_NAMES:
        return
    made = stock.load(plugin)(**{name: "nowhere"})
    for flag, param in made.params().items():
        if param.dtype is bool and param.structural and not list(made.named_blocks()):
            made = made.replace(**{flag: True})
    assert list(made.named_blocks()) == ["nowhere"], "override named_blocks"
    with pytest.raises(TussleError, match="there is no block 'nowhere'; there are: a"):
        mission(made)


def test_a_region_that_is_not_there_is_refused_with_the_mission():
    named = {
        plugin
        for plugin, name in [*params(r"_ids?\b", False), *params(r"_ids?\b")]
        if "boundar" in about(plugin, name)
    }
    assert len(named) > 5
    silent = [each for each in named if stock.load(each).named_regions is Plugin.named_regions]
    assert silent == ["Boundary"], "override named_regions"


def about(plugin: str, name: str) -> str:
    return str(stock.load(plugin).params()[name].doc.lower())


def test_all_parameters_that_name_a_file_are_known():
    found = {(plugin, name) for plugin, name in params(r"\b(file|folder|path|device)\b|filename")}
    left = {
        f"{plugin}.{name}" for plugin, name in found if FILES.get(plugin) != name and name not in OTHER_TEXTS
    }
    assert not left - set(OTHER_TEXTS)


@pytest.mark.parametrize(("plugin", "name"), FILES.items())
def test_a_file_that_is_not_there_is_told_before_the_first_step(plugin, name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    cls = stock.load(plugin)
    more = {"enable_playback": True} if "enable_playback" in cls.params() else {}
    with pytest.raises(TussleError, match=r"nowhere|JSBSim|jsbsim|onnx|networkx|Pillow"):
        Simulation(mission(cls(**{name: str(Path("no") / "nowhere")}, **more)))
