"""Searches: they find what is known to be best, go on where they were killed, and say how sure they are."""

from __future__ import annotations

import json
import math
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import bowl
import numpy as np
import optuna
import pyarrow.parquet as pq
import pytest

from tussle.batch.executors import InProcess
from tussle.batch.search.optimization import MAX_TRIALS, Optimization, optimize
from tussle.batch.search.study_store import StudyStore, load_study, notes_on_versions
from tussle.batch.variables import Range
from tussle.errors import BatchError, MissingExtraError, MissionError, ParameterError

PLUGIN = Path(bowl.__file__)
PLACE = {"Bowl.x": (-10.0, 10.0), "Bowl.y": (-10.0, 10.0)}
HERE = InProcess()


def search(objective="Bowl.height", source=None, vary=PLACE, **more):
    """A search of few short games in this process."""
    return optimize(
        bowl.mission() if source is None else source,
        objective,
        vary=vary,
        **({"runs": 2, "trials": 24, "executor": HERE} | more),
    )


def facts(study):
    """All that is known of the trials, comparable where it is not a number."""
    return [repr(trial) for trial in study.trials]


@pytest.fixture
def game(tmp_path):
    path = tmp_path / "bowl.xml"
    path.write_text(bowl.MISSION)
    return path


# -- what is found --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampler", ["tpe", "cmaes"])
def test_the_known_optimum_is_found(sampler):
    best = search(sampler=sampler, trials=96).best
    assert best.values["Bowl.x"] == pytest.approx(bowl.BEST_X, abs=1.0)
    assert best.values["Bowl.y"] == pytest.approx(bowl.BEST_Y, abs=1.0)
    assert bowl.TOP - 1.0 < best.objective <= bowl.TOP


def test_the_smallest_is_found():
    study = search("(t-t)-Bowl.height", minimize=True, trials=64)
    assert study.best.objective == min(t.objective for t in study.trials)
    assert study.best.values["Bowl.x"] == pytest.approx(bowl.BEST_X, abs=2.0)
    assert study.lead.difference < 0.0
    assert [t.objective for t in study.improvements] == sorted(
        (t.objective for t in study.improvements), reverse=True
    )


def test_choices_whole_numbers_and_levels_in_a_file(game):
    vary = ["x=-9:9:int", "y=-4:4:5", "n=1,2", "luck=0,1.5", "rough=1e-6:1e-3:log:4"]
    study = search(source=game, vary=vary, plugin_files=[PLUGIN], trials=64, sample_seed=1)
    for trial in study.trials:
        x, y, n, luck, rough = trial.values.values()
        assert isinstance(x, int)
        assert -9 <= x <= 9
        assert y in (-4.0, -2.0, 0.0, 2.0, 4.0)
        assert n in (1, 2)
        assert luck in (0, 1.5)
        assert rough in Range("r", 1e-6, 1e-3, is_log=True, levels=4).spread(4)
    assert abs(study.best.values["x"] - 3) <= 1
    assert study.best.values["y"] in (-2.0, 0.0)


def test_common_random_numbers():
    """What two trials have in common does not hide which is better: their luck cancels, seed by seed."""
    study = search(source=bowl.mission(luck=5.0), runs=24, trials=16)
    best, second = study.ranking[:2]
    assert best.high - best.low > 1.0
    assert study.lead.difference == pytest.approx(best.objective - second.objective)
    assert study.lead.high - study.lead.low < 1e-9
    assert study.is_clear


def test_the_objective_is_the_mean_of_the_runs(game):
    study = search(
        source=game, vary=["x=0:1"], plugin_files=[PLUGIN], settings={"luck": 3}, runs=5, first_seed=7
    )
    for trial in study.trials:
        height = bowl.TOP - (trial.values["x"] - bowl.BEST_X) ** 2
        luck = [(seed * 7919 % 11) / 10 - 0.5 for seed in range(7, 12)]
        assert trial.by_seed == pytest.approx([height + 3 * v for v in luck], abs=1e-12)
        assert trial.objective == pytest.approx(np.mean(trial.by_seed), abs=1e-12)
        assert trial.low < trial.objective < trial.high


def test_importances():
    study = search(vary=PLACE | {"Bowl.luck": (0.0, 1e-6)}, trials=64)
    shares = study.importances()
    assert list(shares)[-1] == "Bowl.luck"
    assert sum(shares.values()) == pytest.approx(1.0)
    assert search(trials=16).importances() == {}
    assert search(trials=24, vary=["Bowl.x=0:1"]).importances() == {}
    assert search("start[1]", trials=24).importances() == {}


