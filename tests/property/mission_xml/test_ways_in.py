"""A value is the same, to the last bit, whichever way it comes in: XML, `--set`, `--vary`, `params=` and Python."""

from __future__ import annotations

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tussle import Simulation
from tussle.batch import Batch, Choice
from tussle.batch.variables import parse_variable
from tussle.declare.columns import MAX_NUMBER
from tussle.errors import ParameterError
from tussle.mission import codecs, read_mission, to_xml
from tussle.mission.paths import with_value

PROBE = '''
"""A plugin with a parameter of each kind."""

import math

from tussle.api import Autonomy, Metric, Param, Interaction


class Probe(Autonomy):
    """Keeps what it is given."""

    plain = Param(0.5, doc="A number.")
    speed = Param(1.0, unit="m/s", ge=0.0, doc="A number with a unit.")
    angle = Param(0.0, unit="rad", text_unit="deg", doc="A number that files have in degrees.")
    reach = Param(math.inf, unit="m", gt=0.0, doc="A number that may be infinite.")
    n = Param(3, doc="A whole number of 64 bits.")
    is_on = Param(True, doc="A truth.")
    place = Param((1.0, 2.0, 3.0), fields="x y yaw", unit="m m rad", text_unit="km m deg", doc="Three.")
    points = Param((), fields="x y", ragged=True, unit="m", doc="A list.")
    size = Param(2, structural=True, ge=1, doc="A whole number that all entities of a group share.")
    word = Param("none", doc="A text.")

    def step(self, g):
        pass


class Judge(Metric):
    """Keeps what it is given, for the world."""

    weight = Param(1.0, unit="kg", doc="A number.")
    n = Param(3, doc="A whole number of 64 bits.")
    is_on = Param(True, doc="A truth.")

    def step(self, w):
        pass
'''
TEXT = (
    '<runscript name="ways"><run end="1" dt="0.1"/><metrics{Judge}>Judge</metrics><entity><name>one</name><count>3</count>'
    "<autonomy{Probe}>Probe</autonomy><motion_model>Still</motion_model></entity></runscript>"
)

any_float = st.floats(-MAX_NUMBER, MAX_NUMBER)
positive = st.floats(5e-324, MAX_NUMBER)
VALUES = {
    "one.Probe.plain": any_float,
    "one.Probe.speed": st.floats(0.0, MAX_NUMBER),
    "one.Probe.angle": any_float,
    "one.Probe.reach": positive | st.just(math.inf),
    "one.Probe.n": st.integers(-(2**63), 2**63 - 1),
    "one.Probe.is_on": st.booleans(),
    "one.Probe.place": st.tuples(any_float, any_float, any_float),
    "one.Probe.points": st.lists(st.tuples(any_float, any_float), max_size=4).map(tuple),
    "one.Probe.size": st.integers(1, 2**63 - 1),
    "one.Probe.word": st.text(st.characters(codec="ascii", categories=["L", "N"]), min_size=1, max_size=8),
    "Judge.weight": any_float,
    "Judge.n": st.integers(-(2**63), 2**63 - 1),
    "Judge.is_on": st.booleans(),
}
SHARED = ("one.Probe.points",)
"""Parameters that `params` does not take: they are the same in all worlds."""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("ways")
    (place / "probe.py").write_text(PROBE)
    (place / "plain.xml").write_text(TEXT.format(Probe="", Judge=""))
    return place


def bits(value):
    """A value of which equal ones have equal bits."""
    if isinstance(value, tuple):
        return tuple(map(bits, value))
    return type(value), value.hex() if isinstance(value, float) else value


def seen(mission, params=None):
    """Hash of all tables at the beginning, and the values that are no columns."""
    with Simulation(mission, 1, params) as sim:
        probe = sim.state.population.groups[0].autonomies[0].plugin
        return sim.state_hash(), bits(probe.size), bits(probe.word)


def ways(folder, path, value):
    """What is seen for each way in."""
    options = {"plugin_files": [folder / "probe.py"]}
    plain = read_mission(folder / "plain.xml", **options).mission
    *_, plugin, name = path.split(".")
    column = (plain.blocks[0].autonomy[0] if plugin == "Probe" else plain.metrics[0]).params()[name]
    text = codecs.written(value, column.units, column.text_units)
    attribute = {"Probe": "", "Judge": ""} | {plugin: f' {name}="{text}"'}
    (folder / "value.xml").write_text(TEXT.format(**attribute))
    yield "XML", seen(read_mission(folder / "value.xml", **options).mission)
    yield "--set", seen(read_mission(folder / "plain.xml", {path: text}, **options).mission)
    yield "read_mission", seen(read_mission(folder / "plain.xml", {path: value}, **options).mission)
    yield "Python", seen(with_value(plain, path, value))
    yield "Python, by a text", seen(with_value(plain, path, text))
    (folder / "written.xml").write_text(to_xml(with_value(plain, path, value)))
    yield "tussle convert", seen(read_mission(folder / "written.xml", **options).mission)
    if path not in SHARED:
        yield "params=", seen(plain, {path: value})
        yield "params=, by a text", seen(plain, {path: text})
    if not isinstance(value, tuple) and value != math.inf:  # a batch takes finite numbers
        for variable in (Choice(path, (value,)), parse_variable(f"{path}={text}")):
            batch = Batch(folder / "plain.xml", runs=1, vary=[variable], **options)
            yield f"--vary {variable.is_text}", seen(batch.missions[0])


@pytest.mark.parametrize("path", VALUES)
def test_a_value_is_the_same_whichever_way_it_comes_in(folder, path):
    @settings(max_examples=8)
    @given(VALUES[path])
    def check(value):
        found = dict(ways(folder, path, value))
        assert len(set(found.values())) == 1, found

    check()


def test_whole_numbers_of_one_world_keep_all_their_bits(folder):
    mission = read_mission(folder / "plain.xml", plugin_files=[folder / "probe.py"]).mission
    numbers = [2**53 + 1, -(2**63), 2**63 - 1]
    with Simulation(mission, [1, 2, 3], params={"one.Probe.n": numbers, "Judge.n": numbers}) as sim:
        assert sim.read("one.Probe.n")[0].tolist() == [[n] * 3 for n in numbers]
        assert sim.read("Judge.n")[0].tolist() == numbers


@pytest.mark.parametrize("value", [2**63, -(2**63) - 1, "9223372036854775808"])
def test_whole_numbers_of_more_than_64_bits_are_refused(folder, value):
    mission = read_mission(folder / "plain.xml", plugin_files=[folder / "probe.py"]).mission
    with pytest.raises(ParameterError, match="it takes a whole number of 64 bits"):
        Simulation(mission, 1, {"one.Probe.n": value})
