"""`tussle new`: what it writes works at once, with its test and on the command line, for every kind."""

from __future__ import annotations

import ast
import re
import subprocess
import sys

import needs
import pytest
from cli_process import environment

from tussle import Simulation
from tussle.cli.scaffold import EASY_KINDS, KINDS, write_plugin
from tussle.errors import PluginError
from tussle.mission import load_plugin_file, read_mission
from tussle.plugins import stock

PLUGINS = [
    *(("Plain", kind, ()) for kind in KINDS),
    *(("Simple", kind, ("--easy",)) for kind in EASY_KINDS),
    # Of the copies of plugins that ship two are held to the kit: their originals are all held to it elsewhere.
    ("Copied", "sensor", ("--from", "NoisyState")),
    ("Copied", "interaction", ("--from", "SimpleCapture")),
]


@pytest.mark.slow
def test_each_begins_with_a_plugin_that_plays_and_a_test_that_passes(tussle, folder):
    for prefix, kind, options in PLUGINS:
        file = f"mine/{prefix.lower()}_{kind}"
        done = tussle("new", kind, f"{prefix}{kind.capitalize()}", *options, "--out", "mine")
        if prefix == "Simple":
            assert "_one(self" in (folder / f"{file}.py").read_text()
        assert f" {file}.py " in done.stdout
        assert f"\n tussle run {file}.xml --plugin-path {file}.py\n" in done.stdout
        played = tussle("run", f"{file}.xml", "--plugin-path", f"{file}.py", "--no-log", "--end", "3")
        assert not re.search("note|warning", played.stderr)
    tests = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-W", "error", "-p", "no:xdist", "-p", "no:cacheprovider", "mine"],
        check=False, capture_output=True, text=True, cwd=folder, env=environment(), timeout=600,
    )  # fmt: skip
    assert tests.returncode == 0, tests.stdout
    assert f"{2 * len(PLUGINS)} passed" in tests.stdout


@pytest.mark.parametrize(("prefix", "kind", "options"), [each for each in PLUGINS if each[0] != "Copied"])
def test_type_checkers_know_all_that_is_written(tmp_path, prefix, kind, options):
    written, _ = write_plugin(kind, f"{prefix}{kind.capitalize()}", None, tmp_path, "--easy" in options)
    for path in written:
        for made in ast.walk(ast.parse(path.read_text())) if path.suffix == ".py" else ():
            if isinstance(made, ast.FunctionDef):
                named = [a for a in (*made.args.args, *made.args.kwonlyargs) if a.arg not in ("self", "cls")]
                assert made.returns, f"{path.name}: {made.name}"
                assert all(a.annotation for a in named), f"{path.name}: {made.name}"


@pytest.mark.with_and_without  # ROS
def test_every_plugin_that_ships_can_be_begun_with(tmp_path):
    missing = "no ROS master answers" if needs.NEEDS["rospy"].is_there() else "ROS 1 needs rospy"
    for cls in dict.fromkeys(map(stock.load, stock.manifest())):
        name = cls.__name__
        if cls.kind not in KINDS:
            continue
        written = list(write_plugin(cls.kind, f"My{name}", name, tmp_path)[0])
        copy = load_plugin_file(written[0])[f"My{name}"]
        assert list(copy.params()) == list(cls.params())
        assert copy.__doc__ == re.sub(rf"\b{name}\b", f"My{name}", cls.__doc__)
        loaded = read_mission(written[2], plugin_files=[written[0]])
        assert all("it hides the one that ships" in note for note in loaded.notes)
        try:
            Simulation(loaded.mission).close()
        except PluginError as error:
            assert "ROS" in name
            text = "ROS 2 needs Cyclone DDS" if "ROS2" in name else missing
            assert text in str(error)  # noqa: PT017
            assert "ROS2" not in name or not needs.NEEDS["cyclonedds"].is_there()


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        (["thing", "Mine"], "kind of plugin 'thing'"),
        (["autonomi", "Mine"], "did you mean 'autonomy'?"),
        (["autonomy", "mine"], "'mine' is not a plugin name"),
        (["autonomy", "../Mine"], "'../Mine' is not a plugin name"),
        (["autonomy", "Boids"], "a stock plugin is named 'Boids'"),
        (["autonomy", "Mine", "--from", "Boid"], "did you mean 'Boids'?"),
        (["motion", "Mine", "--easy"], "--easy is not allowed with the kind motion"),
        (["metric", "Mine", "--easy", "--from", "CPA"], "--easy is not allowed with --from CPA"),
        (["autonomy", "Mine", "--from", "Unicycle"], "is motion, not autonomy"),
    ],
)
def test_what_cannot_be_begun_is_told(tussle, folder, arguments, text):
    done = tussle("new", *arguments, code=1)
    (line,) = done.stderr.splitlines()
    assert line.startswith("error: ")
    assert text in line
    assert [p.name for p in folder.iterdir()] == ["game.xml"]


def test_files_of_the_same_name_are_left_alone(tussle, folder):
    (folder / "test_mine.py").write_text("precious")
    done = tussle("new", "metric", "Mine", code=1)
    assert "test_mine.py: the file exists" in done.stderr
    assert (folder / "test_mine.py").read_text() == "precious"
    assert not (folder / "mine.py").exists()
