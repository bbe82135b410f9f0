"""A batch as a Python caller plays it: which runs there are, that each is what it is alone, and that directories are gone on with."""

from __future__ import annotations

import json
import shutil
import threading
import time

import gambles
import pytest
from gambles import counted, game, rows

from tussle import Simulation
from tussle.api import Metric
from tussle.batch import Batch, Choice, InProcess, Processes, Range, load_batch
from tussle.batch.reload import planned_run
from tussle.batch.tasks import Progress
from tussle.errors import BatchError, MissionError, ParameterError, WiringError
from tussle.mission import read_mission
from tussle.stock import SingleIntegrator

PLUGINS = {"plugin_files": [gambles.THIS]}


@pytest.fixture
def mission(tmp_path):
    file = tmp_path / "game.xml"
    file.write_text(gambles.MISSION)
    return file


def hashes(results):
    return dict(zip(results.runs["run"].to_pylist(), results.runs["state_hash"].to_pylist(), strict=True))


# -- each run is what it is alone -----------------------------------------------------------------------------------------------

SCHEMAS = "MotorSchemas"
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


# -- what varies, in Python -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("vary", "points"),
    [
        (["odds=0.1,0.3"], [0.1, 0.3]), ([Choice("odds", (0.1, 0.3))], [0.1, 0.3]), ({"odds": [0.1, 0.3]}, [0.1, 0.3]),
        ({"odds": Choice("other", (0.1, 0.3))}, [0.1, 0.3]), (["odds=0.1:0.3:3"], [0.1, 0.2, 0.3]),
        ({"odds": Range("x", 0.1, 0.3, levels=2)}, [0.1, 0.3]), ({"odds": "0.1:0.3:2"}, [0.1, 0.3]),
    ],
)  # fmt: skip
def test_variables_are_given_in_several_ways(vary, points):
    assert Batch(game, vary=vary).plan.points == [{"odds": value} for value in points]
    assert len(Batch(game, vary={"odds": (0.1, 0.3)}, samples=4).plan.points) == 4


@pytest.mark.parametrize(
    ("options", "error", "words"),
    [
        ({"vary": ["odds=0.1,0.3"], "points": [{"odds": 1}]}, ParameterError, "points"),
        ({"vary": [3]}, ParameterError, "3 is no variable"),
        ({"vary": {"odds": 3}}, ParameterError, "odds: 3"),
        ({"vary": ["odds=0.1,0.3", Range("odds", 0, 1)]}, ParameterError, "odds varies twice"),
        ({"vary": ["odds=0.3:0.1"]}, ParameterError, "odds: "),
        ({"vary": ["odd=0.1:0.3"]}, MissionError, "(did you mean 'odds'?)"),
        ({"vary": ["reds=-1,2"]}, MissionError, "point 0 (reds=-1): "),
        ({"vary": ["blues.motion_model=Still,Stil"]}, MissionError, "point 1 (blues.motion_model=Stil): "),
        ({"settings": {"odd": 0.1}}, MissionError, "(did you mean 'odds'?)"),
        ({"runs": 0}, ParameterError, "runs = 0"),
        ({"vary": ["odds=0.1:0.3"], "samples": 0}, ParameterError, "0 is not allowed"),
        ({"points": []}, ParameterError, "there are no points"),
        ({"first_seed": 2**64}, ParameterError, "18446744073709551615"),
        ({"plugin_files": ["nowhere.py"]}, MissionError, "nowhere.py"),
    ],
)
def test_errors_come_before_anything_is_played(mission, options, error, words):
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


def test_there_is_no_other_run():
    batch = Batch(game(), runs=3)
    for number in (-1, 3):
        with pytest.raises(BatchError, match=f"there is no run {number}; the batch has runs 0 to 2"):
            batch.simulation(number)


class Slow(Metric):
    def step(self, w):
        time.sleep(0.05)


def test_little_is_played_in_this_process_and_much_in_several():
    quick, slow = Batch(game(), runs=2), Batch(game().replace(metrics=[Slow()]), runs=20)
    assert isinstance(quick.executor(), InProcess)
    assert isinstance(slow.executor(n_runs=2), InProcess)  # a second
    if Processes().n > 1:
        assert 2 <= slow.executor().n <= Processes().n
    assert isinstance(slow.executor(processes=1), InProcess)
    assert (quick.executor(processes=3, stack=5).n, quick.executor(processes=3, stack=5).stack) == (3, 5)
    assert quick.executor(stack=5).stack == 5


