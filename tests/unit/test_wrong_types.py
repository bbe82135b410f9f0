"""Arguments of another type than their annotations never end in an error of Python, in any public function of these packages."""

import inspect
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from tussle import Block, Mission, Recorder, Simulation
from tussle.arguments import check_kind, kinds_of
from tussle.batch import Batch, Choice, InProcess, Range
from tussle.errors import TussleError
from tussle.messages import Waypoint
from tussle.stock import Still
from tussle.stress import Assurance, Distribution, Monitor, Specification, Stress, StressGame, Verdict
from tussle.view import GroundMap, Live, Mesh, OperatorLink, Recording, Style, frame_of

PACKAGES = "tussle.batch", "tussle.stress", "tussle.view"
WRONG = [None, 3, -1.5, True, "x", b"x", [1, "a"], {"a": object()}, object()]
MISSION = Mission(blocks=[Block(name="a", team=1, count=3, motion=Still())], end=1.0, name="still")
TEXT = "always (count(team 1) > 1)"
STUDY = {"mission": MISSION, "specification": TEXT}
TRIANGLE = {"vertices": [[0, 0, 0], [1, 0, 0], [0, 1, 0]], "faces": [[0, 1, 2]]}
GIVEN = {
    "Specification.parse": {"text": TEXT, "mission": MISSION},
    "Specification.of_function": {"function": len, "mission": MISSION},
    "Stress": STUDY,
    "given_games": STUDY,
    "Stress.sample": {"games": 2},
    "Stress.search": {"games": 2},
    "Batch": {"mission": MISSION},
    "optimize": {"mission": MISSION, "objective": "x", "vary": {"a.speed": "1:2"}, "trials": 1},
    "Results.compare": {"expression": "steps", "a": 0, "b": 0},
    "Distribution": {"name": "x", "law": "normal", "first": 0.0, "second": 1.0},
    "Range": {"name": "x", "low": 0, "high": 1},
    "Mesh": TRIANGLE,
    "Style": {"blocks": ["a"], "teams": [1]},
    "Live.publish": {"type_": Waypoint},
    "Live.order": {"receivers": [1], "network": "GlobalNetwork", "topic": "Waypoint", "values": {}},
    "Live.set_parameter": {"entities": [1], "path": "a.speed", "value": 1},
    "Recording.values": {"i": 0, "name": "a"},
}
"""Other arguments of a function, where its defaults are not enough to reach what it does."""
AT_ONCE = {
    "Batch": ("independent", "ends_by_time"),
    "Live": ("threaded", "is_paused", "is_followed", "ground_map"),
    "Stress": ("specification", "ends_by_time"),
    "given_games": ("specification",),
    "on_slurm": ("jobs",),
}
"""What is refused before anything is done, since it would be noticed late or never."""
PLAYS = {
    "Batch.play", "InProcess.play", "Live.settle", "OnDask.play", "Processes.play", "Stress.importance", "Stress.probability",
}  # fmt: skip
"""They play for long where they are given what is right but for one argument, or when what they return is used."""
RETURNED = {
    "Chance", "Counterfactual", "Event", "FailureSearch", "GivenGame", "ImportanceEstimate", "Played", "Probability", "RecordedMonitor",
    "Repetition", "Sample", "Scenery", "SmallestGame", "Study", "Tried", "Why",
}  # fmt: skip
"""What studies and batches return, which nobody makes by hand."""


def public():
    """Label and name in its package of each public function and class, with its public methods."""
    for package in PACKAGES:
        module = import_module(package)
        for name in module.__all__:
            if callable(of := getattr(module, name)):
                yield name, package, ""
                for method, each in vars(of).items() if inspect.isclass(of) else ():
                    if not method.startswith("_") and (
                        inspect.isfunction(each) or isinstance(each, staticmethod | classmethod)
                    ):
                        yield f"{name}.{method}", package, method


CALLED = {
    label: (package, method)
    for label, package, method in public()
    if label not in PLAYS and label.partition(".")[0] not in RETURNED
}


@pytest.fixture(scope="module")
def objects(tmp_path_factory):
    """An object of each class whose methods are called."""
    folder = tmp_path_factory.mktemp("wrong")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        with Simulation(MISSION, 1) as game, Recorder(game, "run"):
            game.run()
        batch, study = Batch(MISSION, runs=4), Stress(**STUDY)
        with Simulation(MISSION, 1) as game, Live(Simulation(MISSION, 1), threaded=False) as live:
            specification = Specification.parse(TEXT, MISSION)
            made = [
                batch, batch.play("batch", InProcess()), study, study.sample(2).games[0], specification, Monitor(specification, game),
                live, Recording("run"), StressGame(1), Verdict(1.0, [1], [1.0]), Assurance(0.5, 10, 1), Choice("x", (1, 2)),
                Range("x", 0, 1), Distribution("x", "normal", 0.0, 1.0), OperatorLink(), Mesh(*map(np.array, TRIANGLE.values())),
                Style(["a"], [1]), frame_of(game), GroundMap(Path("map.png"), (0.0, 0.0, 1.0, 1.0)),
            ]  # fmt: skip
            yield {type(each).__name__: each for each in made} | {"Simulation": game}


@pytest.mark.parametrize("label", CALLED)
def test_a_wrong_type_is_an_error_of_tussle(label, objects, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    package, method = CALLED[label]
    name = label.partition(".")[0]
    of = getattr(import_module(package), name)
    if not method:
        call, kinds = of, kinds_of(of.__init__ if inspect.isclass(of) else inspect.unwrap(of))
    else:
        is_static = isinstance(inspect.getattr_static(of, method), staticmethod | classmethod)
        call = getattr(of if is_static else objects[name], method)
        kinds = kinds_of(inspect.unwrap(getattr(call, "__func__", call)))
    games = {"sim": objects["Simulation"], "simulation": objects["Simulation"], "failed": objects["Played"]}
    given = {each: value for each, value in games.items() if each in kinds} | GIVEN.get(label, {})
    for argument in kinds.keys() - {"return"}:
        for value in WRONG:
            try:
                check_kind(argument, value, kinds[argument])
            except TussleError:
                with (
                    pytest.raises(TussleError)
                    if argument in AT_ONCE.get(label, ())
                    else suppress(TussleError)
                ):
                    call(**given | {argument: value})
