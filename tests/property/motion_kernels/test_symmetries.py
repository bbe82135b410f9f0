"""What must hold of any motion: turn the mission and the path turns; a step may be cut; speed is kept; time runs backwards."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tussle.numeric.quaternion import quat_rotate
from tussle.plugins.stock.motion.simple_aircraft import SimpleAircraft
from tussle.plugins.stock.motion.simple_aircraft import kernels as aircraft
from tussle.plugins.stock.motion.unicycle import Unicycle
from tussle.plugins.stock.motion.unicycle import kernels as unicycle

UNICYCLE, AIRCRAFT = Unicycle().advance, SimpleAircraft().advance
angle = st.floats(-math.pi, math.pi)
rate = st.floats(-2.0, 2.0)
speed = st.floats(-40.0, 40.0)
substeps = st.integers(1, 20)
UNLIMITED = np.array([[1e3], [1e3], [1e3], [1e3]])
AIRFRAME = np.array([[13.0], [1.0], [80.0], [1.4], [1.4], [3.0], [3.0], [50.0], [0.0]])


def column(*values):
    return np.array(values, float)[:, None]


@given(yaw=angle, pitch=angle, v=speed, w=rate, q=rate, n=substeps)
def test_unicycle_step_may_be_cut_at_a_substep(yaw, pitch, v, w, q, n):
    u = column(v, w, q)
    whole, cut = column(1, 2, 3, yaw, pitch), column(1, 2, 3, yaw, pitch)
    UNICYCLE(whole, u, UNLIMITED, 0.1 * n, n)
    for _ in range(n):
        UNICYCLE(cut, u, UNLIMITED, 0.1, 1)
    assert np.abs(whole - cut).max() < 1e-11


@given(yaw=angle, pitch=angle, v=speed, w=rate, q=rate, n=substeps)
def test_unicycle_comes_back_when_time_runs_backwards(yaw, pitch, v, w, q, n):
    start = column(1, 2, 3, yaw, pitch)
    x = start.copy()
    UNICYCLE(x, column(v, w, q), UNLIMITED, 0.7, n)
    UNICYCLE(x, column(v, w, q), UNLIMITED, -0.7, n)
    assert np.abs(x - start).max() < 1e-12


@given(yaw=angle, pitch=angle, v=speed, w=rate, q=rate)
def test_unicycle_publishes_its_speed_along_its_nose(yaw, pitch, v, w, q):
    out = np.empty((13, 1))
    unicycle.to_body(
        column(0, 0, 0, yaw, pitch),
        tuple(column(v, w, q)),
        tuple(UNLIMITED[:3]),
        (True, False),
        1e-9,
        out,
        0,
        (0, 1),
    )
    assert abs(np.linalg.norm(out[3:6]) - abs(v)) < 1e-12
    assert np.abs(quat_rotate(out[6:10], column(v, 0, 0)) - out[3:6]).max() < 1e-6


@given(yaw=angle, roll=st.floats(-1.3, 1.3), pitch=st.floats(-1.3, 1.3), v=st.floats(1.0, 80.0))
def test_aircraft_flies_at_its_speed_along_its_nose(yaw, roll, pitch, v):
    out, (radius, slope, target, *bounds) = np.empty((13, 1)), (AIRFRAME[k] for k in (0, 8, 7, 3, 4, 5, 6))
    still = np.zeros(1)
    aircraft.to_body(
        column(0, 0, 0, roll, pitch, yaw, v), (still, still), tuple(bounds), (radius, slope, target), out, 0
    )
    assert abs(np.linalg.norm(out[3:6]) - v) < 1e-12
    assert np.abs(quat_rotate(out[6:10], column(v, 0, 0)) - out[3:6]).max() < 1e-12
