"""Aircraft flown by JSBSim: the same flights as JSBSim makes by itself, controllers, snapshots, and errors."""

from __future__ import annotations

import math
import socket
import sys
from pathlib import Path

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, Output
from tussle.errors import ParameterError, PluginError, TussleError
from tussle.mission import read_mission
from tussle.plugins import stock
from tussle.plugins.stock.motion import jsbsim_model
from tussle.scene import Scene
from tussle.stock import (
    AircraftPIDController,
    JSBSimControl,
    JSBSimControlControllerHeadingPID,
    JSBSimModel,
    JSBSimModelControllerHeadingPID,
    Straight,
)
from tussle.world.geodesy import Origin

jsbsim = pytest.importorskip("jsbsim")
SCENE = Scene(origin=Origin.from_degrees(35.7, -120.8, 100.0))
FOOT = 0.3048
HAWK = str(Path(jsbsim_model.__file__).with_name("hawk"))


class Stick(Autonomy):
    """Moves the surfaces by the time."""

    throttle, elevator, aileron, rudder = Output(), Output(), Output(), Output()

    def step(self, g):
        t = g.t
        self.throttle[:] = 0.7
        self.elevator[:] = 0.05 * np.sin(t)
        self.aileron[:] = 0.1 * np.sin(0.5 * t)
        self.rudder[:] = 0.02 * np.cos(t)


def mission(
    motion, autonomy=None, controller=None, position=(1000.0, 2000.0, 1500.0), speed=50.0, heading=0.5, **more
):
    velocity = speed * math.cos(heading), speed * math.sin(heading), 0.0
    block = Block(
        name="a", position=position, heading=heading, velocity=velocity, motion=motion, autonomy=autonomy or Stick(),
        controller=controller, count=more.pop("count", 1), half_width=(300.0, 300.0, 50.0), placement="uniform",
    )  # fmt: skip
    return Mission(blocks=[block], scene=SCENE, **{"dt": 1 / 120, "end": 10.0} | more)


def body(sim, name):
    return sim.read(f"a.{name}")[0][0]


def test_a_flight_is_that_of_jsbsim():
    sim = Simulation(
        mission(JSBSimControl(aircraft="c172p", trim="longitudinal", wind=(3.0, -2.0, 0.0)), end=11.0)
    )
    handle = sim.state.population.groups[0].motion.handles["flight"][0]
    ((placing, _),) = handle.fleet.flights[handle.number].history
    sim.step(1200)
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.set_dt(1 / 120)
    fdm.load_model("c172p")
    values, origin = placing
    place, motion, wind = values[:6], values[6:12], values[12:15]
    fdm["ic/terrain-elevation-ft"] = 100.0 / FOOT
    names = "lat-geod-rad long-gc-rad h-sl-ft phi-rad theta-rad psi-true-rad vn-fps ve-fps vd-fps"
    for name, value in zip(names.split(), [*place, *motion[:3]], strict=True):
        fdm[f"ic/{name}"] = value
    fdm.run_ic()
    latitude, _, altitude = origin.to_geodetic(np.array([1000.0, 2000.0, 1500.0]))
    assert fdm["position/lat-geod-rad"] == pytest.approx(latitude, abs=1e-14)
    assert FOOT * fdm["position/geod-alt-ft"] == pytest.approx(altitude, abs=1e-7)
    fdm["atmosphere/wind-north-fps"], fdm["atmosphere/wind-east-fps"], fdm["atmosphere/wind-down-fps"] = wind
    fdm["propulsion/set-running"] = -1
    fdm.do_trim(0)
    for k in range(1200):
        t = k / 120
        fdm["fcs/throttle-cmd-norm"], fdm["fcs/elevator-cmd-norm"] = 0.7, 0.05 * math.sin(t)
        fdm["fcs/aileron-cmd-norm"], fdm["fcs/rudder-cmd-norm"] = 0.1 * math.sin(0.5 * t), 0.02 * math.cos(t)
        fdm.run()
    there = fdm["position/lat-geod-rad"], fdm["position/long-gc-rad"], FOOT * fdm["position/geod-alt-ft"]
    (pos,), (vel,), (quat,) = body(sim, "pos"), body(sim, "vel"), body(sim, "quat")
    assert np.abs(pos - origin.from_geodetic(np.array(there))).max() < 1e-6
    assert np.linalg.norm(pos - (1000.0, 2000.0, 1500.0)) > 300.0
    speed = FOOT * math.sqrt(sum(fdm[f"velocities/v-{axis}-fps"] ** 2 for axis in ("north", "east", "down")))
    assert np.linalg.norm(vel) == pytest.approx(speed, rel=1e-12)
    # The world's vertical differs from the local one by 0.4 mrad there.
    up = 1.0 - 2.0 * (quat[1] ** 2 + quat[2] ** 2)
    assert up == pytest.approx(
        math.cos(fdm["attitude/phi-rad"]) * math.cos(fdm["attitude/theta-rad"]), abs=1e-3
    )
    assert sim.state.population.bodies.view.yaw[0] == pytest.approx(
        math.pi / 2 - fdm["attitude/psi-rad"], abs=1e-3
    )
    before = body(sim, "pos")
    sim.step()
    assert (body(sim, "pos") - before) * 120 == pytest.approx(vel[None], abs=0.2)


