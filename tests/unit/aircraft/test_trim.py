"""Trim and linear models of compiled aircraft, beside JSBSim's trim and flights of the aircraft itself."""

from __future__ import annotations

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.aircraft.trim import FOOT, linearize
from tussle.api import Autonomy, Output
from tussle.errors import ParameterError
from tussle.stock import JSBSimCompiled

pytestmark = pytest.mark.slow  # the aircraft takes the better part of a minute to compile

SPEED, ALTITUDE = 50.0, 1500.0
THROTTLE = 0.69


class Stick(Autonomy):
    throttle, elevator, aileron, rudder = Output(), Output(), Output(), Output()

    def step(self, g):
        self.throttle[:] = THROTTLE


@pytest.fixture(scope="module")
def cessna():
    pytest.importorskip("jsbsim")
    return JSBSimCompiled(aircraft="c172p")


def test_steady_flight_is_that_of_jsbsims_trim(cessna):
    import jsbsim

    point = cessna.steady_flight(SPEED, ALTITUDE)
    assert point.residual.max() < 1e-6
    fdm = jsbsim.FGFDMExec(None)
    fdm.set_debug_level(0)
    fdm.load_model("c172p")
    fdm.set_dt(1.0 / 120.0)
    for name, value in (("lat-geod-deg", 45.0), ("h-sl-ft", ALTITUDE / FOOT), ("vt-fps", SPEED / FOOT)):
        fdm[f"ic/{name}"] = value
    fdm.run_ic()
    fdm["propulsion/set-running"] = -1
    fdm.do_trim(0)  # to 1e-3 ft/s^2 and 1e-4 rad/s^2
    for name, theirs in (
        ("alpha", "aero/alpha-rad"),
        ("throttle", "fcs/throttle-cmd-norm"),
        ("pitch", "fcs/pitch-trim-cmd-norm"),
    ):
        assert point.values[name][0] == pytest.approx(fdm[theirs], abs=2e-5)


def test_a_linear_model_predicts_the_flight(cessna):
    """Half a second after a change of states and of the elevator, in flights with the engines settled at the start."""
    from scipy.linalg import expm

    model, aircraft, dt = cessna.linearize(SPEED, ALTITUDE), cessna.flown.aircraft, 1.0 / 1200.0
    assert model.a.shape == (8, 8)
    assert model.b.shape == (8, 4)
    at, names = (
        aircraft.slots,
        ["velocities/u-aero-fps", "velocities/w-aero-fps", "velocities/q-aero-rad_sec"],
    )
    x = np.repeat(model.point.state, 2, axis=1)
    du = 0.02
    x[at["fcs/elevator-cmd-norm"], 1] += du
    steps = 600
    aircraft.advance(x, aircraft.tables, 0, 2, steps, dt, dt)
    block = np.zeros((9, 9))
    block[:8, :8], block[:8, 8] = model.a, model.b[:, 1] * du
    moved = expm(block * steps * dt)[:8, 8]
    found = np.array([x[at[name], 1] - x[at[name], 0] for name in names]) * [FOOT, FOOT, 1.0]
    np.testing.assert_allclose(moved[[2, 4]], found[1:], rtol=0.01)
    assert moved[0] == pytest.approx(found[0], abs=2e-3)  # and terms of second order
    assert abs(found[1]) > 0.1


def test_columns_do_not_depend_on_the_difference(cessna):
    point, aircraft = cessna.steady_flight(SPEED, ALTITUDE), cessna.flown.aircraft
    one, two = (linearize(aircraft, point, difference=h) for h in (1e-4, 2e-5))
    np.testing.assert_allclose(one.a, two.a, atol=2e-3)
    np.testing.assert_allclose(one.b, two.b, atol=2e-3 * np.abs(one.b).max())


@pytest.mark.parametrize("kind", ["longitudinal", "full"])
def test_aircraft_of_a_mission_start_in_trim(kind):
    pytest.importorskip("jsbsim")
    climbed = {}
    for trim in ("none", kind):
        block = Block(
            name="c", count=3, position=(0, 0, 1500), variance=(1e4, 1e4, 1e4), speed=SPEED,
            autonomy=Stick(),
            motion=JSBSimCompiled(aircraft="c172p", trim=trim),
        )  # fmt: skip
        sim = Simulation(
            Mission(blocks=[block], dt=0.1, motion_multiplier=12, end=5), seeds=1, on_error="raise"
        )
        sim.step()
        vel = sim.read("c.vel")[0][0]
        climbed[trim] = np.abs(vel[:, 2]).max()
        if trim != "none":
            assert np.abs(vel[:, 0] - SPEED).max() < 0.05
    assert climbed[kind] < 0.02
    assert climbed["none"] > 10 * climbed[kind]


def test_a_flight_that_is_impossible_is_refused(cessna):
    with pytest.raises(
        ParameterError,
        match=r"c172p has no steady flight at this altitude and speed; the nearest, with alpha",
    ):
        cessna.steady_flight(15.0, ALTITUDE)
    with pytest.raises(ParameterError, match=r"'level' is not allowed.*none, longitudinal, full"):
        JSBSimCompiled(aircraft="c172p", trim="level")
