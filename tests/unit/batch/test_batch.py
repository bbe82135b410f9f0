"""A batch as a Python caller plays it: which runs there are, that each is what it is alone, and that directories are gone on with."""

from __future__ import annotations

import json
import time

import gambles
import numpy as np
import pytest
from gambles import game

from tussle import Simulation
from tussle.api import Metric
from tussle.batch import Batch, Choice, InProcess, Processes, Range, load_batch
from tussle.batch.batch import MOST_CHECKED
from tussle.batch.progress import Progress
from tussle.batch.reload import planned_run
from tussle.batch.stopping import ROUND, quantities_of
from tussle.batch.tasks import Finished
from tussle.errors import BatchError, MissionError, ParameterError, WiringError
from tussle.mission import read_mission
from tussle.stock import SingleIntegrator

PLUGINS = {"plugin_files": [gambles.THIS]}


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    return file


def rows(results):
    """All that came of a batch, but for what it cost."""
    return results.table.drop_columns(["cpu_s", "host"]).to_pylist(), results.alive.to_pylist()


def hashes(results):
    return dict(zip(results.runs["run"].to_pylist(), results.runs["state_hash"].to_pylist(), strict=True))


# -- each run is what it is alone -----------------------------------------------------------------------------------------------

SCHEMAS = "MotorSchemas pub_vel_vec='true'"
FILE_VARY = {
    "numbers": ["odds=0.05:0.4", "health=1:3", "SimpleCapture.capture_range=1:60", "blues.speed=0:3"],
    "counts": ["reds=2,4"],
    "structure": ["run.dt=0.1,0.05", "end=0.5,1"],
    "text": ["Roulette.rule=all,first", "mood=never,decide"],
    "plugins": [
        f"blues.autonomy={SCHEMAS},{SCHEMAS} max_speed='5'",
        "blues.motion_model=SingleIntegrator,SingleIntegrator max_speed='3'",
    ],
    "units": ["blues.x=30:60 ft"],
}


@pytest.mark.parametrize("name", FILE_VARY)
def test_a_run_of_a_file_is_the_mission_of_its_point_read_alone(mission, name):
    mission.write_text(
        gambles.MISSION.replace(
            "<metrics>", "<entity_interaction>SimpleCapture</entity_interaction><metrics>"
        )
    )
    batch = Batch(
        mission, runs=3, vary=FILE_VARY[name], samples=3 if name in ("numbers", "units") else None, **PLUGINS
    )
    results = batch.play(executor=InProcess(4))
    found = hashes(results)
    assert len(set(found.values())) > 1
    for number, state_hash in found.items():
        point = batch.plan.points[batch.plan.point(number)]
        texts = {v.name: v.text(point[v.name]) for v in batch.variables}
        alone = read_mission(mission, texts, **PLUGINS).mission
        for simulation in (
            batch.simulation(number),
            Simulation(alone, batch.plan.seed(number), on_error="record"),
        ):
            with simulation:
                assert simulation.run()[0].state_hash == state_hash


def made(odds=0.2, reds=4, rule="all", harm=(1.0, 1.0)):
    return game(odds=odds, reds=reds, rule=rule, harm=harm)


@pytest.mark.parametrize(
    ("source", "points"),
    [
        (made, [{"odds": o, "reds": n, "rule": r} for o in (0.1, 0.3) for n in (2, 4) for r in ("all", "first")]),
        (made(), [{"Roulette.odds": 0.1, "reds.count": 2, "run.dt": 0.05}, {"Roulette.odds": 0.3, "reds.count": 4, "run.dt": 0.1}]),
        (made(), [{"Roulette.rule": "first", "reds.health": 1.5}, {"Roulette.rule": "all", "reds.health": 2.5}]),
    ],
    ids=["function", "paths", "text"],
)  # fmt: skip
def test_a_run_of_a_mission_made_in_python_is_that_of_its_point(source, points):
    batch = Batch(source, runs=3, points=points)
    for number, state_hash in hashes(batch.play(executor=InProcess(4))).items():
        with batch.simulation(number) as simulation:
            assert simulation.run()[0].state_hash == state_hash


def test_a_mission_made_in_python_is_that_of_its_file(mission):
    of_file = Batch(mission, runs=4, vary=["odds=0.1,0.3"], **PLUGINS).play(executor=InProcess(3))
    of_python = Batch(game, runs=4, vary={"odds": [0.1, 0.3]}).play(executor=InProcess(3))
    assert rows(of_file) == rows(of_python)