def test_the_autopilot_of_a_script_holds_bank_altitude_and_speed(tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    straight, turn = Straight(speed=25.0), JSBSimModelControllerHeadingPID(max_bank=0.5)
    aircraft = JSBSimModel(script_name="patrol.xml", jsbsim_root=HAWK)
    game = mission(
        aircraft, straight, turn, speed=0.0, position=(0, 0, 200), dt=0.1, motion_multiplier=12, end=60.0
    )
    sim = Simulation(game)
    sim.step(5)
    assert np.linalg.norm(body(sim, "vel")[0]) == pytest.approx(
        45 * 0.5144, rel=0.2
    )  # that of the script's start
    sim.write("a.Straight.goal", (0.0, 1e6, 250.0))
    sim.step(590)
    (pos,), (vel,) = body(sim, "pos"), body(sim, "vel")
    view = sim.state.population.bodies.view
    assert pos[2] == pytest.approx(250.0, abs=8.0)
    assert np.linalg.norm(vel) == pytest.approx(25.0, abs=2.5)
    assert math.atan2(vel[1], vel[0]) == pytest.approx(math.pi / 2, abs=0.05)
    assert abs(view.roll[0]) < 0.05
    assert not list(tmp_path.iterdir())  # the output that the aircraft asks for is not written
    assert capfd.readouterr() == ("", "")


@pytest.mark.slow
def test_controllers_fly_an_aircraft_by_its_surfaces():
    level = mission(
        JSBSimControl(aircraft="c172p", trim="longitudinal"), Straight(speed=50.0), JSBSimControlControllerHeadingPID(), end=20.0
    )  # fmt: skip
    sim = Simulation(level)
    sim.step(2000)
    view = sim.state.population.bodies.view
    assert (abs(view.roll[0]), abs(view.climb[0])) < (0.1, 0.2)
    assert view.yaw[0] == pytest.approx(0.5, abs=0.1)
    holds = AircraftPIDController(max_pitch=0.2, max_roll=0.5, altitude_pid=(0.2, 0, 0, 10))
    sim = Simulation(
        mission(JSBSimControl(aircraft="c172p", trim="longitudinal"), Straight(speed=55.0), holds, end=60.0)
    )
    sim.step(7000)
    (pos,), (vel,) = body(sim, "pos"), body(sim, "vel")
    assert pos[2] == pytest.approx(1500.0, abs=15.0)
    assert np.linalg.norm(vel) == pytest.approx(55.0, abs=4.0)


def test_worlds_snapshots_and_moved_aircraft():
    game = mission(JSBSimControl(aircraft="ball"), count=3, speed=20.0, end=2.0)
    with Simulation(game, [1, 2], threads=2) as sim, Simulation(game, 2) as alone:
        sim.step(60)
        alone.step(60)
        assert sim.state_hash(1) == alone.state_hash()
        saved = sim.snapshot()
        sim.step(30)
        after = [sim.state_hash(w) for w in range(2)]
        sim.restore(saved)
        sim.step(30)
        assert [sim.state_hash(w) for w in range(2)] == after
        pos = body(alone, "pos")
        alone.write("a.pos", pos + np.array([0.0, 0.0, 500.0]))
        alone.step()
        assert body(alone, "pos")[:, 2] == pytest.approx(pos[:, 2] + 500.0, abs=1.0)
        assert body(alone, "vel")[:, 2] == pytest.approx(-9.8 * 61 / 120, rel=0.02)


@pytest.mark.parametrize("processes", [1, 2])
def test_a_flightgear_receives_the_states(processes):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as viewer:
        viewer.bind(("127.0.0.1", 0))
        viewer.settimeout(60.0)
        shown = {
            "flightgear_output_enable": True,
            "flightgear_ip": "127.0.0.1",
            "flightgear_port": viewer.getsockname()[1],
        }
        Simulation(mission(JSBSimControl(aircraft="ball", processes=processes, **shown))).step(30)
        assert len(viewer.recv(4096)) > 300


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ({}, "takes script_name or aircraft"),
        ({"aircraft": "c172q"}, "did you mean 'c172"),
        ({"script_name": "rascal_piedmont.xml"}, "jsbsim_root names the folder"),
        ({"aircraft": "blank"}, "cannot load"),
        ({"aircraft": "c172p", "trim": "full"}, "cannot trim c172p"),
    ],
)  # fmt: skip
def test_what_cannot_be_loaded_is_said(values, said):
    with pytest.raises(TussleError, match=said):
        Simulation(mission(JSBSimControl(**values), speed=5.0)).step()