def test_a_plugin_may_be_defined_in_a_function_but_not_hold_what_cannot_be_sent():
    class Local(Metric):
        lock = None

    assert Batch(game().replace(metrics=[Local()]), runs=1).play(executor=Processes(1)).n_failed == 0
    Local.lock = threading.Lock()
    with pytest.raises(MissionError, match=r"cannot be sent to other processes: .*lock"):
        Batch(game().replace(metrics=[Local()]))


# -- directories ----------------------------------------------------------------------------------------------------------------


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


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"first_seed": 5}, "first_seed (there 1, now 5)"),
        ({"vary": ["odds=0.1,0.4"]}, "variables (there odds=0.1,0.3, now odds=0.1,0.4)"),
        ({"vary": ["odds=0.1:0.3"], "samples": 2}, "variables (there odds=0.1,0.3, now odds=0.1:0.3)"),
        ({"settings": {"end": 2}}, "end (there 1.0, now 2.0)"),
        ({"vary": []}, "n_points (there 2, now 1)"),
        ({}, "the points, the mission or a plugin file have changed"),
    ],
)
def test_another_batch_in_the_same_directory_is_told_with_what_differs(mission, tmp_path, options, words):
    path, usual = tmp_path / "out", {"runs": 2, "vary": ["odds=0.1,0.3"], **PLUGINS}
    Batch(mission, **usual).play(path, InProcess())
    kept = (path / "batch.json").read_bytes()
    if not options:
        mission.write_text(gambles.MISSION.replace("<count>3</count>", "<count>4</count>"))
    with pytest.raises(BatchError, match="out: holds another batch: ") as error:
        Batch(mission, **{**usual, **options}).play(path, InProcess())
    assert words in str(error.value)
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
    for name, weight in (("a", 5), ("b", 6)):
        (tmp_path / "parts" / f"{name}.xml").write_text(f'<metrics weight="{weight}">Chips</metrics>')
        changed = Batch(mission, runs=2, vary=["what=a,b"], **PLUGINS).fingerprint
        assert changed != before
        before = changed
    mission.unlink()
    for number, state_hash in hashes(results).items():
        run = planned_run(tmp_path / "out", number)
        with Simulation(run.mission, run.seed) as simulation:
            assert simulation.run()[0].state_hash == run.state_hash == state_hash


SIDE = """
import numpy as np
import geometry
from tussle.api import Metric, State

class {name}(Metric):
    side = State(per="world")

    def step(self, w):
        self.side[:] = geometry.SIDE

    def result(self, w):
        return {{"{name}": self.side}}
"""


def test_neighbours_of_plugin_files_go_where_the_batch_goes(tmp_path):
    game, plugins = tmp_path / "game.xml", [tmp_path / side / "plugin.py" for side in ("left", "right")]
    for number, plugin in enumerate(plugins):
        plugin.parent.mkdir()
        plugin.write_text(SIDE.format(name=plugin.parent.name.title()))
        (plugin.parent / "geometry.py").write_text(f"SIDE = {number + 1.0}")
    game.write_text(
        "<runscript><run dt='0.1' end='0.3'/><metrics>Left</metrics><metrics>Right</metrics>"
        "<entity><autonomy>Boids</autonomy><motion_model>Unicycle</motion_model></entity></runscript>"
    )
    batch = Batch(game, runs=4, plugin_files=plugins)
    results = batch.play(tmp_path / "out", Processes(2, 2))
    assert hashes(batch.play(executor=InProcess())) == hashes(results)
    for metric, side in (("Left", 1.0), ("Right", 2.0)):
        assert set(results.quantity(f"{metric}.{metric}")) == {side}
    for plugin in plugins:
        shutil.rmtree(plugin.parent)
    run = planned_run(tmp_path / "out", 3)
    with Simulation(run.mission, run.seed) as simulation:
        assert simulation.run()[0].state_hash == run.state_hash


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
        "plugin_files": ["0/gambles.py"], "options": {}, "notes": [],
    }  # fmt: skip
    expected = {
        "format": 1, "name": "A game of chance", "fingerprint": batch.fingerprint, "sample": "lhs", "sample_seed": 4,
        "n_points": 2, "n_seeds": 2, "first_seed": 1, "independent": False, "n_runs": 4, "until": None, "stopped_by": None,
        "command": ["tussle", "batch"], "is_complete": True, "teams": {"1": "reds", "2": "blues"}, "dt": 0.1, "start": 0.0, "end": 1.0,
    }  # fmt: skip
    assert {k: v for k, v in info.items() if k in expected} == expected
    assert load_batch(tmp_path / "out").variables == batch.variables
    assert info["timings"]["wall_s"] > 0.0
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == [
        "alive.parquet", "batch.json", "design.parquet", "lock", "mission", "results.parquet",
    ]  # fmt: skip


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
