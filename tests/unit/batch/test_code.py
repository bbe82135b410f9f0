"""A batch goes on in a directory only with the code that has played its runs, wherever the plugins come from."""

import importlib
import json
import linecache
import sys
from itertools import count

import pytest

from tussle import Block, Mission, Simulation
from tussle.batch import Batch, InProcess
from tussle.batch.code import plugin_code
from tussle.errors import BatchError
from tussle.stock import SingleIntegrator

CODE = '''
"""Plugins of a notebook."""
import math
from functools import cache, partial
import numpy as np
from tussle.api import Autonomy, EasyAutonomy, EasyMetric, Message, Output, Param, Publish, State, neighbors
from tussle.numeric.kernel import device, kernel

GAIN = 2.0
TABLE = {"slow": [1.0, 2.0], "fast": {3, 4}}
WEIGHTS = np.array([1.0, 2.0])

class Grid:
    """A helper."""
    size = 10.0
    def cell(self, x):
        return x // self.size

def law(x):
    return GAIN * x

@cache
def slow_law(x):
    return 5.0 * x

power = partial(pow, 2.0)

@device
def clamp(x):
    return min(x, 7.0)

@kernel("F Fw")
def fill(x, speed):
    for i in range(x.shape[0]):
        speed[i] = clamp(x[i])

class Base(Autonomy):
    limit = Param(9.0, unit="m/s")
    n = State(dtype=int)
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def helper(self, g):
        return self.limit

    @staticmethod
    def offset():
        return 6.0

    @property
    def width(self):
        return 11.0

class Flier(Base):
    """Flies."""
    @neighbors(50.0, n="count")
    @staticmethod
    def near(distance):
        return distance < 12.0

    def step(self, g):
        """Step."""
        self.velocity[0] = law(self.helper(g)) + slow_law(1.0) + power(2) + self.offset() + self.width + TABLE["slow"][0]
        self.velocity[1] = WEIGHTS[1] + Grid().cell(3.0)
        fill(self.velocity[0], self.velocity[2])
        self.near(g)
        self.n += 1
'''  # fmt: skip
MATTERS = {
    "the step": ("self.n += 1", "self.n += 2"),
    "a global": ("GAIN = 2.0", "GAIN = 3.0"),
    "a list in a dictionary": ("[1.0, 2.0],", "[1.5, 2.0],"),
    "a set": ("{3, 4}", "{3, 5}"),
    "an array": ("np.array([1.0, 2.0])", "np.array([1.0, 2.5])"),
    "a function": ("return GAIN * x", "return GAIN + x"),
    "a cached function": ("return 5.0 * x", "return 5.5 * x"),
    "a partial function": ("partial(pow, 2.0)", "partial(pow, 2.5)"),
    "a device function": ("min(x, 7.0)", "min(x, 7.5)"),
    "a kernel": ("clamp(x[i])", "-clamp(x[i])"),
    "a method of a base": ("return self.limit", "return -self.limit"),
    "a static method of a base": ("return 6.0", "return 6.5"),
    "a property of a base": ("return 11.0", "return 11.5"),
    "a default of a base": ("Param(9.0", "Param(9.5"),
    "a type": ("State(dtype=int)", "State()"),
    "a neighbour law": ("distance < 12.0", "distance < 12.5"),
    "a radius": ("neighbors(50.0", "neighbors(55.0"),
    "a method of a helper": ("x // self.size", "x / self.size"),
    "a value of a helper": ("size = 10.0", "size = 10.5"),
}  # fmt: skip
IS_ALL_THE_SAME = {
    "nothing": ("", ""),
    "lines above": ("import math\n", "import math\n\n\n# a comment\nUNUSED = 1\n"),
    "a docstring": ('"""Step."""', '"""Flies on."""'),
    "docstrings of classes": ('"""Flies."""', '"""Flies fast."""'),
    "a comment": ("self.n += 1", "self.n += 1  # counts"),
}


CELLS = count()