def test_an_aircraft_without_the_autopilot_is_refused():
    with pytest.raises(TussleError, match="no property ap/bank_setpoint"):
        Simulation(
            mission(JSBSimModel(aircraft="c172x"), Straight(), JSBSimModelControllerHeadingPID())
        ).step()


def test_a_trim_is_one_of_jsbsims():
    with pytest.raises(ParameterError, match="did you mean 'full'"):
        JSBSimControl(aircraft="c172p", trim="ful")


def test_there_is_no_rollout_and_a_missing_package_is_named(monkeypatch):
    with pytest.raises(ParameterError, match="has no rollout"):
        JSBSimControl(aircraft="ball").rollout(np.zeros(13), np.zeros((1, 4)), 0.1)
    monkeypatch.setitem(sys.modules, "jsbsim", None)
    with pytest.raises(TussleError, match=r"pip install 'tussle\[jsbsim\]'"):
        Simulation(mission(JSBSimControl(aircraft="ball"))).step()


def test_a_mission_file_names_a_script(tmp_path):
    file = tmp_path / "m.xml"
    file.write_text(
        f"""<runscript><run end="1" dt="0.1" motion_multiplier="12"/><entity><team_id>1</team_id><z>200</z><speed>25</speed>
        <script_name>patrol.xml</script_name><motion_model jsbsim_root="{HAWK}">JSBSimModel</motion_model>
        <controller>JSBSimModelControllerHeadingPID</controller><autonomy>Straight</autonomy></entity></runscript>"""
    )
    game = read_mission(file).mission
    assert game.blocks[0].motion.values["script_name"] == "patrol.xml"
    with Simulation(game) as sim:
        sim.step(10)
        assert sim.read(f"{game.blocks[0].name}.pos")[0][0, 0, 0] > 20.0


@pytest.mark.parametrize("name", ["JSBSimModel", "JSBSimModelControllerHeadingPID"])
def test_examples_fly_alone_as_in_a_stack(name):
    loaded = read_mission(stock.examples()[name])
    assert loaded.notes == ()
    with Simulation(loaded.mission, [2, 1]) as sim, Simulation(loaded.mission, 1) as alone:
        sim.step(50)
        alone.step(50)
        assert sim.state_hash(1) == alone.state_hash()


