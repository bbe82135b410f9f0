"""Each concept of the interface for authors has one name: what doubled another one does not come back."""

from __future__ import annotations

import ast

from tree import ROOT, parsed, python_files, relative

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Interaction, MotionModel
from tussle.stock import Still, manifest

GONE = (
    "caller",
    "table_bodies",
    "integrator",
    "active_outputs",
    "ready_timeout",
    "ready",
    "open_one",
    "most_worlds",
)


def test_what_doubled_another_name_is_gone():
    given = [MotionModel, Autonomy]

    class Looker(Autonomy):
        def step(self, g):
            given.append(g)

    class WorldLooker(Interaction):
        def step(self, w):
            given.append(w)

    game = Mission(blocks=[Block(name="a", autonomy=Looker(), motion=Still())], interactions=[WorldLooker()])
    Simulation(game).step()
    assert len(given) == 4
    assert not [(name, thing) for name in GONE for thing in given if hasattr(thing, name)]


NAMELESS = ("src/tussle/declare/columns.py", "src/tussle/mission/", "src/tussle/engine/", "src/tussle/api/")


def names_in(tree: ast.AST) -> set[str]:
    """Identifiers, and texts that are one name, such as a key or a default; examples in sentences are not."""
    return {
        str(getattr(node, "id", None) or getattr(node, "attr", None) or getattr(node, "value", None))
        for node in ast.walk(tree)
        if isinstance(node, (ast.Name, ast.Attribute, ast.Constant))
    }


def test_what_is_for_all_plugins_names_none():
    files = [path for path in python_files("src") if relative(path).startswith(NAMELESS)]
    classes = {path.partition(":")[2] for path in manifest().values()}
    assert files
    assert not {relative(path): names for path in files if (names := names_in(parsed(path)) & classes)}


def test_nor_do_the_tables_beside_it():
    tables = [f for folder in NAMELESS[1:] for f in (ROOT / folder).glob("*.toml")]
    assert not [f for f in tables if any(f'"{name}"' in f.read_text() for name in manifest())]


def test_the_rule_sees_names():
    assert names_in(ast.parse('x = Boids(); y = stock.Predator; z = {"CPA": 1}; w = "as Still does"')) >= {
        "Boids",
        "Predator",
        "CPA",
    }
    assert "Still" not in names_in(ast.parse('w = "as Still does"'))