def test_where_and_how_it_is_played_makes_no_difference(mission, tmp_path):
    """On a mission with all kinds of points. Processes are in test_executors.py, interruptions in test_store.py and e2e/batch."""
    options = {"runs": 5, "vary": ["odds=0.1,0.3", "reds=2,4", "how=never,step"], **PLUGINS}
    reference = rows(Batch(mission, **options).play(executor=InProcess(1)))
    assert {r["error"] is None for r in reference[0]} == {True, False}
    for executor in (InProcess(2), InProcess(7), InProcess(64)):
        assert rows(Batch(mission, **options).play(executor=executor)) == reference
    assert rows(Batch(mission, **options).play(tmp_path / "a", InProcess(7))) == reference
    assert rows(load_batch(tmp_path / "a")) == reference


def test_common_seeds_and_seeds_of_their_own(mission):
    common = Batch(mission, runs=2, vary=["odds=0.1,0.1001"], first_seed=5, **PLUGINS)
    own = Batch(mission, runs=2, vary=["odds=0.1,0.1001"], first_seed=5, independent=True, **PLUGINS)
    assert [common.run(r).seed for r in range(4)] == [5, 5, 6, 6]
    assert [own.run(r).seed for r in range(4)] == [5, 6, 7, 8]
    assert own.play(executor=InProcess()).runs["seed"].to_pylist() == [5, 6, 7, 8]


def test_the_last_seeds_of_all_are_played(mission, tmp_path):
    batch = Batch(mission, runs=2, first_seed=2**64 - 2, **PLUGINS)
    results = batch.play(tmp_path / "out", InProcess())
    assert results.runs["seed"].to_pylist() == [2**64 - 2, 2**64 - 1]
    assert planned_run(tmp_path / "out", 1).seed == 2**64 - 1
    for number, state_hash in hashes(results).items():
        with batch.simulation(number) as simulation:
            assert simulation.run()[0].state_hash == state_hash


# -- what varies, in Python -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "vary",
    [
        ["odds=0.1,0.3"],
        [Choice("odds", (0.1, 0.3))],
        {"odds": [0.1, 0.3]},
        {"odds": "0.1,0.3"},
        {"odds": Choice("other", (0.1, 0.3))},
    ],
)
def test_choices_are_said_in_several_ways(vary):
    assert Batch(game, vary=vary).plan.points == [{"odds": 0.1}, {"odds": 0.3}]


def test_ranges_are_said_in_several_ways():
    one = Batch(game, vary={"odds": (0.1, 0.3)}, samples=4)
    two = Batch(game, vary=[Range("odds", 0.1, 0.3)], samples=4, sample="lhs")
    assert one.plan.points == two.plan.points
    assert Batch(game, vary=["odds=0.1:0.3:3"]).plan.points == [{"odds": 0.1}, {"odds": 0.2}, {"odds": 0.3}]


def test_units_reach_missions_made_in_python():
    given = Batch(game(), points=[{"reds.speed": "10 kt"}]).missions
    varied = Batch(game(), vary=[Range("reds.speed", 0, 10, levels=2, unit="kt")]).missions
    assert given[0].blocks[0].speed == varied[1].blocks[0].speed == pytest.approx(5.1444, rel=1e-4)


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        (
            {"vary": ["odds=0.1,0.3"], "points": [{"odds": 1}]},
            ParameterError,
            "points are given, so there is nothing to vary",
        ),
        ({"vary": [3]}, ParameterError, "3 does not say what varies"),
        ({"vary": {"odds": 3}}, ParameterError, "odds: 3 says nothing of what varies"),
        ({"vary": ["odds=0.1,0.3", Range("odds", 0, 1)]}, ParameterError, "odds varies twice"),
        ({"vary": ["odds=0.3:0.1"]}, ParameterError, "the low bound 0.3 is above the high bound 0.1"),
        ({"vary": ["odd=0.1:0.3"]}, MissionError, "(did you mean 'odds'?)"),
        ({"vary": ["reds=-1,2"]}, MissionError, "point 0 (reds=-1): "),
        ({"vary": ["blues.motion_model=Stil,Still"]}, MissionError, "did you mean 'Still'?"),
        ({"vary": ["blues.motion_model=Still,Stil"]}, MissionError, "point 1 (blues.motion_model=Stil): "),
        ({"settings": {"odd": 0.1}}, MissionError, "(did you mean 'odds'?)"),
        ({"runs": 0}, ParameterError, "runs = 0 is not allowed"),
        ({"vary": ["odds=0.1:0.3"], "samples": 0}, ParameterError, "0 is not allowed"),
        ({"points": []}, ParameterError, "there are no points"),
        ({"first_seed": 2**64}, ParameterError, "from 0 to 2^64 - 1"),
        ({"plugin_files": ["nowhere.py"]}, MissionError, "nowhere.py: there is no such plugin file"),
    ],
)
def test_what_is_wrong_is_told_before_anything_is_played(mission, options, error, words):
    with pytest.raises(error) as caught:
        Batch(mission, **{**PLUGINS, **options})
    assert words in str(caught.value)


