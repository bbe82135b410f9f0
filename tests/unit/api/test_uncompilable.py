"""Functions of authors that cannot be compiled: the error says which, where, and what to do, without the compiler's own words."""

from __future__ import annotations

import linecache
import re
from importlib.util import module_from_spec, spec_from_file_location

import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import TussleError
from tussle.numeric.refusals import refusal
from tussle.stock import SingleIntegrator, Unicycle

HEAD = """
import numpy as np
from tussle.api import *
from tussle.numeric.kernel import device, kernel
TABLE = {"a": 1.0}
class Thing:
    pass
THING = Thing()
def plain(x):
    return 2.0 * x
"""
CAUSES = {
    "a function without @device": ("plain(1.0)", "mark plain with it"),
    "a dict": ('TABLE["a"]', "TABLE is a dict: compiled functions take numbers, texts, tuples and arrays"),
    "an object": ("THING.x", "THING is a"),
    "a name that is not there": ("nowhere", "name 'nowhere' is not defined"),
    "a function that NumPy lacks": ("np.nothing_like_it(1.0)", "nothing_like_it"),
    "a negative power of a whole number": ("2 ** -int(1.5)", "write 2.0 ** -k, not 2 ** -k"),
    "another": ("int(2.5) ** -1", "write 2.0 ** -k"),
    "a range of a real number": ("len(range(2.5))", r"range takes whole numbers"),
    "a text as a number": ("'a' * 1.5", "No implementation of function"),
}
PLACES = {
    "kernel": """
@kernel("F Fw")
def culprit(x, y):
    for i in range(x.shape[0]):
        y[i] = {cause}
class V(Autonomy):
    \"\"\"Calls a kernel.\"\"\"
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    def step(self, g):
        culprit(g.components("pos")[0], self.velocity[0])
""",
    "device": """
@device
def inner(x):  # culprit, too
    return {cause}
@kernel("F Fw")
def culprit(x, y):
    for i in range(x.shape[0]):
        y[i] = inner(x[i])
class V(Autonomy):
    \"\"\"Calls a kernel.\"\"\"
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    def step(self, g):
        culprit(g.components("pos")[0], self.velocity[0])
""",
    "row law": """
class V(Controller):
    \"\"\"A row law.\"\"\"
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")
    @row_law("speed", "turn_rate", "pitch_rate")
    @staticmethod
    def culprit(pos_x):
        return {cause}, 0.0, 0.0
""",
    "derivative": """
class V(MotionModel):
    \"\"\"A state equation.\"\"\"
    x = State("a b c", unit="m")
    @staticmethod
    def derivative(a):  # culprit
        return {cause}, 0.0, 0.0
    def from_body(self, body, rows):
        self.x[:, rows] = body.pos[:, rows]
    def to_body(self, body):
        body.pos[:] = self.x
        body.vel[:] = 0.0
""",
}


def built(path, place, cause):
    path.write_text(HEAD + PLACES[place].format(cause=cause))
    linecache.checkcache(str(path))
    spec = spec_from_file_location(path.stem, path)
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    others = {"autonomy": {"motion": SingleIntegrator()}, "controller": {"motion": Unicycle()}}
    plugins = others.get(module.V.kind, {}) | {module.V.kind: module.V()}
    return Simulation(Mission(blocks=[Block(name="v", count=2, variance=(9, 9, 0), **plugins)]))


@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize("cause", CAUSES)
def test_the_error_tells_the_function_its_place_and_the_cause(place, cause, tmp_path):
    path = tmp_path / "mine.py"
    words, told = CAUSES[cause]
    with pytest.raises(TussleError) as caught:
        built(path, place, words).step()
    text = str(caught.value)
    assert told in text
    assert (
        re.search(r"mine\.py:\d+: (V\.)?(culprit|inner|derivative) cannot be compiled: ", text)
        or "AttributeError" in text
    )
    assert re.search(r"mine\.py:\d+: ", text)
    for word in ("\x1b", "nopython", "<generated>", "During:", "kernels.py"):
        assert word not in text


LAW = """
class V(Autonomy):
    \"\"\"A neighbour law.\"\"\"
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    @neighbors(100.0, n="sum")
    @staticmethod
    def culprit(offset_x):
        return {cause}
    def step(self, g):
        self.velocity[0] = self.culprit(g).n
"""


@pytest.mark.parametrize(
    "cause", ["math.floor(offset_x)", "math.isnan(offset_x)", "math.gcd(1, 2)", "math.dist(offset_x, 1.0)"]
)
def test_functions_of_math_that_laws_cannot_call_are_named(cause, tmp_path, monkeypatch):
    monkeypatch.setitem(PLACES, "law", "import math" + LAW)
    with pytest.raises(TussleError, match=r"V\.culprit: `math\.\w+` cannot be called here") as caught:
        built(tmp_path / "mine.py", "law", cause).step()
    assert "\x1b" not in str(caught.value)


def test_a_law_that_the_compiler_refuses_is_named(tmp_path, monkeypatch):
    monkeypatch.setitem(PLACES, "law", "import math" + LAW)
    with pytest.raises(TussleError, match=r"mine\.py:\d+: V\.culprit cannot be compiled: ") as caught:
        built(tmp_path / "mine.py", "law", "math.fmod(offset_x, 2.0)").step()
    assert "\x1b" not in str(caught.value)


def test_what_the_compiler_says_about_itself_is_left_out():
    text = (
        'Failed in nopython mode\n\x1b[1mno such thing\x1b[0m\n\nDuring: typing\nFile "<generated>", line 2:'
    )
    assert refusal(ValueError(text)) == "no such thing"
    assert "is a tuple" in refusal(
        ValueError("Untyped freevar name 'q': Cannot determine Numba type of <class 'tuple'>")
    )
