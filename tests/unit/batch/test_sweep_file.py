"""What varies, from files: sweep files, and the ranges files of SCRIMMAGE's batch scripts."""

import re

import pytest

from tussle.batch.sweep_file import Sweep, read_sweep
from tussle.batch.variables import Choice, Range
from tussle.errors import ParameterError


@pytest.fixture
def read(tmp_path):
    """Reads a text as the file of a name."""

    def read_text(text, name="sweep.toml"):
        path = tmp_path / name
        path.write_text(text)
        return read_sweep(path)

    return read_text


@pytest.fixture
def problems(read, tmp_path):
    """The problems of a text, a line each, without the folder."""

    def problems_of(text, name="sweep.toml"):
        with pytest.raises(ParameterError) as error:
            read(text, name)
        return str(error.value).replace(f"{tmp_path}/", "").splitlines()

    return problems_of


def test_a_sweep_file(read):
    sweep = read(
        """\ufeff
        runs = 100
        first_seed = 7
        sample = "sobol"
        samples = 50
        sample_seed = 3
        [vary]
        prey_speed = "20:30 kt"
        "prey.count" = { low = 50, high = 100, type = "int" }
        gain = { low = 1e-3, high = 10, scale = "log", levels = 5, unit = "m" }
        tactic = ["keep", "007", 3, true]
        prey.Boids.max_speed = "20,25"
        prey.motion = { vel_max = "30:40", turn.rate = { low = 1, high = 2 } }
        fixed = 4
        """.replace("\ufeff\n", "\ufeff")
    )
    assert sweep == Sweep(
        variables=(
            Range("prey_speed", 20, 30, unit="kt", is_text=True),
            Range("prey.count", 50, 100, is_int=True),
            Range("gain", 1e-3, 10, is_log=True, levels=5, unit="m"),
            Choice("tactic", ("keep", "007", 3, True)),
            Choice("prey.Boids.max_speed", (20, 25), is_text=True),
            Range("prey.motion.vel_max", 30, 40, is_text=True),
            Range("prey.motion.turn.rate", 1, 2),
            Choice("fixed", (4,)),
        ),
        sample="sobol",
        samples=50,
        sample_seed=3,
        runs=100,
        first_seed=7,
    )


def test_explicit_points(read):
    sweep = read(
        """
        runs = 3
        [[points]]
        prey_speed = 20
        prey.motion = "slow"
        [[points]]
        prey.motion = "fast"
        prey_speed = 30.5
        """
    )
    points = (
        {"prey_speed": 20, "prey.motion": "slow"},
        {"prey_speed": 30.5, "prey.motion": "fast"},
    )
    variables = (Choice("prey_speed", (20, 30.5)), Choice("prey.motion", ("slow", "fast")))
    assert sweep == Sweep(variables, runs=3, points=points)


def test_each_problem_has_a_line_with_the_file_and_the_key(problems):
    found = problems(
        """
        runs = 0
        sampels = 5
        sample = "lsh"
        first_seed = "one"
        [vary]
        a = "30:20"
        b = { low = 1, high = 2, lvels = 3 }
        c = { low = 1 }
        d = { low = 1, high = 2, type = "itn" }
        e = { low = 1, high = 2, scale = "lg" }
        f = { low = 1, high = 2, unit = 3 }
        g = { low = "1", high = 2 }
        h = []
        j = 2001-01-01
        k = { low = 1, high = 2, unit = "knots" }
        "x.y" = 1
        x.y = 2
        """
    )
    keys = ["'sampels'", "runs", "first_seed", "sample", *(f"[vary] {name}:" for name in "abcdefghjk"), "[vary] x.y:"]  # fmt: skip
    assert len(found) == len(keys)
    assert all(line.startswith(f"sweep.toml: {key}") for line, key in zip(found, keys, strict=True))
    nearest = {line: re.findall(r"did you mean '(\w+)'", line) for line in found}
    assert [name for names in nearest.values() for name in names] == ["samples", "lhs", "levels", "int", "log", "kt"]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[vary", "not TOML"),
        ("vary = 3", "[vary] is a table"),
        ("[vary]", "[vary] is a table"),
        ("points = 3", "[[points]] are tables"),
        ("[[points]]", "[[points]] are tables"),
        ("[[points]]\nx = 1\n[[points]]\ny = 1", "[[points]] points 0 and 1 differ in 'x'"),
        ("[[points]]\nx = [1]", "[[points]] x: [1]"),
        ("[[points]]\nseed = 1", "[[points]] 'seed' cannot vary"),
        ("sample = ['lhs']", "sample = a list of 1 is not allowed"),
        ("runs = true", "runs = True is not allowed"),
        ("x = " + "[" * 100_000, "nested too deep"),
        (".".join(["vary", *"a" * 2000]) + " = 1", "nested too deep"),
        ("#" * 4_000_001, "4,000,001 bytes"),
    ],
)
def test_one_problem(problems, text, words):
    (line,) = problems(text)
    assert line.startswith("sweep.toml: ")
    assert words in line