def test_a_mission_that_cannot_be_played_is_told_before_anything_is_written(tmp_path):
    unsteered = game().blocks[0].replace(motion=SingleIntegrator())
    batch = Batch(
        game().replace(blocks=[unsteered]), runs=2, points=[{"Roulette.odds": 0.1}, {"Roulette.odds": 0.2}]
    )
    for directory in (tmp_path / "out", None):
        with pytest.raises(WiringError):
            batch.play(directory, InProcess())
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("trouble", [{"how": "start"}, {"how": "leave", "at": 0}], ids=["start", "leave"])
def test_what_fails_with_a_seed_does_not_keep_the_batch_from_being_played(trouble):
    batch = Batch(game(**trouble), runs=3, first_seed=3)
    batch.check()
    assert batch.play(executor=InProcess()).n_failed == 1


def test_some_groups_are_tried_before_the_batch(monkeypatch):
    begun = []
    simulation = Batch.simulation
    monkeypatch.setattr(
        Batch, "simulation", lambda self, number: begun.append(number) or simulation(self, number)
    )
    counts = [n // 2 for n in range(2, 2 * MOST_CHECKED + 12)]  # two points of each group
    batch = Batch(game(), runs=1, points=[{"reds.count": n} for n in counts])
    batch.check()
    batch.check()
    assert begun == [2 * i for i in range(MOST_CHECKED)]


def test_there_is_no_other_run():
    batch = Batch(game(), runs=3)
    for number in (-1, 3):
        with pytest.raises(BatchError, match=f"there is no run {number}; the batch has runs 0 to 2"):
            batch.simulation(number)


class Slow(Metric):
    def step(self, w):
        time.sleep(0.05)


def test_little_is_played_in_this_process_and_much_in_several():
    quick, slow = Batch(game(), runs=20), Batch(game().replace(metrics=[Slow()]), runs=20)
    assert isinstance(quick.executor(), InProcess)
    assert isinstance(slow.executor(n_runs=2), InProcess)  # a second
    if Processes().n > 1:
        assert 2 <= slow.executor().n <= Processes().n
    assert isinstance(slow.executor(processes=1), InProcess)
    assert (quick.executor(processes=3, stack=5).n, quick.executor(processes=3, stack=5).stack) == (3, 5)
    assert quick.executor(stack=5).stack == 5


def test_a_mission_that_cannot_be_handed_on_is_told():
    class Local(Metric):
        pass

    with pytest.raises(
        MissionError,
        match=r"cannot be handed to those who play it: .*Local.*; plugins are defined at the head",
    ):
        Batch(game().replace(metrics=[Local()]))


# -- directories ----------------------------------------------------------------------------------------------------------------


def counted(batch, path, until=None, executor=None):
    """Play, and say how many runs were played now."""
    numbers = []
    results = batch.play(
        path,
        executor or InProcess(5),
        until=until,
        on_progress=lambda p: numbers.append((p.n_before, p.n_done)),
    )
    return results, numbers[-1][1] - numbers[-1][0]


def test_the_same_again_plays_nothing_and_more_plays_what_is_missing(mission, tmp_path):
    def batch(runs):
        return Batch(mission, runs=runs, vary=["odds=0.1,0.3"], **PLUGINS)

    path = tmp_path / "out"
    assert counted(batch(4), path)[1] == 8
    results, n = counted(batch(4), path)
    assert (n, results.n_runs) == (0, 8)
    results, n = counted(batch(7), path)
    assert (n, results.n_runs) == (6, 14)
    assert rows(results) == rows(batch(7).play(executor=InProcess(3)))
    results, n = counted(batch(4), path)
    assert (n, results.n_runs) == (0, 14)


def test_another_batch_in_the_same_directory_is_told_with_what_differs(mission, tmp_path):
    path = tmp_path / "out"
    Batch(mission, runs=2, vary=["odds=0.1,0.3"], **PLUGINS).play(path, InProcess())
    kept = (path / "batch.json").read_bytes()
    for options, words in [
        ({"first_seed": 5}, "it differs in first_seed (there 1, now 5)"),
        ({"independent": True}, "it differs in independent (there False, now True)"),
        ({"vary": ["odds=0.1,0.4"]}, "it differs in variables (there odds=0.1,0.3, now odds=0.1,0.4)"),
        (
            {"vary": ["odds=0.1:0.3"], "samples": 2},
            "it differs in variables (there odds=0.1,0.3, now odds=0.1:0.3)",
        ),
        ({"settings": {"reds": 3}}, "it differs in mission"),
        ({"settings": {"end": 2}}, "end (there 1.0, now 2.0)"),
        (
            {"vary": []},
            "it differs in variables (there odds=0.1,0.3, now nothing), sample (there grid, now nothing), n_points (there 2, now 1)",
        ),
    ]:
        with pytest.raises(BatchError, match="out: holds another batch: ") as error:
            Batch(mission, **{"runs": 2, "vary": ["odds=0.1,0.3"], **PLUGINS, **options}).play(
                path, InProcess()
            )
        assert words in str(error.value)
    mission.write_text(gambles.MISSION.replace("<count>3</count>", "<count>4</count>"))
    with pytest.raises(
        BatchError, match="the points, the mission or a plugin file have changed since; choose another"
    ):
        Batch(mission, runs=2, vary=["odds=0.1,0.3"], **PLUGINS).play(path, InProcess())
    assert (path / "batch.json").read_bytes() == kept


def test_a_batch_is_known_again_by_all_that_its_runs_depend_on(mission, tmp_path):
    def fingerprint(source=mission, **options):
        return Batch(source, **{"runs": 3, **PLUGINS, **options}).fingerprint

    same = fingerprint()
    assert fingerprint(runs=30) == same
    plugin = tmp_path / "own.py"
    plugin.write_text(gambles.THIS.read_text())
    copied = fingerprint(plugin_files=[plugin])
    plugin.write_text(gambles.THIS.read_text() + "\n# another one\n")
    assert fingerprint(plugin_files=[plugin]) != copied
    others = [
        fingerprint(**o)
        for o in ({"first_seed": 2}, {"independent": True}, {"ends_by_time": True}, {"settings": {"odds": 1}})
    ]
    python = [fingerprint(game(odds=o), plugin_files=[]) for o in (0.1, 0.1, 0.1 + 1e-16)]
    assert (same, python[0]) == (copied, python[1])
    assert len({same, *others, *python}) == 7


def test_files_that_only_some_points_include_belong_to_the_batch(mission, tmp_path):
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="parts/${what=a}.xml"/>'
    mission.write_text(gambles.MISSION.replace("<metrics>Chips</metrics>", include))
    (tmp_path / "parts").mkdir()
    for name, weight in (("a", 1), ("b", 2)):
        (tmp_path / "parts" / f"{name}.xml").write_text(f'<metrics weight="{weight}">Chips</metrics>')
    batch = Batch(mission, runs=2, vary=["what=a,b"], **PLUGINS)
    results = batch.play(tmp_path / "out", InProcess())
    before = batch.fingerprint
    for name in ("a", "b"):
        (tmp_path / "parts" / f"{name}.xml").write_text('<metrics weight="5">Chips</metrics>')
        changed = Batch(mission, runs=2, vary=["what=a,b"], **PLUGINS).fingerprint
        assert changed != before
        before = changed
    mission.unlink()
    for number, state_hash in hashes(results).items():
        run = planned_run(tmp_path / "out", number)
        with Simulation(run.mission, run.seed) as simulation:
            assert simulation.run()[0].state_hash == run.state_hash == state_hash


def test_what_batch_json_says(mission, tmp_path):
    batch = Batch(
        mission,
        runs=2,
        vary=["odds=0.1:0.3"],
        samples=2,
        sample_seed=4,
        settings={"reds": 3},
        ends_by_time=True,
        **PLUGINS,
    )
    batch.play(tmp_path / "out", InProcess(), command=["tussle", "batch"])
    info = json.loads((tmp_path / "out" / "batch.json").read_text())
    assert info["mission"] == {
        "made_in": "file", "file": "game.xml", "settings": {"reds": "3"}, "ends_by_time": True,
        "plugin_files": ["0/gambles.py"], "options": {},
    }  # fmt: skip
    odds = {
        "kind": "range",
        "name": "odds",
        "low": 0.1,
        "high": 0.3,
        "is_int": False,
        "is_log": False,
        "levels": None,
        "unit": "",
    }
    expected = {
        "format": 1, "name": "A game of chance", "fingerprint": batch.fingerprint, "variables": [odds], "sample": "lhs", "sample_seed": 4,
        "n_points": 2, "n_seeds": 2, "first_seed": 1, "independent": False, "n_runs": 4, "until": None, "stopped_by": None,
        "command": ["tussle", "batch"], "is_complete": True, "teams": {"1": "reds", "2": "blues"}, "dt": 0.1, "start": 0.0, "end": 1.0,
    }  # fmt: skip
    assert {k: v for k, v in info.items() if k in expected} == expected
    assert info["timings"]["wall_s"] > 0.0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "alive.parquet", "batch.json", "design.parquet", "lock", "mission", "results.parquet",
    ]  # fmt: skip


