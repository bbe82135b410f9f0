"""Missions written back, as a mission file and as Python."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[2] / "property" / "fuzz"))

import random_missions

from tussle import Block, Mission
from tussle.api import Interaction
from tussle.errors import MissionError, TussleError
from tussle.mission import Loaded, read_mission, shipped_missions, to_python, to_xml
from tussle.mission.effects import exactly
from tussle.plugins import stock
from tussle.scene import Base, Cuboid, FlatGround, Origin, Plane, Polyhedron, Prism, Scene, Sphere
from tussle.stock import (
    Boids,
    MotorSchemas,
    MoveToGoalMS,
    RandomAttrit,
    SimpleCollision,
    SphereNetwork,
    Still,
)

OWN = [sys.modules[name].__file__ for name in ("random_missions", "golden_plugins")]


def built(code: str) -> Mission:
    names: dict[str, object] = {"__name__": "built"}
    exec(code, names)
    return names["mission"]  # type: ignore[return-value]


def written_and_read(mission: Mission, folder: Path, seed: int | None = None, **more: object) -> Loaded:
    (folder / "m.xml").write_text(to_xml(mission, seed), encoding="utf-8")
    return read_mission(folder / "m.xml", strict=True, **more)


EXAMPLES = {path: name for name, path in stock.examples().items() if "JSBSim" not in name}
"""An example, and a plugin that has it; those of JSBSim need the package."""


@pytest.mark.parametrize("name", [*sorted(shipped_missions()), *EXAMPLES.values()])
def test_shipped_missions_are_read_back_equal(name, tmp_path):
    loaded = read_mission(name)
    again = written_and_read(loaded.mission, tmp_path, 2**64 - 1)
    assert exactly(again.mission) == exactly(loaded.mission) == exactly(built(to_python(loaded.mission)))
    assert (again.seed, again.notes) == (2**64 - 1, ())


def drawn(n: int) -> Iterator[Mission]:
    for number in range(n):
        with suppress(TussleError):  # a rate that does not fit the step, a text that a parameter refuses
            mission = random_missions.draw(number)
            # A file has no more slots than entities: they would have no births.
            blocks = [b.replace(slots=min(b.slots, max(1, b.count))) for b in mission.blocks]
            yield mission.replace(blocks=blocks)


def test_random_missions_are_read_back_equal(tmp_path):
    n_written = 0
    for mission in drawn(200):
        assert exactly(built(to_python(mission))) == exactly(mission)
        if not any(each.rate for each in mission.world_plugins):  # files have no rates of world plugins
            assert exactly(written_and_read(mission, tmp_path, plugin_files=OWN).mission) == exactly(mission)
            n_written += 1
    assert n_written > 20


def test_what_only_a_file_or_only_python_can_leave_out_is_kept(tmp_path):
    mission = Mission(
        blocks=[
            Block(
                name="a", team=3, velocity=(0.0, 0.0, 0.0), speed=5.0, climb="10 deg", heading=0.1, rate=0.3, slots=2,
                count=4, motion=Still(),
                autonomy=[MotorSchemas(behaviors=[MoveToGoalMS(goal=(1, 2, 3), name="home", states="Search, Track")], rate=5)],
            )
        ],
        networks=[SphereNetwork(name="radio")],
        scene=Scene(bases=(Base(3, (1.0, 2.0, 3.0), radius=4.0), Base(3, (0.1, 0.0, 0.0)))),
        end_conditions=("all_dead", "time"),
        update="sequential",
    )  # fmt: skip
    again = written_and_read(mission, tmp_path).mission
    block = again.blocks[0]
    assert (block.velocity, block.speed) == (None, 0.0)  # the same initial state
    assert exactly(again.replace(blocks=mission.blocks)) == exactly(mission)
    assert block.replace(velocity=(0, 0, 0), speed=5.0) == mission.blocks[0]


def a(**values):
    return Block(**{"name": "a", "motion": Still()} | values)


CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
SHAPES = (
    Plane((0, 0, 0), (0, 0, 1)),
    Cuboid(rpy=(0, 0, 1)),
    Sphere(),
    Polyhedron(CORNERS),
    Prism(((0, 0), (1, 0), (0, 1))),
)


@pytest.mark.parametrize(
    "values",
    [
        {"scene": Scene(walls=SHAPES)},
        {"scene": Scene(boundaries=dict(enumerate(SHAPES)) | {"home": FlatGround(2.0)})},
        {"scene": Scene(origin=Origin(1.0, 2.0, 3.0), ground=FlatGround(), bases=(Base(2, (0, 0, 0)),))},
        {"interactions": [RandomAttrit(start_after=math.inf)], "name": 'a "name"\\'},
    ],
)
def test_code_names_all_that_it_needs(values):
    mission = Mission(blocks=[a(name="ä")], **values)
    assert exactly(built(to_python(mission))) == exactly(mission)


class Collision:
    class SimpleCollision(Interaction):
        """Another class of this name."""


@pytest.mark.parametrize(
    ("mission", "words"),
    [
        (Mission(blocks=[a()], scene=Scene(walls=(Sphere(),))), "wall Sphere.*has no tag"),
        (Mission(blocks=[a(name="my block")]), "'my_block'"),
        (Mission(blocks=[a()], interactions=[SimpleCollision(rate=5.0)]), "SimpleCollision: .*loop_rate"),
        (Mission(blocks=[a(team=1)], scene=Scene(bases=(Base(2, (0, 0, 0)),))), "base of team 2"),
        (
            Mission(blocks=[a(autonomy=MotorSchemas(behaviors=[MoveToGoalMS(name="'\"")]))]),
            "block 'a': MotorSchemas: .*quotes",
        ),
    ],
)
def test_what_a_mission_file_cannot_hold_is_named(mission, words):
    with pytest.raises(MissionError, match=words):
        to_xml(mission)
    assert exactly(built(to_python(mission))) == exactly(mission)


def test_two_classes_of_one_name_are_refused():
    mission = Mission(
        blocks=[a(autonomy=Boids())],
        interactions=[SimpleCollision(), Collision.SimpleCollision(name="other")],
    )
    with pytest.raises(MissionError, match="two classes are called SimpleCollision"):
        to_python(mission)