@pytest.mark.filterwarnings("ignore:.*it tumbles:RuntimeWarning")
@pytest.mark.parametrize("processes", [1, 2])
def test_an_aircraft_that_is_no_longer_finite_ends_its_world_or_is_removed_alone(processes):
    good = JSBSimControl(aircraft="c172p", processes=processes)
    windy = good.replace(wind=(1e30, 0.0, 0.0))
    two = mission(good)
    lost = two.blocks[0].replace(name="lost", position=(0.0, 0.0, 900.0), motion=windy)
    two = two.replace(blocks=[*two.blocks, lost])
    with pytest.raises(
        PluginError, match=r"JSBSimControl, lost 2, .*the state is not finite of .* after .* s: \w+"
    ):
        Simulation(two).step(60)
    removed = two.replace(blocks=[two.blocks[0], lost.replace(motion=windy.replace(on_failure="remove"))])
    result = Simulation(removed.replace(end=0.5)).run()[0]
    assert result.error is None
    assert result.alive == {0: 1}


def fan(folder):
    """A root of JSBSim with an aircraft of 6 kg whose electric motor starts at full power in flight."""
    for name, text in {
        "aircraft/fan/fan.xml": FAN,
        "engine/motor.xml": MOTOR,
        "engine/blades.xml": BLADES,
    }.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return str(folder)


FAN = """<fdm_config name="fan" version="2.0"><metrics>
<wingarea unit="M2">1</wingarea><wingspan unit="M">2.7</wingspan><chord unit="M">0.4</chord>
<location name="AERORP" unit="M"><x>0</x><y>0</y><z>0</z></location></metrics>
<mass_balance><ixx unit="KG*M2">2.6</ixx><iyy unit="KG*M2">2.1</iyy><izz unit="KG*M2">2.6</izz><emptywt unit="KG">6</emptywt>
<location name="CG" unit="M"><x>0</x><y>0</y><z>0</z></location></mass_balance><ground_reactions/>
<propulsion><engine file="motor">
<thruster file="blades"><location unit="M"><x>-1</x><y>0</y><z>0</z></location></thruster></engine></propulsion>
<flight_control name="fcs"/><aerodynamics/></fdm_config>"""
MOTOR = '<electric_engine name="motor"><power unit="WATTS">2200</power></electric_engine>'
BLADES = """<propeller name="blades"><ixx>0.00085</ixx><diameter unit="IN">18</diameter><numblades>2</numblades><minpitch>30</minpitch>
<maxpitch>30</maxpitch><table name="C_THRUST" type="internal"><tableData>0 0.08
1.4 -0.05</tableData></table><table name="C_POWER" type="internal"><tableData>0 0.09
1.4 -0.08</tableData></table></propeller>"""


def test_a_propeller_that_begins_to_turn_does_not_throw_the_aircraft_over(tmp_path):
    """2.2 kW at some 10,000 rpm is a torque of 2 N m: the aircraft of 2.6 kg m^2 turns by less than 50 deg/s after a second."""
    sim = Simulation(mission(JSBSimControl(aircraft="fan", jsbsim_root=fan(tmp_path)), end=2.0))
    fastest = 0.0
    for _ in range(120):
        sim.step()
        fastest = max(fastest, float(np.abs(body(sim, "omega")).max()))
    assert 0.0 < math.degrees(fastest) < 100.0


def test_an_aircraft_that_tumbles_from_the_start_is_told_once():
    with Simulation(mission(JSBSimControl(aircraft="c172p"), Stick(), count=2), 1) as simulation:
        simulation.write("a.omega", [[[0.0, 0.0, 0.0], [40.0, 0.0, 0.0]]])
        with pytest.warns(
            RuntimeWarning,
            match=r"JSBSimControl: a 2 of world 0 turns at \d+ deg/s at t = 0\.\d+ s: it tumbles",
        ) as told:
            simulation.step(20)
        assert len(told) == 1


def test_an_aircraft_that_tumbles_later_is_not():
    with Simulation(mission(JSBSimControl(aircraft="c172p"), Stick()), 1) as simulation:
        simulation.step(130)
        simulation.write("a.omega", [[[40.0, 0.0, 0.0]]])
        simulation.step(3)