# -- until enough is known ------------------------------------------------------------------------------------------------------


def until_batch(mission, runs=None, **more):
    return Batch(mission, runs=runs, vary=["reds=3,4"], **PLUGINS, **more)


class Enough(Exception):
    pass


@pytest.mark.parametrize("rule", ["score[1]±0.6", "±0.2", "lost[2]±0.3"])
def test_where_a_batch_stops_does_not_depend_on_who_plays_nor_on_interruptions(mission, tmp_path, rule):
    reference = until_batch(mission).play(tmp_path / "reference", InProcess(1), until=rule)
    n = reference.info["n_seeds"]
    assert reference.info["stopped_by"] == reference.info["until"] == rule
    assert 20 <= n < 500
    assert n % ROUND == 0
    assert reference.n_runs == reference.n_planned == 2 * n
    # It is the first round with which it is enough.
    name = rule.partition("±")[0] or "wins[1]"
    half, width = (_widths(reference, name, k) for k in (n - ROUND, n))
    wanted = float(rule.partition("±")[2])
    assert width <= wanted * 1.0000001
    assert n == 20 or half > wanted or rule == "±0.2"
    assert rows(until_batch(mission).play(executor=InProcess(64), until=rule)) == rows(reference)

    def watch(progress):
        if progress.n_done - progress.n_before >= 23:
            raise Enough

    path = tmp_path / "out"
    for _ in range(1000):
        try:
            results = until_batch(mission).play(path, InProcess(13), until=rule, on_progress=watch)
            break
        except Enough:
            pass
    assert rows(results) == rows(reference)


