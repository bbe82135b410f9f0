"""Module that plugin files import as `scrimmage` and `scrimmage.bindings`: the types of SCRIMMAGE's Python interface."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np

from tussle.numeric.quaternion import (
    quat_from_euler,
    quat_rotate,
    quat_rotate_inverse,
    quat_to_pitch,
    quat_to_roll,
    quat_to_yaw,
)

bindings = sys.modules[__name__]
"""This module, for `import scrimmage.bindings`."""


class ScrimmageQuaternion:
    """Unit quaternion from the body to the world frame.

    Args:
        parts: w, x, y, z; or roll, pitch (positive nose down) and yaw [rad]; or an axis, (3,), and an angle [rad]; or nothing.

    Raises:
        TypeError: There are other arguments.
    """

    def __init__(self, *parts: Any) -> None:
        if len(parts) == 4:
            self.array = np.array(parts, dtype=float)
        else:
            self.set(*parts or (0.0, 0.0, 0.0))

    def set(self, *parts: Any) -> None:
        """Take roll, pitch and yaw [rad]; or an axis and an angle [rad]."""
        if len(parts) == 2:
            axis, half = np.asarray(parts[0], dtype=float), 0.5 * float(parts[1])
            self.array = np.array([math.cos(half), *math.sin(half) * axis / np.linalg.norm(axis)])
        elif len(parts) == 3:
            self.array = quat_from_euler(*map(float, parts))
        else:
            raise TypeError(
                f"Quaternion takes w, x, y, z, or roll, pitch, yaw, or an axis and an angle, not {len(parts)} values"
            )

    w = property(lambda self: float(self.array[0]))
    x = property(lambda self: float(self.array[1]))
    y = property(lambda self: float(self.array[2]))
    z = property(lambda self: float(self.array[3]))

    def roll(self) -> float:
        """Roll, right wing down positive [rad]."""
        return float(quat_to_roll(self.array))

    def pitch(self) -> float:
        """Pitch, nose down positive [rad]."""
        return float(quat_to_pitch(self.array))

    def yaw(self) -> float:
        """Yaw, counter-clockwise from East [rad]."""
        return float(quat_to_yaw(self.array))

    def rotation_angle(self) -> float:
        """Angle of the rotation [rad]."""
        return 2.0 * math.atan2(float(np.linalg.norm(self.array[1:])), self.w)

    def rotate(self, vector: Any) -> np.ndarray:
        """A body vector in the world frame, (3,)."""
        return np.asarray(quat_rotate(self.array, vector))

    def rotate_reverse(self, vector: Any) -> np.ndarray:
        """A world vector in the body frame, (3,)."""
        return np.asarray(quat_rotate_inverse(self.array, vector))


class ScrimmageState:
    """Position [m], velocity [m/s], angular velocity [rad/s], (3,) each, and attitude.

    `pos`, `vel`, `ang_vel` and `quat` can also be called by names such as `pos_mutable()` and `pos_const()`.
    """

    def __init__(
        self,
        position: Any = (0.0, 0.0, 0.0),
        velocity: Any = (0.0, 0.0, 0.0),
        angular_velocity: Any = (0.0, 0.0, 0.0),
        orientation: ScrimmageQuaternion | None = None,
    ) -> None:
        if isinstance(angular_velocity, ScrimmageQuaternion):  # older classes give three arguments
            angular_velocity, orientation = (0.0, 0.0, 0.0), angular_velocity
        self.pos, self.vel, self.ang_vel = (
            np.array(v, dtype=float) for v in (position, velocity, angular_velocity)
        )
        self.quat = ScrimmageQuaternion() if orientation is None else orientation

    def __getattr__(self, name: str) -> Any:
        head, _, access = name.rpartition("_")
        if access in ("mutable", "const") and head in ("pos", "vel", "ang_vel", "quat"):
            return lambda: getattr(self, head)
        raise AttributeError(
            f"State has no {name!r}; there are: pos, vel, ang_vel, quat, each with _mutable() and _const()"
        )

    def rel_pos_local_frame(self, position: Any) -> np.ndarray:
        """A position relative to this one, body frame [m], (3,)."""
        return self.quat.rotate_reverse(np.asarray(position, dtype=float) - self.pos)

    def orient_global_frame(self) -> np.ndarray:
        """The nose, world frame, (3,)."""
        return self.quat.rotate((1.0, 0.0, 0.0))

    def in_field_of_view(self, other: Any, width: float, height: float) -> bool:
        """Return True if a state or position is within a field of view, of a width and a height [rad]."""
        x, y, z = self.rel_pos_local_frame(getattr(other, "pos", other))
        return abs(math.atan2(y, x)) < 0.5 * width and abs(math.atan2(z, math.hypot(x, y))) < 0.5 * height


class ScrimmageID:
    """Ids of an entity, its subswarm and its team."""

    def __init__(self, id: int = 0, sub_swarm_id: int = 0, team_id: int = 0) -> None:  # noqa: A002 - SCRIMMAGE's name
        self.id, self.sub_swarm_id, self.team_id = id, sub_swarm_id, team_id


class ScrimmageContact:
    """State of another entity."""

    AIRCRAFT, QUADROTOR, SPHERE, MESH, UNKNOWN = range(5)
    ContactType: Any

    def __init__(self) -> None:
        self.id, self.state, self.type, self.radius, self.active = (
            ScrimmageID(),
            ScrimmageState(),
            ScrimmageContact.UNKNOWN,
            1.0,
            True,
        )


ScrimmageContact.ContactType = ScrimmageContact


class ScrimmageAutonomy:
    """Optional base class of Python autonomies."""


# Names in SCRIMMAGE.
Quaternion = ScrimmageQuaternion
State = ScrimmageState
ID = ScrimmageID
Contact = ScrimmageContact
Autonomy = ScrimmageAutonomy
