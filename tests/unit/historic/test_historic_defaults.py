"""Defaults and angles of SCRIMMAGE, in missions of files and of Python."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from scrimmage_parameters import state_of, table
from small_worlds import block, mission

from tussle import Simulation
from tussle.api import Autonomy, MotionModel
from tussle.errors import MissionError
from tussle.mission import read_mission, to_python, to_xml
from tussle.plugins import historic, stock
from tussle.plugins.historic.angles import angle_2pi, angle_pi

TEXT = """<runscript name="a"><run end="1" dt="0.1"/><entity><name>a</name><team_id>1</team_id>
<autonomy{}>MotorSchemas</autonomy><controller>SimpleCarControllerHeading</controller><motion_model>SimpleCar</motion_model>
</entity></runscript>"""


def schemas(**values):
    return (
        mission(block("a", autonomy=stock.MotorSchemas(**values)), compat="scrimmage").blocks[0].autonomy[0]
    )


def test_motor_schemas_without_behaviors_avoid_and_go_to_a_point(tmp_path):
    """However the mission is made; what is given, be it empty, is kept."""
    file = tmp_path / "m.xml"
    file.write_text(TEXT.format(""))
    made = read_mission(file, compat="scrimmage")
    names: dict[str, object] = {"__name__": "built"}
    exec(to_python(made.mission), names)
    (tmp_path / "w.xml").write_text(to_xml(made.mission))
    missions = [
        made.mission, read_mission(file).mission.replace(compat="scrimmage"), names["mission"],
        read_mission(tmp_path / "w.xml").mission, pickle.loads(pickle.dumps(made.mission)),
    ]  # fmt: skip
    for each in [schemas(), *(m.blocks[0].autonomy[0] for m in missions)]:
        avoid, go = each.values["behaviors"]
        assert (avoid.sphere_of_influence, avoid.minimum_range, avoid.gain) == (10.0, 2.0, 1.0)
        assert go.goal == (100.0, 0.0, 0.0)
        assert type(go) is historic.MoveToGoalMS
    assert not any("flies straight on" in str(problem) for problem in made.notes)
    assert any("flies straight on" in str(problem) for problem in read_mission(file).notes)
    assert schemas(behaviors=()).values["behaviors"] == ()
    file.write_text(TEXT.format(' behaviors=""'))
    assert read_mission(file, compat="scrimmage").mission.blocks[0].autonomy[0].values["behaviors"] == ()
    assert stock.MotorSchemas().values["behaviors"] == ()


@pytest.mark.parametrize("given", [{}, {"oor_return": math.inf, "use_flat_earth": True}])
def test_what_is_given_is_kept_even_if_it_is_the_own_default(given):
    """Also by a copy of the plugin with another parameter."""
    sensor = stock.LOSSensor(**given)
    for plugin in (sensor, sensor.replace(range_sd_min=0.0), pickle.loads(pickle.dumps(sensor))):
        found = mission(block("a", sensor=plugin), compat="scrimmage").blocks[0].sensor[0]
        expected = {"oor_return": 150.0, "use_flat_earth": False} | given
        assert {name: found.values[name] for name in expected} == expected


def test_an_executor_and_a_relay_have_the_contents_of_scrimmage():
    made = mission(
        block("a", autonomy=[stock.AutonomyExecutor(), stock.CommandStringRelay()]), compat="scrimmage"
    )
    executor, relay = made.blocks[0].autonomy
    assert [type(each) for each in executor.values["autonomies"]] == [historic.Straight]
    assert [(r.source, r.topic, r.target) for r in relay.values["relays"]] == [
        ("GlobalNetwork", "State", "LocalNetwork"),
        ("GlobalNetwork", "Distance", "LocalNetwork"),
    ]


def test_desired_headings_are_not_negative():
    for plugin in ("Straight", "MotorSchemas"):
        found = {}
        for law in (stock, historic):
            car = block(
                "a", heading="-30 deg", motion=stock.SimpleCar(), controller=stock.SimpleCarControllerHeading(),
                autonomy=getattr(law, plugin)(**({"behaviors": ()} if plugin == "MotorSchemas" else {})),
            )  # fmt: skip
            sim = Simulation(mission(car), seeds=1)
            sim.step()
            found[law] = sim.read(f"a.{plugin}.desired_heading")[0].item()
        assert found[stock] == pytest.approx(-math.pi / 6.0)
        assert found[historic] == found[stock] + 2.0 * math.pi


@pytest.mark.parametrize("angle", [-4.4e-16, -1e-17, 0.0, 4.4e-16, 1.0, -1.0, 4.0, -4.0, 9.0, -9.0, 40.0])
def test_tiny_negative_errors_of_angles_are_zero(angle):
    turned, wrapped = angle_2pi(angle), angle_pi(angle)
    assert 0.0 <= turned <= 2.0 * math.pi
    assert -math.pi < wrapped <= math.pi
    assert np.exp(1j * wrapped) == pytest.approx(np.exp(1j * angle))
    assert wrapped == (0.0 if -4.5e-16 < angle <= 0.0 else pytest.approx(wrapped)) or angle > 0.0
    if 0.0 <= angle <= math.pi:
        assert wrapped == angle


def test_each_parameter_of_scrimmage_has_its_default():
    """Or a reason why not; `scrimmage_parameters.csv` is the table."""
    rows = table()
    assert [(r.plugin, r.name) for r in rows] == sorted({(r.plugin, r.name) for r in rows})
    wrong = [r for r in rows if state_of(r.plugin, r.name, r.default) != r.state]
    assert not wrong
    unexplained = [
        r for r in rows if (r.state in ("unread", "differs", "refused")) != (r.reason not in ("", "?"))
    ]
    assert not unexplained


@pytest.mark.parametrize("state", ["unread", "refused"])
def test_what_has_no_effect_is_said(tmp_path, state):
    """A note, or an error, names each such attribute of an autonomy or a motion model."""
    for row in table():
        if row.state != state or row.plugin in ("PyAutonomy", "PyStraight"):  # whose class a file defines
            continue
        kind = historic.load(row.plugin)
        tag, other = (
            ("autonomy", "motion_model") if issubclass(kind, Autonomy) else ("motion_model", "autonomy")
        )
        if not issubclass(kind, Autonomy | MotionModel):
            continue
        file = tmp_path / "m.xml"
        file.write_text(
            f"""<runscript name="a"><run end="1" dt="0.1"/><entity><name>a</name><team_id>1</team_id>
            <{tag} {row.name}="{row.default or 1}">{row.plugin}</{tag}>
            <{other}>{"Straight" if other == "autonomy" else "SingleIntegrator"}</{other}></entity></runscript>"""
        )
        try:
            said = "\n".join(map(str, read_mission(file, compat="scrimmage").notes))
        except MissionError as error:
            said = str(error)
        assert row.name in said, row
