"""What objects say of themselves is one line, and their HTML is escaped and small whatever is in it."""

from __future__ import annotations

import math
from html.parser import HTMLParser

import pytest

from tussle import Block, Mission, Recorder, Simulation, load_run
from tussle.api import Autonomy, Input, Param
from tussle.batch import Batch
from tussle.declare import displays
from tussle.declare.columns import Column
from tussle.declare.displays import MAX_HTML, MAX_LINE, counted, decimals, listing, page, shortened, table
from tussle.plugins import stock
from tussle.stock import Boids, SimpleCapture, SimpleCaptureMetrics, Still, Unicycle

HOSTILE = """<script>alert("1")</script>'>&amp;<img src=x onerror=alert(1)>\n\x1b[31m\u202e"""
ALLOWED = {
    "div",
    "strong",
    "table",
    "tr",
    "th",
    "td",
    "svg",
    "g",
    "rect",
    "ellipse",
    "circle",
    "path",
    "title",
}


class Tags(HTMLParser):
    """The tags of a text, which must be closed in order, and its plain text."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.found, self.text = [], set(), ""
        self.feed(text)
        self.close()
        assert not self.open

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)
        self.found.add(tag)
        assert not [name for name, _ in attrs if name.startswith("on")]

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def check(thing, *words: str) -> str:
    """Check both forms, and return the text of the HTML."""
    line, html = repr(thing), thing._repr_html_()
    assert len(line.splitlines()) == 1
    assert len(line) < 5 * MAX_LINE
    assert line.isprintable()
    assert " object at 0x" not in line
    assert len(html) < MAX_HTML
    tags = Tags(html)
    assert tags.found <= ALLOWED
    for word in words:
        assert word in line
    return tags.text


def game(name: str = "Two flocks", **more) -> Mission:
    blocks = [
        Block(name="prey", team=1, count=12, variance=(400, 400, 0), autonomy=Boids(), motion=Unicycle()),
        Block(name="guards", team=2, count=3, position=(90, 0, 0), placement="uniform", half_width=(9, 9, 0), motion=Still()),
    ]  # fmt: skip
    return Mission(
        name=name,
        blocks=blocks,
        end=1.0,
        interactions=[SimpleCapture()],
        metrics=[SimpleCaptureMetrics()],
        **more,
    )


def test_missions_and_blocks():
    text = check(game(), "'Two flocks'", "prey × 12", "guards × 3", "time (1 s)")
    assert "SimpleCapture" in text
    assert "start from above" in text
    assert "<ellipse" in game()._repr_html_()
    assert 'fill="#d55e00"' in game()._repr_html_()  # team 2
    check(game().blocks[0], "'prey'", "team 1", "12 entities", "Boids, Unicycle")
    check(Mission(blocks=[]), "no blocks")


def test_simulations_and_their_results():
    with Simulation(game(), seeds=[4, 5]) as simulation:
        check(simulation, "'Two flocks'", "2 worlds", "seeds 4, 5", "t = 0 s", "prey 24", "guards 6")
        assert "running" in simulation._repr_html_()
        check(simulation.result()[0], "seed 4", "running")
        result, _ = simulation.run()
        check(simulation, "t = 1 s", "ended 2 by time")
        text = check(result, "seed 4", "ended by time", "t = 1 s", "team 1: 12", "score team 1: 0")
        assert "SimpleCaptureMetrics.TeamCapture" in text
    check(simulation, "closed")


def test_runs(tmp_path):
    with Simulation(game(), seeds=3) as simulation, Recorder(simulation, tmp_path / "run"):
        simulation.run()
    run = load_run(tmp_path / "run")
    check(run, str(tmp_path / "run"), "Two flocks", "seed 3", "ended by time", "complete")
    (tmp_path / "run" / "run.json").unlink()
    check(load_run(tmp_path / "run"), "incomplete: run.json is missing")


def test_batches_and_their_results():
    batch = Batch(game(), runs=2, vary={"prey.speed": (1.0, 2.0)}, samples=3)
    assert "prey.speed" in check(batch, "'Two flocks'", "6 runs", "3 points of prey.speed")
    results = batch.play()
    text = check(results, "in memory", "6 of 6 runs", "3 points of prey.speed")
    assert "alive of prey" in text


@pytest.mark.parametrize("name", stock.manifest())
def test_declarations_of_all_plugins(name):
    cls = stock.load(name)
    declared = [
        column for base in cls.__mro__ for column in vars(base).values() if isinstance(column, Column)
    ]
    assert not [column for column in declared if not repr(column).startswith(f"<{type(column).__name__} ")]
    for key, column in cls.params().items():
        check(column, f"<{type(column).__name__} {column.owner}.{key}: default ")
    for column in (*cls.inputs().values(), *cls.outputs().values(), *cls.topics().values()):
        assert repr(column).startswith(f"<{type(column).__name__} {column.owner}.{column.name}")


def test_units_of_channels():
    class Follower(Autonomy):
        """Follows."""

        wind = Input("wind_x wind_y", unit="m/s")

    assert repr(Follower.wind) == "<Input Follower.wind: wind_x wind_y, [m/s]>"


@pytest.mark.parametrize("n", [1, 3000])
def test_whatever_names_say_it_is_escaped_and_small(n):
    blocks = [
        Block(
            name=f"{HOSTILE}{'x<' * 500}{i}".replace(".", ""),
            team=i % 9,
            autonomy=Boids(name=HOSTILE),
            motion=Still(),
        )
        for i in range(n)
    ]
    mission = Mission(name=HOSTILE * 100, blocks=blocks, end=1.0)
    check(mission)
    check(mission.blocks[0])


def test_many_worlds_and_values_stay_small():
    with Simulation(game(name=HOSTILE), seeds=range(300)) as simulation:
        assert "more rows" in check(simulation, "300 worlds", "… (300)")
    check(Param(HOSTILE * 1000, choices=[HOSTILE * 1000, "<" * 100_000], doc=HOSTILE * 1000))


@pytest.mark.parametrize("position", [(1e9, -1e9, 0), (0, 0, 0), (5e-324, 0, 0)])
def test_places_that_cannot_be_drawn_are_left_out(position):
    blocks = [
        Block(name="a", count=2, position=position, variance=(1e18, 0, 0), motion=Still()),
        Block(name="b", position=(-1e9, 1e9, 0), heading=1e30, motion=Still()),
    ]
    mission = Mission(blocks=blocks)
    check(mission)
    assert not {"nan", "inf"} & set(mission._repr_html_().replace('"', " ").split())


def test_tables_say_what_they_leave_out():
    text = Tags(table([str(i) for i in range(20)], ([n] * 20 for n in range(1000)))).text
    assert "more columns" in text
    assert "more rows" in text
    assert "first" not in page("t", [], "first" * MAX_HTML, "<div>second</div>")
    assert (shortened("a\nb\t" + "c" * 99, 8), counted(1, "world"), counted(2, "world")) == (
        "a b ccc…",
        "1 world",
        "2 worlds",
    )
    assert listing(range(8)) == "0, 1, 2, 3, 4, 5, … (8)"


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (0.123456789, 6, "0.123457"), (0.1235, 4, "0.1235"), (1234.5678, 6, "1,234.57"), (1234567.8, 6, "1,234,568"),
        (12345.6, 4, "12,346"), (-0.5, 4, "-0.5"), (1.2e-7, 6, "1.2e-7"), (3e12, 6, "3e12"), (2.0, 6, "2"), (math.nan, 6, "nan"),
        (-math.inf, 4, "-inf"), (123456, 6, "123456"), ("text", 6, "text"), (True, 6, "True"),
    ],
)  # fmt: skip
def test_numbers_are_written_in_one_way(value, digits, text):
    assert displays.number(value, digits) == text


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("power", [-300, -40, -12, -9, -3, 0, 5, 14, 15, 16, 99, 300])
def test_estimates_of_any_size_are_short_and_keep_the_digits_of_their_interval(power, sign):
    """A quantity in an unusual unit is neither shown as 0 nor with a hundred digits."""
    low, high = sorted((sign * 1.2345 * 10.0**power, sign * 1.5678 * 10.0**power))
    digits = 1 - math.floor(math.log10(high - low))
    for value in (low, high):
        text = decimals(value, digits)
        assert len(text) <= 20
        assert float(text.replace(",", "")) == pytest.approx(value, abs=0.5000001 * 10.0**-digits)
    assert decimals(0.0, 30) == "0.000000000"
