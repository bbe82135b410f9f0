"""Whatever a plugin declares is read by its path and written back, and recorded and observed with the components that it has in a game."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Param
from tussle.declare.columns import Numbers, Output
from tussle.errors import ParameterError
from tussle.mission import paths, read_mission
from tussle.plugins import stock
from tussle.record.plugin_columns import select
from tussle.rl import Own
from tussle.stock import (
    ActuatorFault,
    GoTo,
    JSBSimCompiled,
    JSBSimModelControllerHeadingPID,
    NoisyState,
    SensorFault,
    SingleIntegrator,
    Straight,
)

HAWK = stock.examples()["JSBSimModel"].with_name("hawk")


def game(**values) -> Mission:
    """A game of three entities."""
    return Mission(blocks=[Block(name="a", count=3, **{"motion": SingleIntegrator()} | values)])


def example(name: str) -> Mission:
    return read_mission(name).mission


GAMES = {
    name: partial(example, name)
    for name in {path: name for name, path in stock.examples().items()}.values()
    if stock.load(name).grade == "portable" and "JSBSim" not in name
}
"""The examples of plugins that play without others."""
for _fault in ("freeze", "delay"):  # by which their states have further components
    GAMES[f"actuators {_fault}"] = partial(
        game, autonomy=GoTo(), controller=ActuatorFault(fault=_fault, delay=3)
    )
    GAMES[f"sensors {_fault}"] = partial(
        game,
        autonomy=GoTo(),
        sensor=[NoisyState(), SensorFault(channels="belief_pos_x belief_pos_y", fault=_fault, delay=3)],
    )
GAMES["gusts"] = partial(
    game, speed=24.0, autonomy=Straight(), controller=JSBSimModelControllerHeadingPID(),
    motion=JSBSimCompiled(script_name="patrol.xml", commands="autopilot", jsbsim_root=str(HAWK), gusts="dryden"),
)  # fmt: skip


def columns(owner: object, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Numbers]]:
    """Paths and declarations of the columns of all plugins inside a block."""
    for name, plugin in paths.inside(owner).items():
        yield from (
            ((*path, name, k), column)
            for k, column in plugin.declared(Numbers).items()
            if not (column.ragged or (isinstance(column, Param) and column.structural))
        )
        yield from columns(plugin, (*path, name))


@pytest.mark.parametrize("name", GAMES)
def test_each_column_is_read_and_written_with_all_its_components(name):
    mission = GAMES[name]()
    n_parts = {
        (block, *source.path, source.attribute): len(source.column.parts)
        for source in select(mission, "*")
        for block in source.blocks
    }
    found = 0
    with Simulation(mission, seeds=[1, 2]) as sim:
        sim.step(3)
        before = [sim.state_hash(w) for w in range(2)]
        for block in mission.blocks:
            for path, column in columns(block, (block.name,)):
                try:
                    values, alive = sim.read(".".join(path))
                except ParameterError:  # an output without a reader
                    assert isinstance(column, Output), path
                    continue
                if not alive.any():
                    continue
                sim.write(".".join(path), values)
                assert n_parts.get(path, values[0, 0].size) == values[0, 0].size, path
                if len(path) == 3:
                    assert Own(".".join(path[1:])).width(mission, block.name) == values[0, 0].size, path
                found += 1
        assert found or not any(block.count for block in mission.blocks)
        assert [sim.state_hash(w) for w in range(2)] == before