def flier_of(code, name="__main__"):
    """The plugin class of a text, as a cell of a notebook defines it."""
    namespace = {"__name__": name}
    file = f"<cell {next(CELLS)}>"
    linecache.cache[file] = (len(code), None, code.splitlines(keepends=True), file)  # as notebooks do
    exec(compile(code, file, "exec"), namespace)
    return namespace["Flier"]


def mission_of(cls):
    return Mission(blocks=[Block(name="f", count=2, autonomy=cls(), motion=SingleIntegrator())], end=0.3)


def code_of(code, **how):
    return plugin_code([mission_of(flier_of(code, **how))])


@pytest.mark.parametrize("edit", MATTERS)
def test_an_edit_that_can_change_results_changes_the_code(edit):
    then, now = MATTERS[edit]
    assert CODE.count(then) == 1
    assert code_of(CODE) != code_of(CODE.replace(then, now))


@pytest.mark.parametrize("edit", IS_ALL_THE_SAME)
def test_other_edits_do_not(edit):
    assert code_of(CODE) == code_of(CODE.replace(*IS_ALL_THE_SAME[edit], 1))


@pytest.mark.parametrize("name", ["__main__", "kit.fly"])
def test_the_code_names_the_classes_of_the_author(name):
    home = "" if name == "__main__" else "kit.fly."
    assert list(code_of(CODE, name=name)) == [f"{home}Base", f"{home}Flier", "python"]


def test_plugins_of_tussle_have_no_code_of_an_author():
    assert Batch("predator_prey").code == {}


def test_a_batch_is_the_same_after_it_was_played():
    cls = flier_of(CODE)
    before = plugin_code([mission_of(cls)])
    Simulation(mission_of(cls)).step()
    assert plugin_code([mission_of(cls)]) == before


SIMPLE = """
from tussle.api import Autonomy, Output

class Flier(Autonomy):
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g):
        self.velocity[0] = 1.0
"""


def test_a_batch_does_not_go_on_with_a_class_that_was_edited(tmp_path):
    def play(code, runs):
        return Batch(mission_of(flier_of(code, name="kit_of_test")), runs=runs).play(
            tmp_path / "b", InProcess()
        )

    play(SIMPLE, 2)
    play(SIMPLE, 3)
    with pytest.raises(
        BatchError,
        match=r"differs in the code of kit_of_test\.Flier or values that it uses, which have changed",
    ):
        play(SIMPLE.replace("1.0", "2.0"), 4)
    assert json.loads((tmp_path / "b" / "batch.json").read_text())["n_seeds"] == 3


def test_a_batch_does_not_go_on_with_another_release_of_a_package(tmp_path, monkeypatch):
    package = tmp_path / "upgraded_kit"
    package.mkdir()
    (package / "__init__.py").write_text("from .table import SPEED\n" + SIMPLE.replace("1.0", "SPEED"))
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def play(speed, runs):
        (package / "table.py").write_text(f"SPEED = {speed}\n")
        try:
            mission = mission_of(importlib.import_module("upgraded_kit").Flier)
            Batch(mission, runs=runs).play(tmp_path / "b", InProcess())
        finally:
            for name in ("upgraded_kit", "upgraded_kit.table"):
                del sys.modules[name]

    play(1.0, 2)
    play(1.0, 3)
    with pytest.raises(BatchError, match=r"the code of upgraded_kit\.Flier"):
        play(2.5, 4)


def test_a_class_is_the_same_after_a_batch_and_reads_the_globals_of_its_notebook():
    cls = flier_of(
        SIMPLE.replace("= 1.0", "= SPEED").replace("\nclass", "\nSPEED = 1.0\n\nclass"),
        name="notebook_of_test",
    )
    mission, methods = mission_of(cls), dict(vars(cls))
    Batch(mission, runs=1).play(executor=InProcess())
    assert {name: vars(cls)[name] for name in methods} == methods
    cls.step.__globals__["SPEED"] = 4.0
    simulation = Simulation(mission)
    simulation.step(2)
    assert simulation.read("f.vel")[0][0, 0, 0] == 4.0
