"""People who operate teams: how they are named to tussle view, and how tussle analyze compares their games."""

from __future__ import annotations

import json

import numpy as np
import pytest

from tussle import Block, Mission, Recorder, Simulation
from tussle.api import Metric, State
from tussle.batch.statistics import mean_of
from tussle.messages import Waypoint
from tussle.record import given_by
from tussle.stock import GoTo, SingleIntegrator


@pytest.mark.parametrize(
    ("operators", "reason"),
    [
        (["Ada"], "--operator 'Ada' is not allowed; it takes a name and a team: 'Ada=team 1'"),
        (["Ada=1"], "--operator 'Ada=1' is not allowed"),
        (["x" * 9000], "xxx..."),
        (["Ada=team 1", "Ada=team 2"], "--operator: a name is given twice"),
        (["Ada=team 1", "ada=team 2"], "operator: 'ada' and 'Ada' look alike"),
        (["Ada=team 7"], "operator: 'Ada' cannot operate team 7; there are: 1, 2"),
        (["=team 1"], "operator: '' is not allowed"),
    ],
)
def test_operators_that_cannot_be_are_refused_before_anything_is_recorded(tussle, folder, operators, reason):
    options = [text for each in operators for text in ("--operator", each)]
    code = 2 if "--operator" in reason or "..." in reason else 1
    done = tussle("view", "game.xml", "--no-browser", "--record", "run", *options, code=code)
    assert reason in " ".join(done.stderr.split())
    assert len(done.stderr) < 2000
    assert not (folder / "run").exists()


class Travelled(Metric):
    """How far east the robot of each team is at the end."""

    east = State(unit="m", per="team")

    def step(self, w):
        self.east[w.team_numbers(w.team), w.world] = w.pos[0]

    def result(self, w):
        return {"east": self.east, "west": -self.east, "score": self.east}


WAYS = {"Ada": (30.0, 3), "Ben": (-20.0, 1)}
"""Where to somebody sends their robots [m], and how many orders they give."""


def play(path, seed, operators, *, name="fetch", speed=8.0, start=0):
    """Record a game of 6 s in which each operator sends the robot of a team; returns the result."""
    blocks = [
        Block(name=side, team=team, position=(x, 0, 0), variance=(9, 9, 0), autonomy=GoTo(speed=speed), motion=SingleIntegrator())
        for side, team, x in (("red", 1, 0.0), ("blue", 2, 20.0))
    ]  # fmt: skip
    mission = Mission(name=name, blocks=blocks, end=6.0, dt=0.1, metrics=[Travelled()])
    with Simulation(mission, seed) as sim, Recorder(sim, path):
        sim.step(start)
        for who, team in operators.items():
            x, n = WAYS[who]
            for _ in range(n):
                with given_by(f"{who} (operate team {team})"):
                    sim.publish(Waypoint, network="LocalNetwork", receivers=[team], pos=(x, 0.0, 0.0))
                sim.step()
        sim.run()
        return sim.result()[0]


@pytest.fixture
def games(folder):
    """Six games of three seeds: in the folder first Ada has team 1 and Ben team 2, in second the other way round."""
    found = {}
    for seed in (1, 2, 3):
        for k, sides in enumerate(({"Ada": 1, "Ben": 2}, {"Ben": 1, "Ada": 2})):
            path = folder / ("first", "second")[k] / f"{seed}"
            found[path] = sides, play(path, seed, sides, start=10 * seed)
    return found


def column(found, who, plugin, name):
    return np.array([result.metrics[plugin][name][sides[who]] for sides, result in found.values()], float)


def test_operators_are_compared_over_games_by_the_scores_of_their_own_teams(tussle, folder, games):
    text = json.loads(tussle("analyze", "first", "second", "--json").stdout)
    assert [game["seed"] for game in text["games"]] == [1, 2, 3, 1, 2, 3]
    assert {game["condition"] for game in text["games"]} == {"first", "second"}
    ada, ben = text["operators"]
    assert (ada["name"], ada["games"], ada["teams"], ada["names"]) == ("Ada", 6, [1, 2], {"Waypoint": 18})
    means = {who["name"]: {mean["name"]: mean for mean in who["means"]} for who in (ada, ben)}
    for who, (_, n) in WAYS.items():
        times = column(games, who, "Travelled", "east")
        expected = mean_of("", times)
        found = means[who]["Travelled.east"]
        assert (found["n"], found["value"], found["low"], found["high"]) == (
            expected.n,
            pytest.approx(times[np.isfinite(times)].mean()),
            pytest.approx(expected.low),
            pytest.approx(expected.high),
        )
        assert means[who]["orders"]["value"] == n
        assert means[who]["orders/min"]["value"] == 10 * n
        assert means[who]["entities"]["value"] == 1
    assert means["Ada"]["first order [s]"]["value"] == pytest.approx((1 + 2 + 3 + 1.1 + 2.1 + 3.1) / 6)

    (pair,) = [c for c in text["comparisons"] if c["quantity"] == "Travelled.east" and c["a"] == "Ada"]
    sides = [column(games, who, "Travelled", "east") for who in ("Ada", "Ben")]
    a, b = (np.nanmean(side.reshape(3, 2), axis=1) for side in sides)  # of a seed
    assert (pair["n"], pair["b"]) == (3, "Ben")
    assert pair["difference"] == pytest.approx((b - a).mean())
    assert (pair["n_greater"], pair["n_less"]) == ((b > a).sum(), (b < a).sum())
    first, second = text["conditions"]
    assert (first["name"], first["games"], second["name"]) == ("first", 3, "second")
    assert {mean["name"] for mean in first["means"]} >= {"Travelled.east[1]", "Travelled.east[2]"}