def test_values_that_were_played_are_not_played_again():
    n_played = []

    class Counting(InProcess):
        def play(self, package, runs):
            n_played.append(len(runs))
            return super().play(package, runs)

    study = search(vary={"Bowl.x": [1, 2, 3]}, executor=Counting(), trials=40)
    assert sum(n_played) == 3 * 2
    assert study.n_points == 3
    assert len(study.trials) == 40
    assert {t.values["Bowl.x"]: t.objective for t in study.trials} == {1: 6.0, 2: 9.0, 3: 10.0}
    assert len(study.ranking) == 3


@pytest.mark.slow
def test_processes_and_stacks_change_nothing():
    whole = facts(search(trials=16, runs=4))
    assert facts(search(trials=16, runs=4, executor=InProcess(3))) == whole
    assert facts(search(trials=16, runs=4, executor=None, processes=2)) == whole


# -- what fails -----------------------------------------------------------------------------------------------------------


def test_a_trial_with_a_failed_run_is_failed_and_the_search_goes_on():
    study = search(source=bowl.mission(fails_from=2.0), trials=32)
    failed = [t for t in study.trials if not t.is_complete]
    assert 0 < len(failed) < 32
    assert all((t.values["Bowl.x"] >= 2.0) == (t in failed) for t in study.trials)
    for trial in failed:
        assert trial.n_failed == 2
        assert "too far out" in trial.error
        assert math.isnan(trial.objective)
    assert study.best.values["Bowl.x"] < 2.0
    assert set(study.table["state"].to_pylist()) == {"complete", "failed"}


def test_what_is_no_number_is_a_failure():
    study = search("Bowl.log", trials=16)
    for trial in study.trials:
        assert trial.is_complete == (trial.values["Bowl.x"] >= 0.0)
        if not trial.is_complete:
            assert trial.error == "seed 1: Bowl.log is nan"
            assert trial.n_failed == 2


def test_values_that_cannot_be_played_fail_alone():
    study = search(vary={"Bowl.x": (50.0, 150.0), "Bowl.y": (-1.0, 1.0)}, trials=24)
    for trial in study.trials:
        assert trial.is_complete == (trial.values["Bowl.x"] <= 100.0)
    error = next(t.error for t in study.trials if not t.is_complete)
    assert "<= 100" in error
    assert trial.by_seed == () or trial.is_complete


def test_values_that_can_never_be_played_are_an_error(game):
    with pytest.raises(ParameterError, match="<= 100"):
        search(vary={"Bowl.x": (150.0, 160.0)})
    with pytest.raises(MissionError, match="<= 100"):
        search(source=game, vary=["x=150:160"], plugin_files=[PLUGIN])


# -- constraints -------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampler", ["tpe", "random"])
def test_the_best_keeps_the_constraints(sampler):
    # Without them it is x = 3; so it is as near to it as they allow.
    study = search(
        sampler=sampler,
        vary={"Bowl.x": (0.0, 10.0)},
        subject_to=["Bowl.log < 2", "Bowl.height >= 0"],
        trials=48,
    )
    assert study.best.values["Bowl.x"] == pytest.approx(2.0, abs=0.4)
    assert study.best.values["Bowl.x"] <= 2.0
    assert study.constrained(study.best) == pytest.approx(
        {"Bowl.log": study.best.values["Bowl.x"], "Bowl.height": study.best.objective}
    )
    assert any(
        t.is_complete and not t.is_feasible and t.objective > study.best.objective for t in study.trials
    )
    assert all(t.is_feasible for t in (*study.ranking, *study.improvements))
    # The sampler knows of them: after its first random trials most are allowed.
    allowed = [t.values["Bowl.x"] <= 2.0 for t in study.trials[16:]]
    assert sampler == "random" or np.mean(allowed) > 0.5


def test_constraints_that_no_trial_keeps_are_told_with_the_nearest():
    study = search(vary={"Bowl.x": (1.0, 10.0)}, subject_to=["Bowl.log < 0.5"], trials=16)
    assert (study.best, study.ranking, study.lead, study.improvements) == (None, [], None, [])
    assert study.nearest.values["Bowl.x"] == min(t.values["Bowl.x"] for t in study.trials)


