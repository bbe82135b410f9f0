"""SimpleCar's law: an exact circular arc, and a free fall."""

import math

from tussle.numeric import sincos, tan
from tussle.numeric.kernel import device
from tussle.numeric.paths import GRAVITY, arc, clamp

STEERING_MAX = 0.25 * math.pi - 1e-4
"""Largest steering angle of SCRIMMAGE [rad]."""


@device
def driven(x, y, z, z_rate, yaw, speed, steering, length, max_velocity, enable_gravity, force_z, mass, dt):
    """Law of the car: state and body after dt; names, units and frames are the plugin's."""
    v = clamp(speed, 0.0, max_velocity)
    rate = v * tan(clamp(steering, -STEERING_MAX, STEERING_MAX)) / length
    east, north = arc(yaw, rate * dt)
    begin = z_rate if enable_gravity else 0.0
    end = begin + (force_z / mass - GRAVITY) * dt if enable_gravity else 0.0
    pos = x + v * dt * east, y + v * dt * north, z + 0.5 * dt * (begin + end)
    yaw_1 = yaw + rate * dt
    sine, cosine = sincos(yaw_1)
    return (*pos, end, yaw_1, v, rate), pos, (v * cosine, v * sine, end), yaw_1