def test_points_that_are_given_are_not_sampled(problems):
    found = problems('sample = "lhs"\nsamples = 3\n[vary]\nx = "1:2"\n[[points]]\nx = 1')
    assert [line.split()[1] for line in found] == ["vary", "sample", "samples"]


def test_only_the_first_hundred_problems_are_listed(problems):
    found = problems("[vary]\n" + "\n".join(f"x{i} = '2:1'" for i in range(500)))
    assert (len(found), found[-1]) == (101, "... and more")


def test_files_that_cannot_be_read(tmp_path):
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    for path in (tmp_path / "none.toml", tmp_path, tmp_path / "bad.toml"):
        with pytest.raises(ParameterError, match="cannot be read"):
            read_sweep(path)


RANGES = """<?xml version="1.0"?>
<?xml-stylesheet type="text/xsl" href="http://example.org"?>
<ranges xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" name="Example">
    <max_speed low="15" high="25" type="float"/>
    <!-- <health low="1" high="5" type="int"/> -->
    <count low="10" high="10000" type="int" count="12" scale="log"/>
    <radius low="0" high="9" type="int" vec="1, 2, 5"/>
    <gain low="0" high="1" type="float" vec="1,2.5"/>
    <heading low="0 deg" high="360 deg" type="float" count="5"/>
    <fixed low="3" high="3" type="float"/>
    <first low="3" high="9" type="int" count="1"/>
</ranges>
"""


@pytest.mark.parametrize("name", ["ranges.XML", "ranges.txt"])
def test_a_ranges_file_is_known_by_its_name_or_content(read, name):
    sweep = read(RANGES, name)
    assert sweep == Sweep(
        (
            Range("max_speed", 15, 25, is_text=True),
            Range("count", 10, 10000, is_int=True, is_log=True, levels=12, is_text=True),
            Choice("radius", (1, 2, 5), is_text=True),
            Choice("gain", (1.0, 2.5), is_text=True),
            Range("heading", 0, 360, levels=5, unit="deg", is_text=True),
            Choice("fixed", (3.0,), is_text=True),
            Choice("first", (3,), is_text=True),
        )
    )
    assert all(type(v) is float for v in sweep.variables[3].values)


def test_problems_of_a_ranges_file_have_lines(problems):
    found = problems(
        """<ranges>
        <a low="1" high="2"/>
        <b low="1" high="2" type="str"/>
        <c high="2" tpye="int"/>
        <d low="1" high="2" type="float" scale="lgo"/>
        <e low="one" high="2" type="float"/>
        <f low="3" high="2" type="float"/>
        <g vec="1,a"/>
        <h vec="1,2.5" type="int"/>
        <i low="1" high="2" type="float" count="x"/>
        <j low="1.5" high="2" type="int"/>
        <k vec="1,1"/>
        <l low="1" high="2" type="float"/>
        <l low="1" high="2" type="float"/>
        </ranges>""",
        "ranges.xml",
    )
    places = [*((line, name) for line, name in enumerate("abcdefghijk", 2)), (14, "l")]
    assert [line.split(": ")[:2] for line in found] == [[f"ranges.xml:{i}", name] for i, name in places]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<ranges>", "not well-formed XML"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><ranges/>", "a DOCTYPE is not allowed"),
        ("<ranges/>", "nothing varies"),
        ("<runscript/>", "this is a mission"),
    ],
)
def test_texts_that_are_no_ranges_file(problems, text, words):
    assert words in problems(text, "ranges.xml")[0]
