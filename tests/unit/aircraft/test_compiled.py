"""Compiled aircraft: the same flights as JSBSim makes, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tussle.aircraft.compile import CompiledAircraft, GeneratedKernel, compile_aircraft
from tussle.aircraft.initial import place, run_initial
from tussle.aircraft.node import MAX_NODES, AircraftError, read_text

DT = 1.0 / 120.0
START = {
    "ic/lat-geod-deg": 33.0,
    "ic/long-gc-deg": -84.0,
    "ic/psi-true-deg": 30.0,
    "ic/theta-deg": 2.0,
    "ic/phi-deg": 1.0,
}
GROUND = {**START, "ic/h-agl-ft": 4.6, "ic/vt-fps": 0.0, "ic/theta-deg": 0.0, "ic/phi-deg": 0.0}


def controls(t):
    return {"fcs/throttle-cmd-norm": 0.8, "fcs/elevator-cmd-norm": -0.03 + 0.02 * math.sin(0.5 * t),
            "fcs/aileron-cmd-norm": 0.03 * math.sin(0.3 * t), "fcs/rudder-cmd-norm": 0.02 * math.sin(0.2 * t)}  # fmt: skip


def roll_along(t):
    brakes = 1.0 if t < 1.0 else 0.0
    return {
        "fcs/throttle-cmd-norm": 1.0,
        "fcs/steer-cmd-norm": 0.01,
        "fcs/left-brake-cmd-norm": brakes,
        "fcs/right-brake-cmd-norm": brakes,
    }


def pilot(t):
    """The autopilot of c172x, its holds one after the other."""
    return {"fcs/throttle-cmd-norm": 0.8, "fcs/mixture-cmd-norm": 0.9, "ap/attitude_hold": float(t >= 1.0),
            "ap/altitude_hold": float(t >= 5.0), "ap/altitude_setpoint": 4100.0, "ap/heading_hold": float(t >= 20.0),
            "ap/heading_setpoint": 90.0 if t < 40.0 else 60.0}  # fmt: skip


def take_off(t):
    elevator = 0.0 if t < 18.0 else -0.15 if t < 19.5 else -0.08
    return {"fcs/throttle-cmd-norm": 1.0, "fcs/mixture-cmd-norm": 0.95, "fcs/elevator-cmd-norm": elevator,
            "fcs/rudder-cmd-norm": -0.1, "fcs/aileron-cmd-norm": 0.1 if t > 18.0 else 0.0}  # fmt: skip


def in_wind(t):
    return {**controls(t), "atmosphere/wind-north-fps": 20.0, "atmosphere/wind-east-fps": -10.0, "atmosphere/wind-down-fps": 2.0,
            "atmosphere/gust-east-fps": 8.0 * math.sin(t)}  # fmt: skip


def apart(name, start, end, script, start_engines=True):
    """Largest distance between JSBSim's flight and the compiled one [m]."""
    return both_flights(name, start, end, script, start_engines)[0]


def both_flights(name, start, end, script, start_engines=True):
    """Largest distance between JSBSim's flight and the compiled one [m], and JSBSim at the end."""
    jsbsim = pytest.importorskip("jsbsim")
    fdm = jsbsim.FGFDMExec(jsbsim.get_default_root_dir())
    fdm.set_debug_level(0)
    fdm.set_dt(DT)
    fdm.load_model(name)
    for key, value in start.items():
        fdm[key] = value
    fdm.run_ic()
    aircraft = compile_aircraft(None, name)
    x = aircraft.first[:, None].copy()
    single = [
        np.array([fdm[key]])
        for key in ("position/lat-geod-rad", "position/long-gc-rad", "position/geod-alt-ft")
    ]
    place(x, *single, *(np.array([[fdm[key]] for key in keys]) for keys in (
        ("attitude/phi-rad", "attitude/theta-rad", "attitude/psi-rad"),
        ("velocities/v-north-fps", "velocities/v-east-fps", "velocities/v-down-fps"),
        ("velocities/p-rad_sec", "velocities/q-rad_sec", "velocities/r-rad_sec"),
    )))  # fmt: skip
    run_initial(aircraft, x, DT)
    if aircraft.n_engines and start_engines:
        fdm["propulsion/set-running"] = -1
        aircraft.start(x, aircraft.tables, 0, 1, 1, 0.0, DT)
    far = 0.0
    for step in range(round(end / DT)):
        for key, value in script(step * DT).items():
            fdm[key] = value
            if key in aircraft.slots:
                x[aircraft.slots[key]] = value
        fdm.run()
        aircraft.advance(x, aircraft.tables, 0, 1, 1, DT, DT)
        if step % 12 == 11:
            far = max(far, 0.3048 * math.dist([fdm[f"position/eci-{axis}-ft"] for axis in "xyz"], x[7:10, 0]))
    assert math.isfinite(far)
    return far, fdm


