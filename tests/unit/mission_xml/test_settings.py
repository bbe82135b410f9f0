"""Settings from outside: placeholders and paths."""

from __future__ import annotations

import pytest

from tussle import Simulation
from tussle.errors import MissionError
from tussle.mission import read_mission
from tussle.stock import (
    Boids,
    DirectController,
    SimpleCapture,
    SingleIntegrator,
    SingleIntegratorControllerSimple,
    Unicycle,
)

TEXT = """<runscript name="${title=a title}"><!-- ${hidden=1} -->
<run end="${end=5}"/>
<entity_interaction>SimpleCapture</entity_interaction>
<entity><name>a</name><count>${n=2}</count><autonomy max_speed="${v=
  7}">Boids</autonomy><motion_model>Unicycle</motion_model><controller>DirectController</controller></entity>
<entity><name>b</name><x>${x=${n=2}}</x></entity>
</runscript>"""
PLAIN = TEXT.replace("${x=${n=2}}", "1")


def test_placeholders_take_their_defaults(files):
    loaded = files.read(PLAIN)
    assert loaded.placeholders == {"title": "a title", "end": "5", "n": "2", "v": "\n  7"}
    assert (loaded.name, loaded.mission.end, loaded.mission.blocks[0].count) == ("a title", 5.0, 2)
    assert "${" not in loaded.text


def test_placeholders_are_set(files):
    loaded = files.read(PLAIN, {"end": "9", "n": "3", "title": "<b> & 'c' \"d\""})
    assert (loaded.mission.end, loaded.mission.blocks[0].count, loaded.name) == (9.0, 3, "<b> & 'c' \"d\"")


def test_folder_is_that_of_the_file(files, tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts/title.xml").write_text('<p><entity tag="${folder}"><name>a</name></entity></p>')
    include = '<xi:include xmlns:xi="http://www.w3.org/2001/XInclude" href="parts/title.xml" xpointer="xpointer(/p/*)"/>'
    loaded = files.read(f'<runscript name="${{folder}}">{include}</runscript>')
    assert loaded.name == str(tmp_path.resolve())
    assert f'tag="{tmp_path.resolve() / "parts"}"' in loaded.text
    assert files.read('<runscript name="${folder}"><entity/></runscript>', {"folder": "x"}).name == "x"


def test_an_unknown_setting_is_refused_with_the_nearest_name(files):
    with pytest.raises(MissionError, match=r"the mission has no setting 'edn' \(did you mean 'end'\?\)"):
        files.read(PLAIN, {"edn": "9"})
    with pytest.raises(MissionError, match="has no setting 'hidden'"):
        files.read(PLAIN, {"hidden": "9"})


def test_a_placeholder_without_default_must_be_set(files):
    text = PLAIN.replace("${n=2}", "${n}")
    with pytest.raises(MissionError, match=r"m\.xml:4: \$\{n\} has no default and is not set"):
        files.read(text)
    assert files.read(text, {"n": "6"}).mission.blocks[0].count == 6


def test_lines_are_those_of_the_file_whatever_is_replaced(files):
    wrong = PLAIN.replace("<name>b", "<nam>b").replace("</name><x>", "</nam><x>")
    for overrides in ({}, {"v": "7"}, {"v": "\n\n\n7"}):
        assert "m.xml:6: tag in <entity> 'nam' is unknown" in "\n".join(
            files.read(wrong, overrides, strict=False).notes
        )


def test_settings_by_path(files):
    loaded = files.read(PLAIN, {
        "run.dt": "50 ms", "run.update": "sequential", "a.count": "4", "a.Boids.max_speed": "40 kt", "a.Unicycle.vel_max": "9",
        "SimpleCapture.capture_range": "7", "b.x": "3", "b.motion_model": "SingleIntegrator max_speed='2'", "b.team_id": "8",
    })  # fmt: skip
    a, b = loaded.mission.blocks
    assert (loaded.mission.dt, loaded.mission.update, a.count) == (0.05, "sequential", 4)
    assert (a.autonomy, a.motion) == ((Boids(max_speed="40 kt"),), Unicycle(vel_max=9))
    assert (b.position[0], b.motion, b.team) == (3.0, SingleIntegrator(max_speed=2), 8)
    assert loaded.mission.interactions == (SimpleCapture(capture_range=7),)
    assert files.read(loaded.text).mission == loaded.mission


def test_plugins_are_replaced_and_removed(files):
    a = files.read(
        PLAIN,
        {
            "a.controller": "SingleIntegratorControllerSimple",
            "a.motion_model": "SingleIntegrator",
            "a.autonomy": "",
        },
    )
    block = a.mission.blocks[0]
    assert (block.controller, block.motion, block.autonomy) == (
        (SingleIntegratorControllerSimple(),),
        SingleIntegrator(),
        (),
    )


@pytest.mark.parametrize(
    ("path", "said"),
    [
        ("run.tick", "run has no 'tick'"),
        ("c.count", r"the mission has no 'c'; there are: run, a, b, SimpleCapture"),
        ("a.cuont", r"a has no 'cuont' \(did you mean 'count'\?\)"),
        ("a.Boid.max_speed", r"a has no 'Boid' \(did you mean 'Boids'\?\)"),
        ("a.base", "a has no 'base'"),
        ("a.Boids.x.y", "Boids has no 'x'; there are none"),
        ("a.motion_model", r"'\[ \[ x \]' is not a plugin"),
        (".", "the mission has no ''"),
    ],
)
def test_paths_that_lead_nowhere(files, path, said):
    with pytest.raises(MissionError, match=rf"setting {path}.*: ({said})"):
        files.read(PLAIN, {path: "[ x"})


def test_a_mission_with_models_that_are_missing_runs_with_others(existing):
    path = existing("predator_prey_boids.xml")
    settings = {
        "team_1.motion_model": "SingleIntegrator",
        "team_1.controller": "SingleIntegratorControllerSimple",
        "run.end": "1",
    }
    loaded = read_mission(path, settings)
    assert loaded.mission.blocks[0].motion == SingleIntegrator()
    assert loaded.mission.blocks[1].controller == (DirectController(),)
    (result,) = Simulation(loaded.mission, seeds=1).run()
    assert (result.end, result.t) == ("time", pytest.approx(1.0))


def test_replaced_text_gives_the_same_mission(files):
    loaded = files.read(PLAIN, {"n": "5"})
    assert files.read(loaded.text).mission == loaded.mission
