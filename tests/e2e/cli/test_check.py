"""`tussle check` of a mission that waits for something, of a folder, and of files in folders of data."""

from __future__ import annotations

GAME = """<runscript name="{0}"><run end="1"/><entity><autonomy>{0}</autonomy>
<controller>SimpleAircraftControllerPID</controller><motion_model>SimpleAircraft</motion_model></entity></runscript>"""
STICK = """<runscript name="stick"><run end="1"/><entity><controller device="/dev/input/js9" axis_map="[ velocity_x 1 -1 1 -1 1 1 ]
[ velocity_y 0 -1 1 -1 1 1 ]
[ velocity_z 0 -1 1 -1 1 1 ]">JoystickController</controller><motion_model>SingleIntegrator</motion_model></entity></runscript>"""
PART = '<runscript name="p" xmlns:xi="http://www.w3.org/2001/XInclude"><xi:include href="../part.xml"/></runscript>'


def test_a_folder_is_shown_as_a_table(tussle, tmp_path):
    folder = tmp_path / "missions"
    (folder / "deep").mkdir(parents=True)
    (folder / "good.xml").write_text(GAME.format("Straight"))
    (folder / "bad.xml").write_text(GAME.format("Strait"))
    (folder / "stick.xml").write_text(STICK)
    (folder / "part.xml").write_text("<entity><motion_model>Still</motion_model></entity>")
    (folder / "deep" / "whole.xml").write_text(PART)
    (folder / "notes.xml").write_text("<notes/>")
    shown = tussle("check", folder, code=1).stdout
    lines = [line.split() for line in shown.splitlines()]
    assert [line[:2] for line in lines if line and line[0].endswith(".xml")] == [
        ["bad.xml", "refused"], ["deep/whole.xml", "plays"], ["good.xml", "plays"], ["stick.xml", "waits"],
    ]  # fmt: skip
    assert "did you mean 'Straight'?" in " ".join(shown.split())
    assert "a joystick at /dev/input/js9" in shown
    assert "2 can be played, 1 wait for a program or a device, 1 are refused of 4" in shown
    (folder / "bad.xml").unlink()
    tussle("check", folder)
    assert "it waits for a joystick at /dev/input/js9" in tussle("check", folder / "stick.xml").stdout


def test_a_folder_without_missions_is_an_error(tussle, tmp_path):
    (tmp_path / "none").mkdir()
    (tmp_path / "none" / "notes.xml").write_text("<notes/>")
    assert "has no mission file" in tussle("check", tmp_path / "none", code=1).stderr


def test_all_commands_take_folders_of_data(tussle, tmp_path):
    data = tmp_path / "data" / "maps"
    data.mkdir(parents=True)
    (data / "wall.xml").write_text("<params><filename>wall.pgm</filename></params>")
    (data / "wall.pgm").write_text("P2 2 1 255 0 255")
    mission = tmp_path / "m" / "map.xml"
    mission.parent.mkdir()
    text = GAME.format("Straight").replace(
        "<entity>", '<entity_interaction map="wall">MapGen2D</entity_interaction><entity>'
    )
    mission.write_text(text)
    path = ("--data-path", tmp_path / "data")
    assert "--data-path DIR" in tussle("check", mission, code=1).stderr
    tussle("check", mission, *path)
    tussle("run", mission, *path, "--no-log")
    tussle("describe", mission, *path)
    tussle("batch", mission, *path, "--runs", 1, "--processes", 1, "--out", tmp_path / "batch")
    tussle("run", "--from", f"{tmp_path / 'batch'}:0", *path, "--no-log")
    tussle("convert", mission, *path, "--to", tmp_path / "copy.xml")
    tussle("check", tmp_path / "copy.xml")
