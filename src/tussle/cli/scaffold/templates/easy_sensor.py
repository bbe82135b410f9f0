"""A sensor: measures after the motion of each step, in plain Python for one robot at a time."""

from tussle.api import EasySensor, Me, Output, Param


class New(EasySensor):
    """Measures the distance to the nearest other robot, with noise; `reach` if no robot is that near."""

    grade = "portable"

    reach = Param(300.0, unit="m", gt=0.0, doc="Largest measured distance.")
    noise = Param(2.0, unit="m", ge=0.0, doc="Standard deviation of the error.")
    clearance = Output(unit="m", doc="Measured distance; an autonomy reads it with Input(unit='m').")

    def step_one(self, me: Me) -> None:
        """Measure for one robot. `me` has its pos, neighbours, and the columns declared above."""
        other = me.nearest(radius=me.reach)
        measured = (me.reach if other is None else other.distance) + me.noise * me.normal()
        me.clearance = min(max(measured, 0.0), me.reach)
