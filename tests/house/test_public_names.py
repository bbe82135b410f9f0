"""What `dir` shows of packages: what is public, names that are imported on first use included, and nothing else."""

from __future__ import annotations

import ast
from importlib import import_module
from types import ModuleType

import pytest
from tree import ROOT, parsed, python_files

import tussle


def _defines(path, name: str) -> bool:
    return any(isinstance(node, ast.FunctionDef) and node.name == name for node in parsed(path).body)


FILES = [f for f in python_files("src") if f.name == "__init__.py"]
LAZY = [f for f in FILES if _defines(f, "__getattr__")]


def _module(path) -> ModuleType:
    return import_module(".".join(path.relative_to(ROOT / "src").parent.parts))


@pytest.mark.parametrize("path", LAZY, ids=lambda path: path.parent.name)
def test_a_package_that_imports_on_first_use_lists_what_is_public(path):
    module = _module(path)
    assert _defines(path, "__dir__"), f"{module.__name__} has __getattr__ without __dir__"
    manifest = getattr(module, "manifest", None)
    public = manifest() if manifest else module.__all__
    assert dir(module) == sorted(name for name in public if name.isidentifier())
    for name in dir(module) if manifest is None else ():
        assert getattr(module, name) is not None, name


@pytest.mark.parametrize(
    "path",
    [
        f
        for f in FILES
        if f not in LAZY and f.parent.parent == ROOT / "src" / "tussle" and f.parent.name != "cli"
    ],
    ids=lambda path: path.parent.name,
)
def test_a_part_shows_no_names_that_it_only_uses(path):
    module = _module(path)
    shown = {
        n for n in dir(module) if not n.startswith("_") and not isinstance(getattr(module, n), ModuleType)
    }
    assert shown <= set(getattr(module, "__all__", ()))


@pytest.mark.parametrize("name", ["tussle.stock", "tussle.historic"])
def test_a_star_imports_all_plugins_and_nothing_else(name):
    found: dict[str, object] = {}
    exec(f"from {name} import *", found)
    assert set(found) - {"__builtins__"} == set(dir(import_module(name)))


def test_what_users_begin_with():
    assert {"Mission", "Recorder", "Simulation", "load_run", "read_mission"} <= set(dir(tussle))
    assert not {"Any", "TYPE_CHECKING", "nearest_name"} & set(dir(tussle))
    with pytest.raises(AttributeError, match=r"no attribute 'load_runs' \(did you mean 'load_run'\?\)"):
        tussle.load_runs  # noqa: B018
