"""Numbers as small, as large and as odd as a text can hold them: whatever is refused, tussle itself never fails."""

from __future__ import annotations

import pytest
from cli_process import call

from tussle.cli.terminal import OWN_FAULT

EXTREMES = ("5e-324", "1e-300", "1e300", "-1e300", "9223372036854775808", "nan", "inf", "²")

MISSION = """\
<runscript name="Extremes">
  <run start="${start=0}" end="${end=0.3}" dt="${dt=0.1}" time_warp="${warp=1}" motion_multiplier="${substeps=1}"/>
  <seed>${seed=7}</seed> <gui_update_period>${period=10}</gui_update_period> <grid_size>${grid=10}</grid_size>
  <network range="${range=100}">SphereNetwork</network>
  <entity>
    <name>prey</name> <team_id>${team=1}</team_id> <count>${n=3}</count> <x>${x=0}</x> <variance_x>${variance=400}</variance_x>
    <health>${health=1}</health> <radius>${radius=1}</radius> <mass>${mass=1}</mass> <heading>${heading=0}</heading>
    <generate_rate>${births=1} / 1</generate_rate> <generate_count>1</generate_count>
    <generate_start_time>${first=0}</generate_start_time> <generate_time_variance>${spread=0}</generate_time_variance>
    <autonomy loop_rate="${rate=10}" max_speed="${speed=10}">Boids</autonomy>
    <controller loop_rate="${controls=10}">UnicyclePID</controller>
    <sensor loop_rate="${senses=10}" pos_noise_0="0 ${noise=1}" max_range="${sight=10}">NoisyContacts</sensor>
    <motion_model use_pitch="true" vel_max="${limit=10}">Unicycle</motion_model>
  </entity>
</runscript>
"""
PLACES = [
    "start", "end", "dt", "warp", "substeps", "seed", "period", "grid", "range", "team", "n", "x", "variance", "health",
    "radius", "mass", "heading", "births", "first", "spread", "rate", "speed", "controls", "senses", "noise", "sight", "limit",
]  # fmt: skip
SMALL = ("--size", "64x48")
ONCE = ("--runs", "1", "--processes", "1")
OPTIONS = {
    "--end": ("run", "game.xml", "--no-log", "--end"),
    "--log-period": ("run", "game.xml", "--log-period"),
    "--seed": ("run", "game.xml", "--no-log", "--seed"),
    "batch --seed": ("batch", "game.xml", *ONCE, "--seed"),
    "--until": ("batch", "game.xml", *ONCE, "--until"),
    "--stack": ("batch", "game.xml", *ONCE, "--stack"),
    "--record-runs": ("batch", "game.xml", *ONCE, "--record-runs"),
    "--run-timeout": ("batch", "game.xml", *ONCE, "--scheduler", "none", "--run-timeout"),
    "export --period": ("export", "played", "--html", "--period"),
    "--at": ("export", "played", *SMALL, "--png", "--at"),
    "--speed": ("export", "played", *SMALL, "--gif", "--speed"),
    "--fps": ("export", "played", *SMALL, "--gif", "--speed", "1", "--fps"),
    "--from": ("export", "played", *SMALL, "--gif", "--from"),
    "--to": ("export", "played", *SMALL, "--gif", "--to"),
    "--zoom": ("export", "played", *SMALL, "--png", "--zoom"),
    "--scale": ("export", "played", *SMALL, "--png", "--scale"),
    "mcap --scale": ("export", "played", "--mcap", "--scale"),
    "--trails": ("export", "played", *SMALL, "--png", "--trails"),
    "--follow": ("export", "played", *SMALL, "--png", "--follow"),
    "plot --to": ("plot", "played", "--to"),
    "--per-round": ("optimize", "game.xml", "--objective", "t", "--vary", "x=0:1", *ONCE, "--trials", "1", "--per-round"),
}  # fmt: skip


@pytest.fixture
def ends(tmp_path, monkeypatch):
    """Calls the command in this process; what it says where it fails itself."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "game.xml").write_text(MISSION)

    def run(*arguments):
        done = call(*arguments)
        return f"{' '.join(arguments)}: {done.stderr}" if done.returncode == OWN_FAULT else ""

    return run


@pytest.mark.parametrize("place", PLACES)
def test_a_mission_may_ask_for_any_number(ends, place):
    assert not [
        said for value in EXTREMES if (said := ends("run", "game.xml", "--no-log", f"{place}={value}"))
    ]


@pytest.mark.slow
@pytest.mark.parametrize(
    "option",
    [
        pytest.param(
            option, marks=[pytest.mark.needs("renderer")] if {"--png", "--gif"} & {*arguments} else []
        )
        for option, arguments in OPTIONS.items()
    ],
)
def test_an_option_may_be_any_number(ends, option):
    arguments = OPTIONS[option]
    if "played" in arguments:
        ends("run", "game.xml", "--out", "played")
    assert not [said for value in EXTREMES if (said := ends(*arguments, value))]