def test_a_game_without_the_constrained_value_fails():
    study = search(vary={"Bowl.x": (-10.0, 10.0)}, subject_to=["Bowl.log < 5"], trials=16)
    failed = [t for t in study.trials if not t.is_complete]
    assert failed
    assert all(t.values["Bowl.x"] < 0.0 for t in failed)
    assert "Bowl.log has no value" in failed[0].error


def test_a_search_with_constraints_goes_on_and_is_another_one_than_without(tmp_path):
    more = {"subject_to": ["Bowl.log <= 2"], "vary": {"Bowl.x": (-1.0, 10.0)}}
    whole = search(trials=24, **more)
    for trials in (8, 13, 24):
        study = search(trials=trials, directory=tmp_path / "out", **more)
    assert facts(study) == facts(whole) == facts(load_study(tmp_path / "out"))
    assert [str(c) for c in load_study(tmp_path / "out").constraints] == ["Bowl.log <= 2.0"]
    with pytest.raises(BatchError, match="it differs in constraints"):
        search(trials=24, directory=tmp_path / "out", vary=more["vary"])


# -- what is refused ------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        ({"vary": {}}, "nothing varies"),
        ({"sampler": "tp"}, "did you mean 'tpe'"),
        ({"sampler": "cmaes", "vary": {"Bowl.x": [1, 2]}}, "Bowl.x"),
        ({"vary": ["Bowl.x=-1e308:1e308"]}, "Bowl.x"),
        ({"settings": {"Bowl.x": 1}}, "Bowl.x"),
        ({"runs": 0}, "runs = 0"),
        ({"per_round": 2.5}, "per_round = 2.5"),
        ({"first_seed": True}, "first_seed = True"),
        ({"trials": MAX_TRIALS + 1}, "trials = 10001"),
        ({"vary": {"Bowl.x": [1, "1", "a"]}}, "Bowl.x"),
        ({"objective": "Bowl.hight"}, "did you mean 'Bowl.height'"),
        ({"objective": "Bowl.height["}, "cannot be read"),
        ({"subject_to": ["Bowl.hight < 1"]}, "did you mean 'Bowl.height'"),
        ({"subject_to": ["Bowl.height"]}, "subject_to 'Bowl.height': there is no sign"),
        ({"subject_to": ["Bowl.height < 1"], "sampler": "cmaes"}, "cmaes knows no constraints"),
        ({"vary": {"Bowl.z": (0.0, 1.0)}}, "Bowl.z"),
    ],
)
def test_what_means_nothing_is_refused(arguments, named):
    with pytest.raises(ParameterError, match=named):
        search(**arguments)


@pytest.mark.parametrize(("sampler", "package"), [("tpe", "optuna"), ("cmaes", "cmaes")])
def test_without_a_package_the_extra_is_named(monkeypatch, sampler, package):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(MissingExtraError, match=rf"{package}.*tussle\[batch\]"):
        search(sampler=sampler)


# -- the directory --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("sampler", ["tpe", "cmaes", "random"])
def test_a_search_goes_on_as_if_it_had_never_stopped(tmp_path, sampler):
    whole = search(sampler=sampler, trials=40)
    for trials in (8, 13, 24, 40):  # thirteen: the middle of a round
        study = search(sampler=sampler, trials=trials, directory=tmp_path / "out")
        assert len(study.trials) == trials
    assert facts(study) == facts(whole)
    assert study.notes == []
    assert facts(load_study(tmp_path / "out")) == facts(whole)
    assert facts(search(sampler=sampler, trials=24, directory=tmp_path / "out")) == facts(whole)


def test_seeds_change_what_is_proposed():
    first = search(trials=8)
    assert facts(search(trials=8)) == facts(first)
    assert facts(search(trials=8, sample_seed=1)) != facts(first)
    rounds = search(trials=16, sampler="random").trials
    assert rounds[0].values != rounds[8].values


CHILD = """\
import sys, time
from tussle.batch import InProcess
from tussle.batch.search.optimization import optimize

def stop_in_the_middle(progress):
    if progress.n_done >= 16 and progress.played > 0.3:
        print("in the middle", flush=True)
        time.sleep(60)

optimize(
    "bowl.xml", "Bowl.height", vary=["x=-10:10", "y=-10:10"], plugin_files=[sys.argv[1]], settings={"luck": 1}, runs=3, trials=40,
    sampler=sys.argv[2], directory="out", executor=InProcess(1), on_progress=stop_in_the_middle,
)
"""


