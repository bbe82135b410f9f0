"""The existing system's laws where tussle's differ: each variant says which lines differ, and why tussle's are otherwise.

Nothing outside these tests uses them. Everything else that flies here is the product's own plugin. tussle differs from the existing
system in more (see docs/parity.md), but these missions do not show it: they have one substep per step, no error that jumps at the
first call of a PID that is not at its limit, no noise, and no three aircraft within the collision range in one step.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import unicycle_rk4

from tussle import Mission
from tussle.api import MotionBody, State
from tussle.numeric.quaternion import quat_conjugate
from tussle.stock import BoundaryDefense, SimpleAircraft, TakeFlag, Unicycle3D

Integrator = Callable[[np.ndarray, np.ndarray, np.ndarray, float, int], None]
Floats = np.ndarray


def rk4_step(f: Callable[[Floats], Floats], x: Floats, h: float) -> Floats:
    """One classical Runge-Kutta step of all columns, the sums in the existing system's order."""
    k1 = f(x)
    k2 = f(x + 0.5 * h * k1)
    k3 = f(x + 0.5 * h * k2)
    k4 = f(x + h * k3)
    return x + h / 6.0 * k1 + h / 3.0 * k2 + h / 3.0 * k3 + h / 6.0 * k4


class ClampingAircraft(SimpleAircraft):
    """Roll, pitch and speed are put within their limits before a step, and leave them in it by up to a step's worth.

    In tussle a rate that would go beyond a limit is lowered so that it ends there: what is published and flown keeps the limits, and
    the last step before a limit is not thrown away. Differing lines: the three clips, and RK4 over rates that ignore the limits.
    """

    @property
    def advance(self) -> Integrator:
        def advance(x: Floats, u: Floats, p: Floats, dt: float, substeps: int) -> None:
            (
                radius,
                speed_min,
                speed_max,
                roll_max,
                pitch_max,
                roll_rate_max,
                pitch_rate_max,
                target,
                slope,
            ) = p
            throttle, roll_rate, pitch_rate = u

            def f(s: Floats) -> Floats:
                roll, pitch, yaw, speed = s[3:]
                return np.array(
                    [
                        speed * np.cos(pitch) * np.cos(yaw),
                        speed * np.cos(pitch) * np.sin(yaw),
                        speed * np.sin(pitch),
                        np.clip(roll_rate, -roll_rate_max, roll_rate_max),
                        np.clip(pitch_rate, -pitch_rate_max, pitch_rate_max),
                        speed / (radius + slope * (speed - target)) * np.tan(roll),
                        np.clip(throttle, -100.0, 100.0) / 5.0,
                    ]
                )

            for _ in range(substeps):
                x[3] = np.clip(x[3], -roll_max, roll_max)
                x[4] = np.clip(x[4], -pitch_max, pitch_max)
                x[6] = np.clip(x[6], speed_min, speed_max)
                x[:] = rk4_step(f, x, dt / substeps)

        return advance


class RelativeUnicycle3D(Unicycle3D):
    """The attitude is integrated as the turn since the start, by RK4 with a pull towards length 1.

    So the rates act about axes that move with the vehicle but were the world's at the start, the body's own only where it started
    with (1, 0, 0, 0); tussle takes the body's own always. And attitude and path carry RK4's errors, 2e-5 m where a turn at full
    rate ends at 25 m/s; tussle's attitude is exact for held rates. Differing: the kernel, and the start attitude kept for it.
    """

    x = State(
        "x y z qw qx qy qz v iw ix iy iz",
        unit="m m m 1 1 1 1 m/s 1 1 1 1",
        doc="As the product's, and the inverse of the start attitude.",
    )

    advance = unicycle_rk4.advance

    def from_body(self, body: MotionBody, rows: Floats) -> None:
        super().from_body(body, rows)
        self.x[8:12, rows] = quat_conjugate(self.x[3:7, rows])


class LateTakeFlag(TakeFlag):
    """Stands still in the first step: its regions become known by messages that are delivered at the end of that step.

    tussle's entities know the regions of the mission at once, also those that are born later, which never heard of them there.
    """

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0


class LateBoundaryDefense(BoundaryDefense):
    """Stands still in the first step, as LateTakeFlag."""

    def step(self, g: Any) -> None:
        super().step(g)
        self.velocity[:, g.step_count == 0] = 0.0


VARIANTS: dict[type, type] = {
    SimpleAircraft: ClampingAircraft,
    Unicycle3D: RelativeUnicycle3D,
    TakeFlag: LateTakeFlag,
    BoundaryDefense: LateBoundaryDefense,
}


def historic(mission: Mission, variants: dict[type, type] = VARIANTS) -> Mission:
    """The mission with each motion model and autonomy that has a variant replaced by it."""

    def swap(plugin: Any) -> Any:
        cls = variants.get(type(plugin))
        return cls(name=plugin.instance_name, **plugin.values) if cls else plugin

    return mission.replace(
        blocks=[
            dataclasses.replace(b, motion=swap(b.motion), autonomy=tuple(map(swap, b.autonomy)))
            for b in mission.blocks
        ]
    )
