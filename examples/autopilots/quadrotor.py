"""A controller that hovers the default Multirotor of tussle: altitude, place and heading are held by PD laws.

All vectors are in the frames of autopilots: North-East-Down, forward-right-down.
"""

from __future__ import annotations

import math

MASS, GRAVITY = 1.5, 9.81  # [kg], [m/s^2]
THRUST, TORQUE = 5.45e-6, 2.284e-7  # of a rotor over the square of its speed [kg m], [kg m^2]
ARM = 0.175  # [m]
INERTIA = (0.0122, 0.0122, 0.0244)  # [kg m^2]
SLOWEST, FASTEST = 346.41, 1200.0  # [rad/s]


def clamp(value, most):
    """A value within +-most."""
    return max(-most, min(most, value))


def hover(offset, velocity, euler, rate, heading):
    """Speeds of the rotors at the right, left, front and back [rad/s].

    Args:
        offset: North, east, down from the place to hover at [m].
        velocity: North, east, down [m/s].
        euler: Roll, pitch, yaw [rad].
        rate: About forward, right, down [rad/s].
        heading: Yaw to hold [rad].
    """
    wanted = [
        clamp(-0.6 * x - 1.4 * v, most) for x, v, most in zip(offset, velocity, (2.0, 2.0, 4.0), strict=True)
    ]
    roll, pitch, yaw = euler
    forward = math.cos(yaw) * wanted[0] + math.sin(yaw) * wanted[1]
    right = math.cos(yaw) * wanted[1] - math.sin(yaw) * wanted[0]
    attitude = right / GRAVITY, -forward / GRAVITY, heading
    gains = (40.0, 12.0), (40.0, 12.0), (4.0, 4.0)
    torque = [
        inertia * (kp * math.remainder(goal - angle, 2.0 * math.pi) - kd * omega)
        for inertia, (kp, kd), goal, angle, omega in zip(INERTIA, gains, attitude, euler, rate, strict=True)
    ]
    lift = MASS * (GRAVITY - wanted[2]) / max(math.cos(roll) * math.cos(pitch), 0.5) / 4.0
    x, y, z = torque[0] / (2.0 * ARM), torque[1] / (2.0 * ARM), torque[2] * THRUST / (4.0 * TORQUE)
    forces = lift - x + z, lift + x + z, lift + y - z, lift - y - z
    return [max(SLOWEST, min(FASTEST, math.sqrt(max(force, 0.0) / THRUST))) for force in forces]
