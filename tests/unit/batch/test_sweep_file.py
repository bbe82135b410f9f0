"""What varies, from files: sweep files, and the ranges files of SCRIMMAGE's batch scripts."""

import pytest

from tussle.batch.sampling import sample
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
    """What is told of a text, a line each, without the folder."""

    def told(text, name="sweep.toml"):
        with pytest.raises(ParameterError) as error:
            read(text, name)
        return str(error.value).replace(f"{tmp_path}/", "").splitlines()

    return told


def test_a_sweep_file(read):
    sweep = read(
        """
        runs = 100
        first_seed = 7
        sample = "sobol"
        samples = 50
        sample_seed = 3
        [vary]
        prey_speed = "20:30 kt"
        "prey.count" = { low = 50, high = 100, type = "int" }
        gain = { low = 1e-3, high = 10, scale = "log", levels = 5, unit = "m" }
        tactic = ["keep", "switch", 3, true]
        prey.Boids.max_speed = "20,25"
        prey.motion = { vel_max = "30:40", turn.rate = { low = 1, high = 2 } }
        fixed = 4
        """
    )
    assert sweep == Sweep(
        variables=(
            Range("prey_speed", 20, 30, unit="kt", is_text=True),
            Range("prey.count", 50, 100, is_int=True),
            Range("gain", 1e-3, 10, is_log=True, levels=5, unit="m"),
            Choice("tactic", ("keep", "switch", 3, True)),
            Choice("prey.Boids.max_speed", (20, 25), is_text=True),
            Range("prey.motion.vel_max", 30, 40, is_text=True),
            Range("prey.motion.turn.rate", 1, 2),
            Choice("fixed", (4,)),
        ),
        sample="sobol",
        n_samples=50,
        sample_seed=3,
        n_seeds=100,
        first_seed=7,
    )


def test_what_a_file_does_not_say_is_none(read):
    assert read('[vary]\nx = "0:1"') == Sweep(
        (Range("x", 0, 1, is_text=True),), None, None, None, None, None, None
    )


def test_a_mark_that_editors_put_before_a_text_is_no_part_of_it(read):
    assert read('\ufeff[vary]\nx = "0:1"').variables == (Range("x", 0, 1, is_text=True),)


def test_texts_of_a_list_stay_texts(read):
    (variable,) = read('[vary]\nx = ["007", "1.50", "a, b", ""]').variables
    assert variable.values == ("007", "1.50", "a, b", "")


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
    assert sweep.points == (
        {"prey_speed": 20, "prey.motion": "slow"},
        {"prey_speed": 30.5, "prey.motion": "fast"},
    )
    assert sweep.variables == (Choice("prey_speed", (20, 30.5)), Choice("prey.motion", ("slow", "fast")))
    assert sweep.n_seeds == 3


