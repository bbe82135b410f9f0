"""A class of SCRIMMAGE's Python interface: an example."""

from __future__ import annotations

from tussle.plugins.stock.autonomy.py_autonomy.bindings import Quaternion, State


class StraightClass:
    """Holds the initial heading and altitude, at the speed of its parameter `speed` [m/s]."""

    state: State

    def init(self, params: dict[str, str]) -> None:
        """Take the parameters."""
        self.desired_state = State(
            position=self.state.pos,
            velocity=(float(params.get("speed", "21")), 0.0, 0.0),
            orientation=Quaternion(0.0, 0.0, self.state.quat.yaw()),
        )

    def step_autonomy(self, t: float, dt: float) -> bool:
        """Keep the desired state."""
        return True
