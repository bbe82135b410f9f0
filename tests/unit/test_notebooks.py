"""Notebooks: bars of long calls, and the notebook of the examples, in IPython's shell."""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path

import pytest
from IPython.core.displaypub import CapturingDisplayPublisher
from IPython.core.interactiveshell import InteractiveShell

import tussle
from tussle import Block, Mission, Simulation, notebook_bar
from tussle.batch import Batch
from tussle.stock import Boids, Unicycle

NOTEBOOKS = sorted((Path(__file__).parents[2] / "examples").glob("*.ipynb"))


@pytest.fixture
def shell(tmp_path, monkeypatch):
    """IPython as a notebook's kernel has it; `shell.display_pub.outputs` has what it showed."""
    monkeypatch.setenv("IPYTHONDIR", str(tmp_path / "ipython"))
    monkeypatch.chdir(tmp_path)
    hooks = sys.displayhook, sys.excepthook
    shell = InteractiveShell.instance(display_pub_class=CapturingDisplayPublisher)
    shell.history_manager.enabled = False
    shell.kernel = object()
    yield shell
    shell.history_manager.end_session()
    InteractiveShell.clear_instance()
    sys.displayhook, sys.excepthook = hooks


@pytest.fixture
def at_once(monkeypatch):
    """Bars appear and change without delay."""
    monkeypatch.setattr(notebook_bar, "MIN_DURATION", 0.0)
    monkeypatch.setattr(notebook_bar, "UPDATE_PERIOD", 0.0)


def mission(name="a & b"):
    return Mission(
        blocks=[Block(name="red", motion=Unicycle(), autonomy=Boids(), count=2)],
        name=name,
        end=1.0,
        dt=0.25,
    )


def texts(shell):
    return [output["data"]["text/plain"] for output in shell.display_pub.outputs]


def test_a_run_shows_one_bar_that_grows_and_goes(shell, at_once):
    with Simulation(mission(), 3) as simulation:
        simulation.run(until=0.5)
        assert texts(shell) == ["a & b: 0/0.5 s", "a & b: 0/0.5 s", ""]
        shell.display_pub.outputs.clear()
        simulation.run()
    shown = shell.display_pub.outputs
    assert texts(shell) == ["a & b: 1/1 s", "a & b: 1/1 s", ""]
    assert [output["update"] for output in shown] == [False, True, True]
    assert len({output["transient"]["display_id"] for output in shown}) == 1
    values = [re.findall(r'value="([\d.]+)"', output["data"]["text/html"]) for output in shown]
    assert values == [["0.7500"], ["1.0000"], []]
    assert "a &amp; b" in shown[0]["data"]["text/html"]


def test_a_bar_goes_when_the_call_fails(shell, at_once):
    def fail():
        with notebook_bar.notebook_bar("x") as show:
            show(5.0, float("inf"), "runs")
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert texts(shell) == ["x: 5 runs", ""]
    assert "value" not in shell.display_pub.outputs[0]["data"]["text/html"]


def test_a_batch_shows_its_runs_unless_told_whom_to_tell(shell, at_once):
    batch = Batch(mission(), runs=3)
    batch.play()
    assert texts(shell)[-2:] == ["a & b: 3/3 runs", ""]
    shell.display_pub.outputs.clear()
    told = []
    batch.play(on_progress=lambda progress: told.append(progress.n_done))
    assert told[-1] == 3
    assert not [text for text in texts(shell) if "runs" in text]


def test_short_calls_show_nothing(shell):
    with Simulation(mission(), 3) as simulation:
        simulation.run()
    assert not shell.display_pub.outputs


def test_outside_notebooks_nothing_is_shown(shell, at_once, capsys, monkeypatch):
    def run():
        with Simulation(mission(), 3) as simulation:
            simulation.run()

    shell.kernel = None  # a terminal
    run()
    shell.kernel = object()
    monkeypatch.setattr(notebook_bar, "parent_process", object)  # a worker that the notebook's kernel forked
    run()
    InteractiveShell.clear_instance()  # no IPython runs
    run()
    assert not shell.display_pub.outputs
    assert capsys.readouterr() == ("", "")


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_of_the_examples_runs_and_shows_what_it_names(path, shell, capsys):
    notebook = json.loads(path.read_text())
    cells = ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]
    assert notebook["nbformat"] == 4
    assert not any(cell.get("outputs") for cell in notebook["cells"]), "saved with outputs: clear them"
    n_shown = 0
    for cell in cells:
        done = shell.run_cell(cell)
        done.raise_error()
        if done.result is not None:
            data, _ = shell.display_formatter.format(done.result)
            assert "text/html" in data or "application/vnd.jupyter.widget-view+json" in data, cell
            n_shown += 1
    assert n_shown >= 4
    assert f"{tussle.__name__}.Simulation(" in "\n".join(cells)