def test_all_problems_are_told_at_once_with_the_file(problems):
    told = problems(
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
        i = [[1, 2]]
        j = 2001-01-01
        k = { low = 1, high = 2, unit = "knots" }
        "x.y" = 1
        x.y = 2
        """
    )
    expected = [
        "'sampels' is unknown (did you mean 'samples'?); there are: runs, first_seed, sample, samples, sample_seed, vary, points",
        "runs = 0 is not allowed; it takes a whole number >= 1",
        "first_seed = 'one' is not allowed; it takes a whole number >= 0",
        "sample = 'lsh' is not allowed (did you mean 'lhs'?); there are: lhs, sobol",
        "[vary] a: the low bound 30 is above the high bound 20",
        "[vary] b: 'lvels' is unknown (did you mean 'levels'?); there are: low, high, type, scale, levels, unit",
        "[vary] c: it has no high",
        "[vary] d: type = 'itn' is not allowed (did you mean 'int'?); there are: real, int",
        "[vary] e: scale = 'lg' is not allowed (did you mean 'log'?); there are: linear, log",
        "[vary] f: unit = 3 is not allowed",
        "[vary] g: low is a number, not '1'",
        "[vary] h: there is nothing to choose from",
        "[vary] i: [1, 2] cannot be chosen",
        "[vary] j: datetime.date(2001, 1, 1) cannot be chosen",
        "[vary] k: 'knots' is not a unit (did you mean 'kt'?)",
        "[vary] x.y: it varies twice",
    ]
    assert len(told) == len(expected)
    for line, begin in zip(told, expected, strict=True):
        assert line.startswith(f"sweep.toml: {begin}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("[vary", "this is not TOML: Expected ']'"),
        ("vary = 3", "vary is a table: [vary] and below it lines such as"),
        ("[vary]", "[vary] is empty"),
        ("points = 3", "points are tables: [[points]] and below it"),
        ("[[points]]", "points are tables: [[points]] and below it"),
        ("[[points]]\nx = 1\n[[points]]\ny = 1", "[[points]] point 1 has no value of 'x', others have"),
        ("[[points]]\nx = [1]", "[[points]] x: [1] cannot be chosen"),
        ("[[points]]\nseed = 1", "[[points]] 'seed' cannot vary"),
        ("sample = ['lhs']", "sample = ['lhs'] is not allowed"),
        ("runs = true", "runs = True is not allowed"),
        ("x = " + "[" * 100_000, "lists or tables stand in one another too deep"),
        (".".join(["vary", *"a" * 2000]) + " = 1", "lists or tables stand in one another too deep"),
        ("#" * 4_000_001, "cannot be read: its size is 4,000,001 bytes; the limit is 4,000,000"),
    ],
)
def test_one_problem(problems, text, said):
    (line,) = problems(text)
    assert line.startswith(f"sweep.toml: {said}")


def test_points_that_are_given_are_not_sampled(problems):
    told = problems('sample = "lhs"\nsamples = 3\n[vary]\nx = "1:2"\n[[points]]\nx = 1')
    assert [line.split(" and ")[0] for line in told] == [
        f"sweep.toml: {key}" for key in ("vary", "sample", "samples")
    ]


def test_a_file_of_nothing_but_mistakes_is_told_in_part(problems):
    told = problems("[vary]\n" + "\n".join(f"x{i} = '2:1'" for i in range(500)))
    assert len(told) == 101
    assert told[-1] == "... and more"


def test_files_that_cannot_be_read(tmp_path):
    with pytest.raises(ParameterError, match=r"none.toml: cannot be read: No such file"):
        read_sweep(tmp_path / "none.toml")
    with pytest.raises(ParameterError, match=r"cannot be read: it is not a regular file"):
        read_sweep(str(tmp_path))
    (tmp_path / "bad.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ParameterError, match=r"bad.toml: cannot be read: 'utf-8' codec"):
        read_sweep(tmp_path / "bad.toml")


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


def test_a_ranges_file(read):
    sweep = read(RANGES, "ranges.xml")
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
    assert len(sample(sweep.variables, "lhs", 5)) == 5


def test_a_ranges_file_is_known_by_its_content_as_well(read):
    assert read(RANGES, "ranges.txt") == read(RANGES, "ranges.XML")
    assert read('[vary]\nx = "0:1"', "sweep.txt").variables == (Range("x", 0, 1, is_text=True),)


def test_problems_of_a_ranges_file_have_lines(problems):
    told = problems(
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
    expected = {
        2: "a: it has no type; a range has low, high and type",
        3: "b: type='str' is not allowed; there are: float, int",
        4: "c: the attribute 'tpye' is unknown (did you mean 'type'?); there are: low, high, type, count, vec, scale",
        5: "d: scale='lgo' is not allowed (did you mean 'log'?)",
        6: "e: 'one' is not a number",
        7: "f: the low bound 3 is above the high bound 2",
        8: "g: 'a' is not a number; vec takes numbers",
        9: "h: 2.5 is not a whole number, and type='int' asks for such",
        10: "i: count='x' is not allowed; it takes a whole number",
        11: "j: the bounds of a range of whole numbers are whole, 1.5 is not",
        12: "k: the choice 1.0 stands there twice",
        14: "l: it stands there twice",
    }
    assert len(told) == len(expected)
    for line, (number, begin) in zip(told, expected.items(), strict=True):
        assert line.startswith(f"ranges.xml:{number}: {begin}")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("<ranges>", "ranges.xml:1: this is not well-formed XML"),
        ("<!DOCTYPE r [<!ENTITY a 'b'>]><ranges/>", "ranges.xml:1: a DOCTYPE is not allowed"),
        ("<ranges/>", "ranges.xml:1: nothing varies; write tags such as"),
        ("<runscript/>", "ranges.xml:1: this is a mission; a ranges file has one tag for each placeholder"),
    ],
)
def test_texts_that_are_no_ranges_file(problems, text, said):
    assert problems(text, "ranges.xml")[0].startswith(said)
