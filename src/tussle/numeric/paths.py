"""Closed forms of paths that motion models share."""

import math

from tussle.numeric.elementary import sincos, wrap
from tussle.numeric.kernel import device

GRAVITY = 9.81
"""Standard gravity of SCRIMMAGE [m/s^2]."""
STEEPEST_BANK = math.radians(89.0)
"""Largest bank of a coordinated turn [rad], a load of 57 g; at 90 degrees no lift is left to carry the weight."""

SLOWEST = 1e-3
"""Smallest speed of a coordinated turn [m/s]; below it the heading is constant, because the turn rate would grow without bound."""


@device
def clamp(value, low, high):
    """Value clamped to [low, high]."""
    return min(max(value, low), high)


@device
def arc(yaw, turn):
    """Mean direction (east, north) over a circular arc that begins at heading yaw [rad] and turns left by turn [rad]."""
    half = 0.5 * turn
    sine, _ = sincos(half)
    chord = 1.0 if half == 0.0 else sine / (1.0 if half == 0.0 else half)
    north, east = sincos(yaw + half)
    return chord * east, chord * north


@device
def coordinated_turn(x, y, z, yaw, speed, climb, roll, dt):
    """State and body of an aeroplane after dt [s] of a steady coordinated turn at constant elevation; an exact helix.

    It flies along its nose, and yaw' = -(g / V) tan(roll) (Owen, Beard, McLain 2015, "Implementing Dubins airplane paths on
    fixed-wing UAVs", equation 5; there heading and roll are clockwise). Below SLOWEST the heading is constant.

    Args:
        x: Position [m], world frame, with y and z.
        yaw: Heading [rad].
        speed: Speed V along the nose [m/s].
        climb: Elevation [rad], nose up.
        roll: Bank [rad], right wing down; beyond STEEPEST_BANK it turns like that.
        dt: Duration [s].

    Returns:
        State (x, y, z, yaw, climb, roll, speed, yaw rate), position, velocity [m/s], heading in (-pi, pi], elevation, bank.
    """
    sine, cosine = sincos(clamp(roll, -STEEPEST_BANK, STEEPEST_BANK))
    rests = abs(speed) < SLOWEST
    rate = 0.0 if rests else -GRAVITY * sine / (cosine * (1.0 if rests else speed))
    rise, level = sincos(climb)
    east, north = arc(yaw, rate * dt)
    way = speed * dt
    pos = x + way * level * east, y + way * level * north, z + way * rise
    yaw_1 = wrap(yaw + rate * dt)
    sine, cosine = sincos(yaw_1)
    vel = speed * level * cosine, speed * level * sine, speed * rise
    return (*pos, yaw_1, climb, roll, speed, rate), pos, vel, yaw_1, climb, roll


@device
def shortened(x, y, z, limit):
    """The vector, scaled down to length `limit` if it is longer."""
    length = math.sqrt(x * x + y * y + z * z)
    scale = 1.0 if length <= limit else limit / length
    return scale * x, scale * y, scale * z