def test_a_ball_falls_as_in_jsbsim():
    assert apart("ball", {**START, "ic/h-sl-ft": 5000.0, "ic/vt-fps": 180.0}, 17.0, controls) < 1e-6


@pytest.mark.slow
def test_a_light_aircraft_flies_as_in_jsbsim_for_a_minute():
    assert apart("c172p", {**START, "ic/h-sl-ft": 5000.0, "ic/vt-fps": 180.0}, 60.0, controls) < 1e-6


@pytest.mark.slow
def test_a_light_aircraft_flies_in_wind_as_in_jsbsim():
    assert apart("c172p", {**START, "ic/h-sl-ft": 5000.0, "ic/vt-fps": 180.0}, 60.0, in_wind) < 1e-6


@pytest.mark.slow
def test_a_light_aircraft_rolls_along_the_runway_as_in_jsbsim():
    assert apart("c172p", GROUND, 12.0, roll_along) < 1e-3


@pytest.mark.slow
def test_a_take_off_from_standstill_is_that_of_jsbsim():
    far, fdm = both_flights("c172p", GROUND, 27.0, take_off)
    assert fdm["position/h-agl-ft"] > 50.0
    assert not fdm["gear/wow"]
    assert far < 1e-3


@pytest.mark.slow
def test_an_autopilot_flies_as_in_jsbsim_for_a_minute():
    far, fdm = both_flights("c172x", {**START, "ic/h-sl-ft": 4000.0, "ic/vt-fps": 180.0}, 60.0, pilot)
    assert math.cos(fdm["attitude/psi-rad"] - math.radians(60.0)) > 0.99  # it flies to where it was told
    assert far < 1e-3


@pytest.mark.slow
def test_a_jet_flies_as_in_jsbsim_for_a_minute():
    assert apart("T37", {**START, "ic/h-sl-ft": 15000.0, "ic/vt-fps": 450.0}, 60.0, controls) < 1e-6


# -- what is refused ----------------------------------------------------------------------------------------------------------

WHOLE = """<?xml version="1.0"?>
<fdm_config>
 <metrics><wingarea unit="FT2">100</wingarea><wingspan unit="FT">30</wingspan><chord unit="FT">4</chord></metrics>
 <mass_balance><ixx>100</ixx><iyy>100</iyy><izz>100</izz><emptywt>{weight}</emptywt></mass_balance>
 {parts}
</fdm_config>"""


def compiled(tmp_path: Path, parts: str = "", weight: str = "500") -> CompiledAircraft:
    folder = tmp_path / "aircraft" / "kite"
    folder.mkdir(parents=True)
    (folder / "kite.xml").write_text(WHOLE.format(parts=parts, weight=weight))
    return compile_aircraft(tmp_path, "kite")


def axis(content):
    return f"<aerodynamics>\n<axis name='DRAG'><function name='aero/drag'>{content}</function></axis></aerodynamics>"


def channel(content):
    return f"<flight_control><channel name='c'>{content}</channel></flight_control>"