@pytest.mark.parametrize("sampler", ["tpe", "cmaes"])
@pytest.mark.slow
def test_a_search_that_was_killed_goes_on_as_if_it_had_not(game, sampler, monkeypatch):
    monkeypatch.chdir(game.parent)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(p for p in sys.path if p)}
    child = subprocess.Popen(
        [sys.executable, "-W", "error", "-c", CHILD, str(PLUGIN), sampler], stdout=subprocess.PIPE, text=True, env=environment
    )  # fmt: skip
    try:
        assert child.stdout.readline() == "in the middle\n"
    finally:
        child.send_signal(signal.SIGKILL)
        child.communicate()
    assert child.returncode == -signal.SIGKILL
    assert len(load_study("out").trials) == 16
    arguments = {
        "source": "bowl.xml",
        "vary": ["x=-10:10", "y=-10:10"],
        "plugin_files": [str(PLUGIN)],
        "settings": {"luck": 1},
        "runs": 3,
        "trials": 40,
        "sampler": sampler,
    }
    resumed = search(**arguments, directory="out")
    assert facts(resumed) == facts(search(**arguments))


@pytest.mark.parametrize("lost", [1, 30, 2000])
def test_a_search_whose_last_round_was_not_kept_whole_goes_on_as_if_it_was(tmp_path, lost):
    """A process that is killed while it writes leaves some trials of a round, the last of them cut."""
    whole = search(trials=32, directory=tmp_path / "out")
    journal = tmp_path / "out" / "trials.journal"
    os.truncate(journal, journal.stat().st_size - lost)
    assert facts(search(trials=32, directory=tmp_path / "out")) == facts(whole)
    assert facts(load_study(tmp_path / "out")) == facts(whole)


def test_what_the_directory_holds(tmp_path, game):
    vary = ["x=-10:10", "n=1:3:int", "luck=0,1"]
    search(source=game, vary=vary, plugin_files=[PLUGIN], directory=tmp_path / "out", trials=20)
    files = sorted(p.name for p in (tmp_path / "out").iterdir())
    assert files == ["lock", "study.json", "trials.journal", "trials.parquet"]
    info = json.loads((tmp_path / "out" / "study.json").read_text())
    assert (info["objective"], info["direction"]) == ("Bowl.height", "maximize")
    assert info["mission"]["file"] == "bowl.xml"
    table = pq.read_table(tmp_path / "out" / "trials.parquet")
    facts = ("objective", "low", "high", "n_failed", "state", "error", "by_seed", "violations")
    assert table.column_names == ["trial", "round", "x", "n", "luck", *facts]
    assert table["trial"].to_pylist() == list(range(20))
    assert table["round"].to_pylist() == [0] * 8 + [1] * 8 + [2] * 4
    assert [str(table.schema.field(n).type) for n in ("x", "n", "luck")] == ["double", "int64", "int64"]
    storage = optuna.storages.JournalStorage(
        optuna.storages.journal.JournalFileBackend(str(tmp_path / "out" / "trials.journal"))
    )
    (seen,) = optuna.get_all_study_summaries(storage)
    assert (seen.n_trials, seen.best_trial.value) == (20, max(table["objective"].to_pylist()))


def test_choices_of_all_kinds_come_back(tmp_path):
    def made(objective, kind):
        return bowl.mission(x=2.0 if kind is True else 3.0 if kind == "far" else float(kind))

    vary = {"objective": [0.5, 2], "kind": ["far", True, 1]}
    study = search(source=made, vary=vary, directory=tmp_path / "out", trials=24)
    again = load_study(tmp_path / "out")
    assert facts(again) == facts(study)
    assert {type(t.values["kind"]) for t in again.trials} == {str, bool, int}
    assert again.table.column_names[2:5] == ["varied objective", "kind", "objective"]


def test_another_search_in_the_directory(tmp_path, game):
    def go(**more):
        arguments = {
            "vary": ["x=-10:10"],
            "plugin_files": [PLUGIN],
            "trials": 8,
            "directory": tmp_path / "out",
        }
        return search(source=game, **(arguments | more))

    go()
    for more, what in (
        ({"objective": "t"}, "objective"),
        ({"minimize": True}, "direction"),
        ({"vary": ["x=-10:11"]}, "variables"),
        ({"runs": 3}, "runs"),
        ({"settings": {"y": 3}}, "mission"),
    ):
        with pytest.raises(BatchError, match=f"out: holds another search .*{what}"):
            go(**more)
    assert len(go(trials=16).trials) == 16
    game.write_text(bowl.MISSION.replace('dt="0.1"', 'dt="0.15"'))
    with pytest.raises(BatchError, match="the mission or a plugin file has changed since"):
        go()


