"""Vehicles with six degrees of freedom: Newton's and Euler's equations, hover, terminal velocity, trim, buoyancy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from six_degrees import inputs, state

from tussle.errors import ParameterError
from tussle.numeric.quaternion import quat_rotate
from tussle.plugins import stock
from tussle.stock import UUV6DOF, FixedWing6DOF, Multirotor, RigidBody6DOF

WEIGHT = 1.5 * 9.81
HOVER = math.sqrt(WEIGHT / 4.0 / 5.45e-6)


def rate_of(model, x, *commands, **others):
    """Time derivative of a state, by a short step."""
    h = 1e-5
    path = model.rollout(x, inputs(1, *commands, **others), dt=h)
    return (path[1] - path[0]) / h


# -- rigid body --------------------------------------------------------------------------------------------------------------------


def test_a_free_body_keeps_its_angular_momentum_and_energy_and_converges_with_fourth_order():
    inertia = np.array([1.0, 2.0, 3.0])
    body = RigidBody6DOF(inertia_matrix=(1.0, 0.0, 0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 3.0))
    start = state(omega=(0.3, 2.0, 0.5))  # close to the unstable axis: it tumbles
    paths = {
        n: body.rollout(start, inputs(40, 0, 0, 0, 0, mass=(1.0,)), dt=0.25, substeps=n) for n in (4, 8, 64)
    }
    x = paths[64].T
    quat = x[6:10] / np.linalg.norm(x[6:10], axis=0)
    momentum = quat_rotate(quat, inertia[:, None] * x[10:])
    assert np.abs(momentum - momentum[:, :1]).max() < 1e-8
    assert np.abs(inertia @ x[10:] ** 2 - inertia @ start[10:] ** 2).max() < 1e-8
    assert x[11].min() < -1.5  # it did tumble
    errors = [np.abs(paths[n] - paths[64])[-1].max() for n in (4, 8)]
    assert math.log2(errors[0] / errors[1]) == pytest.approx(4.0, abs=0.5)


def test_the_body_follows_its_nose_and_stays_within_its_speeds():
    body = RigidBody6DOF(min_velocity=5.0, max_velocity=20.0)
    x = body.rollout(state(yaw=math.pi / 2), inputs(100, 8.0, 0.0, 0.0, 0.0, mass=(2.0,)), dt=0.05)
    assert np.linalg.norm(x[:, 3:6], axis=1).max() <= 20.0
    assert x[-1, 3:6] == pytest.approx([0.0, 20.0, 0.0], abs=0.01)
    x = body.rollout(state(vel=(10.0, 0.0, 0.0)), inputs(100, -8.0, 0.0, 0.0, 0.1, mass=(2.0,)), dt=0.05)
    assert x[-1, 12] == pytest.approx(0.5)  # a torque of 0.1 N m for 5 s at 1 kg m^2
    assert np.linalg.norm(x[-1, 3:6]) == pytest.approx(5.0, abs=0.05)
    heading = 2.0 * math.atan2(x[-1, 9], x[-1, 6])
    assert heading == pytest.approx(0.5 * 0.1 * 5.0**2)
    assert math.atan2(x[-1, 4], x[-1, 3]) == pytest.approx(heading, abs=0.15)


def test_forces_act_by_the_mass():
    body = rate_of(RigidBody6DOF(), state(), 0, 0, 0, 0, loads=(4.0, 0.0, 6.0, 0.0, 0.5, 0.0), mass=(2.0,))
    assert body[[3, 5, 11]] == pytest.approx([2.0, 3.0, 0.5], rel=1e-3)


@pytest.mark.parametrize("matrix", ["[1 0 0] [0 -1 0] [0 0 1]", "[1 2 0] [2 1 0] [0 0 1]"])
def test_an_inertia_tensor_is_positive_definite(matrix):
    with pytest.raises(ParameterError, match=r"inertia_matrix.*positive definite"):
        RigidBody6DOF(inertia_matrix=matrix)


# -- multirotor --------------------------------------------------------------------------------------------------------------------


def test_a_multirotor_hovers_at_the_thrust_of_its_weight_and_falls_without():
    hover = Multirotor().rollout(state(pos=(0.0, 0.0, 50.0)), inputs(100, *[HOVER] * 4), dt=0.1)
    assert hover[-1] == pytest.approx(hover[0], abs=1e-9)
    still = Multirotor(omega_min=0.0, c_D=0.0)
    fall = still.rollout(state(vel=(3.0, 0.0, 0.0)), inputs(20, 0, 0, 0, 0), dt=0.1)[-1]
    assert fall[:3] == pytest.approx([6.0, 0.0, -0.5 * 9.81 * 4.0], rel=1e-9)
    fast = Multirotor(omega_min=0.0).rollout(state(), inputs(300, 0, 0, 0, 0), dt=0.1)[-1]
    assert fast[5] == pytest.approx(-math.sqrt(2.0 * WEIGHT / 0.058), rel=1e-6)


def test_rotors_turn_the_body_by_their_places_and_directions():
    more = math.sqrt(2.0) * HOVER
    thrust = WEIGHT / 4.0
    # the rotors are right, left (counter-clockwise), front, back (clockwise)
    right, front = (
        rate_of(Multirotor(), state(), more, *[HOVER] * 3),
        rate_of(Multirotor(), state(), HOVER, HOVER, more, HOVER),
    )
    assert right[10] == pytest.approx(-0.175 * thrust / 0.0122, rel=1e-6)
    assert front[11] == pytest.approx(-0.175 * thrust / 0.0122, rel=1e-6)
    spin = 2.284e-7 * HOVER**2 / 0.0244
    assert [right[12], front[12]] == pytest.approx([-spin, spin], rel=1e-6)


def test_rotors_may_be_six_high_and_tilted():
    six = "[CW 1 0 0 0 0 0] [CCW 0 1 0 0 0 0] [CW -1 0 0 0 0 0] [CCW 0 -1 0 0 0 0] [CW 0 0 0.5 0 90 0] [CCW 0 0 0 0 0 0]"
    copter = Multirotor(rotor_config=six, omega_min=0.0)
    assert copter.active_inputs() == [f"motor_{i}" for i in range(6)]
    pushed = rate_of(copter, state(), 0, 0, 0, 0, HOVER, 0)
    push = 5.45e-6 * HOVER**2
    assert pushed[3] == pytest.approx(
        push / 1.5, rel=1e-5
    )  # the fifth thrusts forwards, half a meter above the center
    assert pushed[11] == pytest.approx(0.5 * push / 0.0122, rel=1e-3)


@pytest.mark.parametrize("rotors", ["", "[ 0.5 0 0 0 0 0 0 ]", "[CW 0 0 0 0 0 0] " * 9])
def test_what_is_no_list_of_rotors_is_refused(rotors):
    with pytest.raises(ParameterError, match=r"rotor_config.*1 to 8 rows \[CW or CCW x y z"):
        Multirotor(rotor_config=rotors)


# -- aircraft ----------------------------------------------------------------------------------------------------------------------


def trimmed(model, speed):
    """Throttle, elevator and angle of attack of level flight, and the lift coefficient, by fixed-point iteration."""
    p = model.values
    push = 0.5 * p["air_density"] * speed**2 * p["surface_area_of_wing"]
    alpha, thrust = 0.0, 0.0
    for _ in range(50):
        lift = (p["mass"] * p["gravity_magnitude"] - thrust * math.sin(alpha)) / push
        elevator = -(p["pitch_moment"][0] + p["pitch_moment"][1] * alpha) / p["pitch_moment"][4]
        attached = (lift - p["lift"][0] - p["lift"][4] * elevator) / p["lift"][1]
        alpha = attached / (1.0 - (attached / 0.45) ** 4) ** 0.25
        ratio = p["wing_span"] ** 2 / p["surface_area_of_wing"]
        drag = p["drag"][0] + p["drag"][1] * abs(alpha) + p["drag"][2] * abs(elevator)
        thrust = push * (drag + lift**2 / (math.pi * ratio * p["efficiency_factor"])) / math.cos(alpha)
    return (thrust - p["thrust_min"]) / (p["thrust_max"] - p["thrust_min"]), elevator, alpha


@pytest.mark.parametrize(
    ("name", "speed"),
    [("FixedWing6DOF", 222.0), ("FixedWing6DOF-A-4D", 150.0), ("FixedWing6DOF-Rascal", 20.0)],
)
def test_a_trimmed_aircraft_flies_level(name, speed):
    model = stock.load(name)()
    throttle, elevator, alpha = trimmed(model, speed)
    assert 0.0 < throttle < 1.0
    start = state(pos=(0.0, 0.0, 100.0), vel=(speed, 0.0, 0.0), climb=alpha)
    path = model.rollout(start, inputs(200, throttle, elevator, 0, 0), dt=0.1, substeps=10)
    assert path[-1, :6] == pytest.approx([20.0 * speed, 0.0, 100.0, speed, 0.0, 0.0], abs=1e-4)


def test_the_wind_carries_an_aircraft():
    model = FixedWing6DOF(wind=(-10.0, 4.0, 0.0))
    throttle, elevator, alpha = trimmed(model, 222.0)
    start = state(pos=(0.0, 0.0, 100.0), vel=(212.0, 4.0, 0.0), climb=alpha)
    path = model.rollout(start, inputs(20, throttle, elevator, 0, 0), dt=0.1, substeps=10)
    assert path[-1, :3] == pytest.approx([2.0 * 212.0, 8.0, 100.0], abs=1e-4)


def test_surfaces_and_sideslip_turn_an_aircraft_by_their_derivatives():
    model = stock.load("FixedWing6DOF-Rascal")()  # its inertia tensor is diagonal
    ixx, iyy, izz = (model.values["inertia_matrix_slug_ft_sq"][i] for i in (0, 4, 8))
    push = 0.5 * 1.225 * 400.0 * 0.982
    level = state(pos=(0.0, 0.0, 100.0), vel=(20.0, 0.0, 0.0))
    still = rate_of(model, level, 0, 0, 0, 0)
    assert rate_of(model, level, 0, 0, 0.1, 0)[10] == pytest.approx(push * 2.7 * 0.13 * 0.1 / ixx, rel=1e-2)
    assert rate_of(model, level, 0, 0, 0, 0.1)[12] == pytest.approx(push * 2.7 * 0.05 * 0.1 / izz, rel=1e-2)
    # moments by the rate of alpha are included: the elevator's lift turns the path
    lift = push * 0.2 * 0.1 / 5.91
    damping = 7.0 * (lift / 20.0) * 0.351 / 40.0
    pitch = -push * 0.351 * (-0.05 + damping) / iyy
    assert rate_of(model, level, 0, 0.1, 0, 0)[11] - still[11] == pytest.approx(pitch, rel=2e-2)
    slipping = rate_of(
        model, state(pos=(0.0, 0.0, 100.0), vel=(20.0, -2.0, 0.0)), 0, 0, 0, 0
    )  # air from the right
    assert slipping[12] < 0.0  # the tail turns the nose right, into the wind
    assert slipping[4] > 0.0  # the side force pushes left


def test_an_aircraft_comes_to_rest_on_the_ground():
    model = FixedWing6DOF(air_density=0.0)
    down = model.rollout(
        state(pos=(0.0, 0.0, 1.0), vel=(0.0, 0.0, -3.0)), inputs(100, 0.5, 0, 0, 0), dt=0.1, substeps=10
    )
    assert down[-1, 2] == pytest.approx(-9.81 / 400.0, rel=1e-6)
    free = model.replace(use_ground_model=False).rollout(state(), inputs(10, 0.5, 0, 0, 0), dt=0.1)
    assert free[-1, 2] == pytest.approx(-0.5 * 9.81)


# -- underwater --------------------------------------------------------------------------------------------------------------------


def test_remus_runs_at_its_published_speed_and_bank():
    """At full throttle 1.5 m/s, banked 5.3 degrees by the propeller (Prestero 2001)."""
    speed, bank = math.sqrt(3.6936 / 1.62), -math.asin(0.543 / (0.0196 * 30.479102956 * 9.81))
    assert speed == pytest.approx(1.51, abs=0.01)
    assert math.degrees(bank) == pytest.approx(-5.3, abs=0.05)
    neutral = UUV6DOF(buoyancy=30.479102956 * 9.81)
    steady = state(pos=(0.0, 0.0, -20.0), vel=(speed, 0.0, 0.0), roll=bank)
    assert rate_of(neutral, steady, 1.0, 0.0, 0.0)[3:] == pytest.approx(np.zeros(10), abs=1e-6)
    start = state(pos=(0.0, 0.0, -20.0), roll=bank)
    path = neutral.rollout(start, inputs(100, 1.0, 0.0, 0.0), dt=0.1)
    # u' = (T - 1.62 u^2) / (m + 0.93) until the hull, which is not stable by itself, turns
    rate = math.sqrt(3.6936 * 1.62) / (30.479102956 + 0.93)
    assert path[-1, 3] == pytest.approx(speed * math.tanh(rate * 10.0), rel=1e-3)


def test_remus_floats_and_its_fins_turn_it():
    floating = UUV6DOF().rollout(state(pos=(0.0, 0.0, -1.0)), inputs(3000, 0, 0, 0), dt=0.1)[-1]
    assert floating[2] == pytest.approx((0.5 - 30.479102956 * 9.81 / 306.0) * 0.191, abs=2e-3)
    moving = state(pos=(0.0, 0.0, -20.0), vel=(1.5, 0.0, 0.0))
    turned = rate_of(UUV6DOF(), moving, 0.0, 1.0, 1.0) - rate_of(UUV6DOF(), moving, 0.0, 0.0, 0.0)
    fin = 6.15 * 1.5**2 * 0.2373648 / (3.45 + 4.88)
    assert turned[11:] == pytest.approx(
        [fin, fin], rel=0.1
    )  # nose down, left; the coupling to the force changes it by less than 10 %


def test_added_mass_and_weight_balance_a_push():
    """A push of 10 N sideways accelerates the mass and the added mass; the center of gravity below lags and banks the hull."""
    neutral = UUV6DOF(buoyancy=30.479102956 * 9.81, c_g=(0.0, 0.0, 0.0))
    pushed = rate_of(neutral, state(pos=(0.0, 0.0, -20.0)), 0, 0, 0, loads=(0.0, 10.0, 10.0, 0.0, 0.0, 0.0))
    # the added mass couples side and yaw: (m + 35.5) v' - 1.93 r' = Y, -1.93 v' + (3.45 + 4.88) r' = 0
    side = 10.0 / (30.479102956 + 35.5 - 1.93**2 / (3.45 + 4.88))
    assert pushed[4:6] == pytest.approx([side, side], rel=1e-5)
    deep = rate_of(
        neutral.replace(c_g=(0.0, 0.0, 0.02)),
        state(pos=(0.0, 0.0, -20.0)),
        0,
        0,
        0,
        loads=(0.0, 10.0, 0.0, 0.0, 0.0, 0.0),
    )
    assert deep[10] < 0.0  # the hull moves left, the weight below stays behind: the left side goes down