@pytest.mark.parametrize(
    ("parts", "message"),
    [
        (axis("<property>aero/nothing</property>"), r"kite.xml:6: <property>: property 'aero/nothing' is read, but nothing"),
        (axis("<product><value>two</value></product>"), r"'two' is not a number"),
        (axis("<value>nan</value>"), "is not a finite number"),
        (axis("<bessel><value>1</value></bessel>"), "<bessel>: function not supported"),
        (axis("<quotient><value>1</value></quotient>"), "it has 1 operands and needs 2"),
        (axis("<table><independentVar>aero/alpha-rad</independentVar><tableData>1 2 0 3</tableData></table>"), "must rise"),
        (axis("<table><independentVar>aero/alpha-rad</independentVar><tableData>1 2 3</tableData></table>"), "even count"),
        (axis("<table><tableData>1 2</tableData></table>"), "one to four keys"),
        (axis(""), "it is empty"),
        ("<aerodynamics><axis name='UP'/></aerodynamics>", "axis 'UP' is not known"),
        (channel("<gyro name='g'><input>attitude/phi-rad</input></gyro>"), "<gyro>: component not supported"),
        (channel("<summer><input>attitude/phi-rad</input></summer>"), "a component needs a name"),
        (channel("<pure_gain name='g'/>"), "it needs an <input>"),
        (channel("<switch name='s'><test value='1'>a b</test></switch>"), "'a b' is no condition"),
        (channel("<summer name='s'><input>fcs/a</input><delay>1e9</delay></summer>"), "a delay of 1e"),
        ("<ground_reactions><contact type='WING'/></ground_reactions>", "contact type 'WING' is not known"),
        ("<external_reactions><force name='f' frame='SEA'/></external_reactions>", "frame 'SEA' is not known"),
        ("<propulsion file='../../../etc/passwd'/>", "is no name of a file below the aircraft's folder"),
        ("<system file='nowhere'/>", "there is no file nowhere.xml"),
        ("<warp_drive/>", "<warp_drive>: part of an aircraft that is not supported"),
    ],
)  # fmt: skip
def test_what_is_not_compiled_is_refused_with_file_and_line(tmp_path, parts, message):
    with pytest.raises(AircraftError, match=message) as error:
        compiled(tmp_path, parts)
    assert "kite.xml:" in str(error.value)


def test_an_aircraft_without_weight_is_refused(tmp_path):
    with pytest.raises(AircraftError, match="no weight"):
        compiled(tmp_path, weight="0")


def test_hostile_xml_is_refused():
    for text, message in (
        ("<a>" * 100, "nest deeper"),
        ("<a>" + "<b/>" * (MAX_NODES + 1) + "</a>", "more than"),
        ("<!DOCTYPE a [<!ENTITY x '1'><!ENTITY y '&x;&x;'>]><a>&y;</a>", "only 100 short texts"),
        ("<!DOCTYPE a [<!ENTITY x SYSTEM 'file:///etc/passwd'>]><a>&x;</a>", "only 100 short texts"),
        ("<a", "it is not XML"),
        ("<?xml version='1.0' encoding='x-none'?><a/>", "encoding|not XML"),
    ):
        with pytest.raises(AircraftError, match=message):
            read_text(text.encode(), "h.xml")


def test_short_entities_are_replaced():
    assert read_text(b"<!DOCTYPE a [<!ENTITY on '1'>]><a>&on;</a>", "h.xml").text == "1"


def test_an_aircraft_that_is_not_there_is_named_with_the_nearest(tmp_path):
    (tmp_path / "aircraft" / "kite").mkdir(parents=True)
    with pytest.raises(AircraftError, match="did you mean 'kite'"):
        compile_aircraft(tmp_path, "kites")
    with pytest.raises(AircraftError, match="is no name of an aircraft"):
        compile_aircraft(tmp_path, "../kite")


def test_unread_properties_are_not_computed(tmp_path):
    aircraft = compiled(
        tmp_path, axis("<product><property>aero/qbar-psf</property><value>2.0</value></product>")
    )
    assert "p_aero_qbar_psf = dynamic" in aircraft.source
    assert "density_altitude" not in aircraft.source


def test_the_compiler_leaves_out_what_takes_seconds_for_generated_code():
    from numba.core.event import install_recorder

    def step(x, tables, begin, end, n_steps, dt, frozen_dt):
        for row in range(begin, end):
            y = x[0, row]
            for _ in range(n_steps):
                y = y + dt * tables[0] if y > frozen_dt else 0.0
            x[0, row] = y

    made = GeneratedKernel(step, "F2w F i8 i8 i8 f8 f8")
    compiler = made._new_dispatcher("any")
    with install_recorder("numba:run_pass") as passes:
        compiler.compile(made.types)
    names = " ".join(event.data["name"] for _, event in passes.buffer)
    assert "native_lowering" in names
    assert "ssa" not in names
    assert "rewrite" not in names
    x = np.full((1, 3), 2.0)
    compiler(x, np.array([0.5]), 0, 2, 4, 0.25, 1.0)
    assert x[0].tolist() == [2.5, 2.5, 2.0]