def _widths(results, name, n_seeds):
    """Half the widest of the intervals of a mean at the points, with so many seeds."""
    matrix = results.by_seed(name)[:n_seeds]
    return max(1.96 * matrix.std(axis=0, ddof=1) / np.sqrt(n_seeds))


def test_processes_stop_where_this_process_does(mission):
    reference = rows(until_batch(mission).play(executor=InProcess(1), until="score[1]±0.6"))
    assert rows(until_batch(mission).play(executor=Processes(2, 5), until="score[1]±0.6")) == reference


def test_a_narrower_rule_goes_on_and_a_wider_one_has_enough(mission, tmp_path):
    path = tmp_path / "out"
    first, n_first = counted(until_batch(mission), path, "score[1]±0.6")
    assert counted(until_batch(mission), path, "score[1]±0.6")[1] == 0
    second, n_second = counted(until_batch(mission), path, "score[1]±0.4")
    assert n_second > 0
    assert second.n_runs > first.n_runs
    assert n_first >= first.n_runs
    assert rows(second) == rows(until_batch(mission).play(executor=InProcess(7), until="score[1]±0.4"))
    third, n_third = counted(until_batch(mission), path, "score[1]±0.6")
    assert (n_third, third.n_runs) == (0, second.n_runs)
    assert third.info["stopped_by"] == "score[1]±0.6"
    # Without a rule, it has as many as are asked for and never fewer than are there.
    n_seeds = second.info["n_seeds"]
    assert counted(until_batch(mission, 5), path)[1] == 0
    more, n_more = counted(until_batch(mission, n_seeds + 2), path)
    assert (n_more, more.info["n_seeds"], more.info["stopped_by"]) == (4, n_seeds + 2, None)