def test_a_mission_that_changes_meanwhile(tmp_path, game):
    def change(progress):
        if progress.n_done == 16:
            game.write_text(bowl.MISSION.replace('dt="0.1"', 'dt="0.15"'))

    with pytest.raises(BatchError, match="has changed during the search; finished rounds are kept"):
        search(
            source=game, vary=["x=0:1"], plugin_files=[PLUGIN], directory=tmp_path / "out", on_progress=change
        )
    assert len(load_study(tmp_path / "out").trials) == 16


def test_two_processes_at_one_search(tmp_path):
    optimization = Optimization(bowl.mission(), "t", vary=PLACE)
    with (
        StudyStore(tmp_path / "out", optimization.info),
        pytest.raises(BatchError, match="another process is at this search"),
    ):
        optimization.play(tmp_path / "out", 8)
    assert len(optimization.play(tmp_path / "out", 8, executor=HERE).trials) == 8


def test_directories_that_hold_something_else(tmp_path):
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(BatchError, match=r"holds something that is no search \(notes\.txt\)"):
        search(directory=tmp_path, trials=8)
    with pytest.raises(BatchError, match="there is no such directory"):
        load_study(tmp_path / "none")
    with pytest.raises(BatchError, match=r"it has no study\.json"):
        load_study(tmp_path)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("study.json", b"{"),
        ("study.json", b'{"format": 1}'),
        ("study.json", b'{"format": 2}'),
        ("trials.journal", b"[]\n"),
        ("trials.journal", b'{"op_code": 4}\n{'),
    ],
)
def test_files_that_were_damaged(tmp_path, name, content):
    search(directory=tmp_path / "out", trials=8)
    (tmp_path / "out" / name).write_bytes(content)
    with pytest.raises(BatchError, match=name):
        load_study(tmp_path / "out")


@pytest.mark.parametrize(
    ("old", "new", "field"),
    [
        (r'"high":[-\d.e]+', '"high":null', "low"),
        (r'"high":[-\d.e]+', '"high":-1e9', "low"),
        (r'"value":[-\d.e]+', '"value":1e101', "value"),
        (r'"state":1', '"state":3', "state"),
        (r'"by_seed":\[[^\]]*\]', '"by_seed":[1.0]', "1 games"),
        (r'"Bowl.x":[-\d.e]+', '"Bowl.x":77.0', "Bowl.x"),
        (r'"n_failed":0', '"n_failed":"0"', "n_failed"),
    ],
)
def test_a_trial_that_cannot_be_is_named(tmp_path, old, new, field):
    search(directory=tmp_path / "out", trials=8)
    path = tmp_path / "out" / "trials.journal"
    lines = path.read_text().splitlines(keepends=True)
    place = next(i for i, line in enumerate(lines) if '"n_failed"' in line)
    lines[place], n = re.subn(old, new, lines[place], count=1)
    assert n == 1
    path.write_text("".join(lines))
    with pytest.raises(BatchError, match=rf"trials\.journal: .*{field}"):
        load_study(tmp_path / "out")


def test_a_search_whose_variables_were_changed_is_another_one(tmp_path):
    search(directory=tmp_path / "out", trials=8)
    file = tmp_path / "out" / "study.json"
    info = json.loads(file.read_text())
    info["variables"].pop()
    del info["checksum"]
    file.write_text(json.dumps(info))
    with pytest.raises(BatchError, match=r"holds another search \(it differs in variables\)"):
        search(directory=tmp_path / "out", trials=8)


def test_other_versions_are_told(tmp_path):
    study = search(directory=tmp_path / "out", trials=8)
    versions = {**study.info["versions"], "optuna": "4.2.0"}
    path = tmp_path / "out" / "study.json"
    path.write_text(json.dumps({**study.info, "versions": versions}))
    (note,) = search(directory=tmp_path / "out", trials=16).notes
    now = study.info["versions"]["optuna"]
    assert note.startswith(f"the search was begun with optuna 4.2.0, now {now}: trials from 8 on may differ")
    assert notes_on_versions({"versions": versions}, study.info, 0) == []
