"""Aircraft of JSBSim by SCRIMMAGE's laws: JSBSim flown by hand over a sphere, one step at the birth."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from tussle import Block, Mission, Scene, Simulation
from tussle.api import Autonomy, Output
from tussle.plugins.stock.motion import jsbsim_model
from tussle.stock import JSBSimControl, JSBSimModel, JSBSimModelControllerHeadingPID, Straight
from tussle.world.geodesy import Origin

jsbsim = pytest.importorskip("jsbsim")
METRE = 3.28084  # [ft]
SURFACES = "elevator", "aileron", "rudder"
SCENE = Scene(origin=Origin.from_degrees(35.7, -120.8, 100.0))


class Stick(Autonomy):
    """Moves the surfaces by the time."""

    throttle, elevator, aileron, rudder = Output(), Output(), Output(), Output()

    def step(self, g):
        self.throttle[:] = 0.7
        self.elevator[:] = 0.05 * np.sin(g.t)
        self.aileron[:] = 0.1 * np.sin(0.5 * g.t)
        self.rudder[:] = 0.02 * np.cos(g.t)


GAME = Mission(
    blocks=[
        Block(
            name="a", position=(1000.0, 2000.0, 1500.0), heading=0.5, velocity=(50.0 * math.cos(0.5), 50.0 * math.sin(0.5), 0.0),
            motion=JSBSimControl(aircraft="c172p"), autonomy=Stick(),
        )
    ],
    scene=SCENE, dt=0.01, end=3.0, compat="scrimmage",
)  # fmt: skip


def test_surfaces_move_an_aircraft_as_in_scrimmage(tmp_path):
    with Simulation(GAME) as simulation:
        start = simulation.read("a.pos")[0][0, 0]
        simulation.step(200)
        (pos,), (vel,) = (simulation.read(f"a.{name}")[0][0] for name in ("pos", "vel"))

    planet = tmp_path / "sphere.xml"
    axes = "".join(f'<{name}_axis unit="M">6378137</{name}_axis>' for name in ("semimajor", "semiminor"))
    planet.write_text(f'<planet name="sphere">{axes}</planet>')
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.load_planet(str(planet), False)
    fdm.set_dt(0.01)
    fdm.load_model("c172p")
    latitude, longitude, altitude = SCENE.origin.to_geodetic(np.array([1000.0, 2000.0, 1500.0]))
    fdm["ic/terrain-elevation-ft"] = 100.0 / 0.3048
    fdm["ic/lat-gc-rad"] = math.radians(round(math.degrees(latitude), 6))
    fdm["ic/long-gc-rad"] = math.radians(round(math.degrees(longitude), 6))
    fdm["ic/h-sl-ft"] = METRE * round(altitude, 6)
    fdm["ic/phi-rad"] = fdm["ic/theta-rad"] = 0.0
    fdm["ic/psi-true-rad"] = math.radians(90.0 - round(math.degrees(0.5), 6))
    fdm["ic/vn-fps"], fdm["ic/ve-fps"] = METRE * 50.0 * math.sin(0.5), METRE * 50.0 * math.cos(0.5)
    fdm["ic/vd-fps"] = 0.0
    fdm.run_ic()
    fdm.run()

    def place():
        degrees = fdm["position/lat-gc-rad"], fdm["position/long-gc-rad"], fdm["position/h-sl-ft"] / METRE
        return SCENE.origin.from_geodetic(np.array(degrees))

    assert np.abs(start - place()).max() < 1e-6
    assert np.linalg.norm(start - (1000.0, 2000.0, 1500.0)) == pytest.approx(
        0.5, rel=0.3
    )  # rounded, and a step
    for k in range(200):
        t = 0.01 * k
        fdm["fcs/throttle-cmd-norm"] = 0.7 if k >= 5 else 0.0
        moved = 0.05 * math.sin(t), 0.1 * math.sin(0.5 * t), 0.02 * math.cos(t)
        for name, value in zip(SURFACES, moved, strict=True):
            fdm[f"fcs/{name}-cmd-norm"] = value
        fdm.run()
    assert np.abs(pos - place()).max() < 1e-6
    there = fdm["velocities/v-east-fps"], fdm["velocities/v-north-fps"], -fdm["velocities/v-down-fps"]
    assert np.abs(vel - np.array(there) / METRE).max() < 1e-7


def test_a_snapshot_continues_such_a_flight():
    with Simulation(GAME) as simulation:
        simulation.step(3)  # before the throttle opens
        saved = simulation.snapshot()
        simulation.step(20)
        straight = simulation.read("a.pos")[0]
        simulation.restore(saved)
        simulation.step(20)
        assert (simulation.read("a.pos")[0] == straight).all()


def test_the_ground_is_that_of_the_origin_for_one_model_and_the_sea_for_the_other():
    """SCRIMMAGE's Boids ask an aircraft of JSBSimModel for the height of the origin, at which it flies on."""
    hawk = JSBSimModel(
        script_name="patrol.xml", jsbsim_root=str(Path(jsbsim_model.__file__).with_name("hawk"))
    )
    blocks = [
        Block(
            name="low", position=(0.0, 0.0, -20.0), motion=hawk, autonomy=Straight(speed=25.0),
            controller=JSBSimModelControllerHeadingPID(),
        ),
        Block(name="on_ground", position=(500.0, 0.0, 2.0), motion=JSBSimControl(aircraft="c172p"), autonomy=Stick()),
    ]  # fmt: skip
    with Simulation(Mission(blocks=blocks, scene=SCENE, dt=0.01, compat="scrimmage")) as simulation:
        simulation.step(300)
        (low,), (standing,) = (simulation.read(f"{name}.pos")[0][0] for name in ("low", "on_ground"))
        handles = [group.motion.handles["flight"][0] for group in simulation.state.population.groups]
        above = [handle.fleet.flights[handle.number].fdm["position/h-agl-ft"] / METRE for handle in handles]
    assert low[2] == pytest.approx(-20.0, abs=5.0)
    assert above == pytest.approx([low[2] + 100.0, standing[2]], abs=0.1)
    assert standing[2] == pytest.approx(1.3, abs=1.0)
