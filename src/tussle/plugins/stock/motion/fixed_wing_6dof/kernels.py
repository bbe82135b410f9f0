"""Air loads of an aircraft with linear derivatives, in the axes of flight mechanics: x forward, y right, z down."""

import math

from tussle.numeric import atan2
from tussle.numeric.kernel import device

MIN_SQUARE = 1e-9  # [m^2/s^2]: keeps the quotients of an aircraft at rest in the air finite
STALL = 0.45  # angle of attack [rad] that the lift approaches; at 0.1 rad it is 0.06 % below the linear one, at 0.2 rad 1 %
GROUND_FREQUENCY = 20.0  # natural frequency of the contact with the ground [rad/s], critically damped


@device
def clamp(value, low, high):
    """Value clamped to [low, high]."""
    return min(max(value, low), high)


@device
def attached(alpha):
    """Angle of attack [rad] that gives lift: alpha while it is small, at most STALL; the derivatives are those of attached flow."""
    ratio = alpha / STALL
    square = ratio * ratio
    return alpha / math.sqrt(math.sqrt(1.0 + square * square))


@device
def flow_of(air):
    """Speed in the plane of symmetry and speed [m/s], angle of attack and sideslip [rad] of a velocity relative to the air [m/s]."""
    u, v, w = air
    level = math.sqrt(u * u + w * w + MIN_SQUARE)
    return level, math.sqrt(level * level + v * v), atan2(w, u), atan2(v, level)


@device
def air_force(air, flow, omega, surfaces, alpha_rate, wing, drag, lift, side_force):
    """Aerodynamic force [N] (x, y, z): lift and drag in the plane of symmetry, side force along the y axis.

    Lift saturates at its value for an angle of attack of 26 degrees, see `attached`.
    C_D = C_D0 + C_D_alpha |alpha| + C_L^2 / (pi AR e) + C_D_delta_elevator |delta_e| with AR = b^2 / S; C_L and C_Y are linear in
    alpha, beta, the surfaces and the rates (Nelson 1998, chapter 3; Stevens and Lewis 2003, section 2.3).

    Args:
        air: Velocity relative to the air [m/s].
        flow: See `flow_of`.
        omega: Angular velocity [rad/s].
        surfaces: Elevator, aileron, rudder [rad].
        alpha_rate: Rate of the angle of attack [rad/s].
        wing: Air density [kg/m^3], span, area, chord, efficiency factor.
        drag: C_D0, and by alpha and elevator.
        lift: C_L0, and by alpha, pitch rate, rate of alpha, elevator.
        side_force: C_Y by beta and rudder.
    """
    density, span, area, chord, efficiency = wing
    u, _, w = air
    elevator, _, rudder = surfaces
    level, speed, alpha, beta = flow
    half = 0.5 * chord / speed
    c_lift = (
        lift[0]
        + lift[1] * attached(alpha)
        + lift[4] * elevator
        + half * (lift[2] * omega[1] + lift[3] * alpha_rate)
    )
    induced = c_lift * c_lift * area / (math.pi * span * span * efficiency)
    c_drag = drag[0] + drag[1] * abs(alpha) + drag[2] * abs(elevator) + induced
    c_side = side_force[0] * beta + side_force[1] * rudder
    push = 0.5 * density * speed * speed * area
    sine, cosine = w / level, u / level
    return push * (c_lift * sine - c_drag * cosine), push * c_side, -push * (c_lift * cosine + c_drag * sine)


@device
def air_moment(flow, omega, surfaces, alpha_rate, wing, roll_moment, pitch_moment, yaw_moment):
    """Aerodynamic moment [N m] (roll, pitch, yaw), linear in alpha, beta, surfaces and rates; arguments as in `air_force`.

    Args:
        flow: See `flow_of`.
        omega: Angular velocity.
        surfaces: Elevator, aileron, rudder.
        alpha_rate: Rate of the angle of attack.
        wing: Air density, span, area, chord, efficiency factor.
        roll_moment: C_l by beta, roll rate, yaw rate, aileron, rudder.
        pitch_moment: C_m0, and by alpha, pitch rate, rate of alpha, elevator.
        yaw_moment: C_n by beta, roll rate, yaw rate, aileron, rudder.
    """
    density, span, area, chord, _ = wing
    p, q, r = omega
    elevator, aileron, rudder = surfaces
    _, speed, alpha, beta = flow
    half_span, half_chord = 0.5 * span / speed, 0.5 * chord / speed
    roll = (
        roll_moment[0] * beta + half_span * (roll_moment[1] * p + roll_moment[2] * r)
        + roll_moment[3] * aileron + roll_moment[4] * rudder
    )  # fmt: skip
    pitch = (
        pitch_moment[0] + pitch_moment[1] * alpha + half_chord * (pitch_moment[2] * q + pitch_moment[3] * alpha_rate)
        + pitch_moment[4] * elevator
    )  # fmt: skip
    yaw = (
        yaw_moment[0] * beta + half_span * (yaw_moment[1] * p + yaw_moment[2] * r)
        + yaw_moment[3] * aileron + yaw_moment[4] * rudder
    )  # fmt: skip
    push = 0.5 * density * speed * speed * area
    return push * span * roll, push * chord * pitch, push * span * yaw


@device
def alpha_rate_of(air, omega, force, mass, wing, lift):
    """Rate of the angle of attack [rad/s], (u w' - w u') / V^2, solved for the lift that depends on it.

    With V^2 in place of u^2 + w^2 it is the same without sideslip, and finite in flight across the plane of symmetry.

    Args:
        air: Velocity relative to the air.
        omega: Angular velocity.
        force: All forces [N] except the part of the lift that is proportional to the rate, which acts opposite to w'.
        mass: Mass [kg].
        wing: As in `air_force`.
        lift: As in `air_force`.
    """
    density, _, area, chord, _ = wing
    u, v, w = air
    p, q, r = omega
    fx, _, fz = force
    u_rate, w_rate = fx / mass + v * r - w * q, fz / mass + u * q - v * p
    level = u * u + w * w
    square = level + v * v + MIN_SQUARE
    delay = 0.25 * density * area * chord * lift[3] * math.sqrt(level / square) / mass
    return (u * w_rate - w * u_rate) / (square * (1.0 + delay))


@device
def ground_push(height, rise, mass):
    """Force of the ground [N], upwards: a critically damped spring below height 0 [m] that does not pull; rise [m/s].

    Its deflection is at most 1 m, so that an aircraft that starts below the ground rises at 10 m/s.
    """
    push = -mass * GROUND_FREQUENCY * (GROUND_FREQUENCY * max(height, -1.0) + 2.0 * rise)
    return max(0.0, push) if height < 0.0 else 0.0