def test_the_tables_have_what_differs_and_what_is_asked_for(tussle, folder, games):
    lines = [line.split() for line in tussle("analyze", "first", "second").stdout.splitlines()]
    assert ["6", "games", "·", "3", "seeds", "·", "2", "operators"] in lines
    assert ["games", "6", "6"] in lines
    assert ["orders", "3", "1"] in lines
    assert ["Waypoint", "18", "6"] in lines
    assert any(line[:1] == ["Travelled.west"] for line in lines)
    assert not any(
        line[:1] in (["alive"], ["Travelled.score"]) for line in lines
    )  # the same in all games, or the score
    lines = [line.split() for line in tussle("analyze", "first", "--quantity", "alive").stdout.splitlines()]
    assert ["alive", "1", "1"] in lines
    assert not any(line[:1] == ["orders"] for line in lines)


def test_one_game_has_no_intervals_and_two_operators_of_one_team_no_difference(tussle, folder):
    play(folder / "both", 4, {"Ada": 1, "Ben": 1})
    text = json.loads(tussle("analyze", folder / "both", "--json").stdout)
    assert "operators" not in text  # one run: who gave which orders
    (folder / "runs").mkdir()
    (folder / "both").rename(folder / "runs/both")
    text = json.loads(tussle("analyze", "runs", "--json").stdout)
    for who in text["operators"]:
        assert who["games"] == 1
        assert all(mean["low"] is mean["high"] is None for mean in who["means"])
    assert text["conditions"] == []
    assert {c["quantity"] for c in text["comparisons"]} == {
        "orders",
        "orders/min",
        "first order [s]",
        "entities",
    }


def test_addresses_without_a_name_and_programs_are_operators_too(tussle, folder):
    robot = Block(name="robot", autonomy=GoTo(), motion=SingleIntegrator())
    for seed in (1, 2):
        with (
            Simulation(Mission(blocks=[robot], end=2.0), seed) as sim,
            Recorder(sim, folder / f"runs/{seed}"),
        ):
            for by in ("", "direct", "operate team 1", "[bold]x[/nope]"):
                with given_by(by):
                    sim.publish(Waypoint, network="LocalNetwork", pos=(1.0, 0.0, 0.0))
            sim.run()
    done = tussle("analyze", "runs")
    assert "[bold]x[/nope]" in done.stdout
    text = json.loads(tussle("analyze", "runs", "--json").stdout)
    assert [who["name"] for who in text["operators"]] == ["", "[bold]x[/nope]", "direct", "operate team 1"]
    assert {"alive", "t"} <= {mean["name"] for who in text["operators"] for mean in who["means"]}


def refusal(tussle, *arguments, code=1):
    done = tussle("analyze", *arguments, code=code)
    assert not done.stdout
    text = " ".join(done.stderr.split())
    assert len(text) < 400, text
    return text


def test_what_cannot_be_compared_is_refused_in_one_sentence(tussle, folder):
    for seed in (1, 2):
        play(folder / f"runs/{seed}", seed, {"Ada": 1})
    runs = [folder / "runs/1", folder / "runs/2"]
    tussle("batch", "game.xml", "--runs", "2", "--processes", "1", "--end", "0.5", "--out", "batch")
    assert "is a batch, which is analyzed alone" in refusal(tussle, runs[0], "batch")
    assert "is a batch, which is analyzed alone" in refusal(tussle, "batch", runs[0])
    assert "is given twice" in refusal(tussle, "runs", runs[1])
    assert "the path does not exist" in refusal(tussle, runs[0], "nowhere", code=4)
    (folder / "empty").mkdir()
    assert "it has none of" in refusal(tussle, runs[0], "empty", code=4)
    assert "is a file" in refusal(tussle, runs[0], "game.xml", code=4)
    assert "--by-point is for batches" in refusal(tussle, *runs, "--by-point")
    assert "no quantity 'orderz' (did you mean 'orders'?)" in refusal(tussle, *runs, "--quantity", "orderz")
    play(folder / "other", 1, {"Ada": 1}, name="carry")
    assert "is of another mission ('carry')" in refusal(tussle, *runs, "other")
    play(folder / "quiet", 1, {})
    assert "nobody gave an order in world 0" in refusal(tussle, *runs, "quiet")
    play(folder / "faster", 3, {"Ada": 1}, speed=9.0)
    assert "the mission has other values than that of" in " ".join(
        tussle("analyze", *runs, "faster").stderr.split()
    )


@pytest.mark.parametrize("file", ["run.json", "summary.csv", "inputs.arrow", "trajectory.arrow"])
def test_runs_that_lack_a_file_are_refused_in_one_sentence(tussle, folder, file):
    for seed in (1, 2):
        play(folder / f"runs/{seed}", seed, {"Ada": 1})
    (folder / "runs/2" / file).unlink()
    text = refusal(tussle, "runs", code=4)
    assert "runs/2" in text
    assert f"{file} is missing" in text or f"{file} does not exist" in text


@pytest.mark.parametrize("file", ["run.json", "summary.csv", "inputs.arrow"])
def test_damaged_runs_are_refused_in_one_sentence(tussle, folder, file):
    for seed in (1, 2):
        play(folder / f"runs/{seed}", seed, {"Ada": 1})
    path = folder / "runs/2" / file
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2] + b"\0" * 40 + data[len(data) // 2 + 40 :])
    text = refusal(tussle, "runs", code=4)
    assert "runs/2" in text
    assert file in text
