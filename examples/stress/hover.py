"""A drone that holds its place in gusts."""

from tussle.api import Autonomy, GroupView, Output, Param


class Hover(Autonomy):
    """Flies back to its place, while gusts push it about."""

    grade = "portable"
    place = Param((0.0, 0.0, 0.0), fields="x y z", unit="m", doc="Where it hovers.")
    gain = Param(0.5, unit="1/s", ge=0.0, doc="Speed per distance from the place.")
    gust = Param(3.0, unit="m/s", ge=0.0, doc="Standard deviation of the wind's speed, drawn in each step.")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    def step(self, g: GroupView) -> None:
        self.velocity[:] = self.gain * (self.place - g.pos) + self.gust * g.normal("gust", 3)