def test_a_rule_drops_nothing_that_was_asked_for_before(mission, tmp_path):
    def batch(runs):
        return Batch(mission, runs=runs, vary=["odds=0.1,0.3"], **PLUGINS)

    path = tmp_path / "out"
    before = batch(60).play(path, InProcess())
    after, n = counted(batch(None), path, "score[1]±0.9")
    assert n == 0
    assert rows(after) == rows(before)

    def watch(progress):
        if progress.n_done >= 87:
            raise Enough

    path = tmp_path / "cut"
    with pytest.raises(Enough):
        batch(60).play(path, InProcess(1), on_progress=watch)
    after, n = counted(batch(None), path, "score[1]±0.9")
    assert (n, after.info["n_seeds"]) == (1, 44)  # the other game of the last seed


def test_a_rule_that_is_not_reached_ends_with_the_runs(mission, tmp_path):
    results = until_batch(mission, 25).play(tmp_path / "out", InProcess(), until="score[1]±0.01")
    assert (results.n_runs, results.info["stopped_by"], results.info["until"]) == (50, None, "score[1]±0.01")
    _, n = counted(until_batch(mission, 30), tmp_path / "out", "score[1]±0.01")
    assert n == 10


def test_runs_that_fail_do_not_hold_up_the_end(mission):
    batch = until_batch(mission, settings={"how": "step"})
    results = batch.play(executor=InProcess(32), until="score[1]±0.6")
    assert results.info["stopped_by"] == "score[1]±0.6"
    assert 0 < results.n_failed < results.n_runs < 1000


def test_a_rule_that_means_nothing_is_told(mission, tmp_path):
    with pytest.raises(ParameterError, match="there is no ±"):
        until_batch(mission).play(tmp_path / "out", until="score[1]")
    for directory in (tmp_path / "out", None):
        with pytest.raises(ParameterError, match=r"there is no 'score\[9\]'"):
            until_batch(mission).play(directory, InProcess(), until="score[9]±0.5")
    assert not (tmp_path / "out").exists()
    unscored = Batch(game().replace(metrics=[]), runs=None)
    with pytest.raises(ParameterError, match="these games have no scores"):
        unscored.play(until="±0.1")


class Late(Metric):
    def result(self, w):
        return {"late": w.t} if (w.t > 0.5).all() else {}


def test_a_rule_may_be_about_what_only_whole_games_have():
    batch = Batch(game(odds=0.0).replace(metrics=[Late()]), runs=None)
    results = batch.play(executor=InProcess(), until="Late.late±0.1")
    assert results.info["n_seeds"] == 20


def test_there_are_no_more_runs_than_can_be_kept(mission):
    assert until_batch(mission).plan.n_seeds == 100_000
    many = Batch(game(), runs=None, points=[{"Roulette.odds": i / 1000} for i in range(1000)])
    assert many.plan.n_seeds == 1000


def test_what_a_run_is_asked_for_is_what_results_call_it(mission):
    played = []

    class Watched(InProcess):
        def play(self, package, runs):
            for message in super().play(package, runs):
                if isinstance(message, Finished):
                    played.append(message)
                yield message

    results = Batch(mission, runs=6, settings={"how": "step"}, **PLUGINS).play(executor=Watched())
    for finished in played:
        values = quantities_of(finished)
        for name in results.quantities:
            (value,) = results.quantity(name, [finished.number])
            assert np.array_equal(values.get(name, np.nan), value, equal_nan=True), name


# -- what watches ---------------------------------------------------------------------------------------------------------------


def test_progress_counts_runs_failures_and_wins(mission):
    seen = []

    def watch(progress: Progress):
        seen.append((progress.n_done, progress.n_failed, sum(progress.wins.values())))

    results = Batch(mission, runs=12, settings={"how": "step"}, **PLUGINS).play(
        executor=InProcess(4), on_progress=watch
    )
    done = [s for i, s in enumerate(seen) if i == 0 or s != seen[i - 1]]
    assert [d[0] for d in done] == list(range(13))
    assert done[-1] == (12, 2, 10)
    assert results.n_failed == 2


def test_an_interrupt_keeps_what_is_finished(tmp_path):
    batch = Batch(game().replace(metrics=[Slow()]), runs=4)

    def watch(progress):
        if progress.n_done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        batch.play(tmp_path / "out", InProcess(1), on_progress=watch)
    assert load_batch(tmp_path / "out").n_runs == 2
    assert batch.play(tmp_path / "out", InProcess(1)).n_runs == 4
