"""An autonomy that flies a recorded trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from tussle.api import Autonomy, GroupView, HistoricAttributes, Output, Param, Publish
from tussle.declare.messages import RemoveEntity
from tussle.errors import MissingFileError, ParameterError, listed
from tussle.numeric.quaternion import quat_to_yaw
from tussle.plugins import stock
from tussle.plugins.stock.autonomy.trajectory_record_playback.table import read_recorded


class TrajectoryRecordPlayback(Autonomy):
    """Plays a recorded trajectory: the desired state is the one that the recorded entity had at the end of the step.

    The file is a table in CSV with the columns of a recorded run, as `tussle export --csv` writes it. Before the first recorded time the
    desired state is the first one. After the last recorded time the entity is removed, or the last state stays the desired one. Without
    `enable_playback` the plugin does nothing, since every run can be recorded; SCRIMMAGE's plugin then records the file.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(
        unread=("initial_speed",),
        differs={
            "enable_playback": "TrajectoryRecordPlayback without enable_playback does nothing; the run directory has all trajectories"
        },
    )

    enable_playback = Param(False, structural=True, doc="Play the file.")
    trajectory_filename = Param("trajectory.txt", doc="The file, below the current directory.")
    trajectory_id = Param(0, ge=0, doc="Id of the recorded entity; 0 for that of the entity itself.")
    remove_at_end = Param(True, doc="Remove the entity after the last recorded time.")
    removal = Publish(RemoveEntity)
    desired_heading = Output(unit="rad")
    desired_altitude = Output(unit="m")
    desired_speed = Output(unit="m/s")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")

    @classmethod
    def with_files(cls, given: Mapping[str, str], find: Callable[[str], Path]) -> dict[str, str]:
        """Return nothing: the file is below the current directory, where it must be if it is played."""
        playing, name = (
            str(given.get(k, cls.params()[k].default)) for k in ("enable_playback", "trajectory_filename")
        )
        if cls.params()["enable_playback"].convert(playing) and not Path(name).is_file():
            raise MissingFileError(
                f"trajectory_filename = {name!r}: there is no such file below the current directory"
            )
        return {}

    def check_values(self) -> None:
        """Check that the file is below the current directory or ships, since a mission may come from others."""
        path = Path(self.trajectory_filename)
        if (
            path.is_absolute() and not path.is_relative_to(Path(stock.__file__).parent)
        ) or ".." in path.parts:
            raise ParameterError(
                f"TrajectoryRecordPlayback.trajectory_filename = {self.trajectory_filename!r} is not allowed; it takes the name of a file "
                "below the current directory"
            )

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Read the file, so that its errors show before the first step."""
        if self.enable_playback:
            read_recorded(self.trajectory_filename)

    def step(self, g: GroupView) -> None:
        if not self.enable_playback:
            return
        recorded = read_recorded(self.trajectory_filename)
        ids = np.where(self.trajectory_id > 0, self.trajectory_id, g.id)
        absent = np.setdiff1d(ids, recorded.id)
        if len(absent):
            raise ParameterError(
                f"{self.trajectory_filename} has no entity {absent[0]}; {listed(map(str, recorded.id))}"
            )
        now = g.t + (1.0 + 1e-6) * g.dt
        number, last = recorded.at(ids, now)
        values = recorded.values[:, number]
        vx, vy, vz = values[7:]
        self.velocity[:] = values[7:]
        self.desired_speed[:] = np.sqrt(vx * vx + vy * vy + vz * vz)
        self.desired_altitude[:] = values[2]
        self.desired_heading[:] = quat_to_yaw(values[3:7])
        is_over = np.flatnonzero(self.remove_at_end & (last < now - 2e-6 * g.dt))
        self.removal.publish(
            is_over, entity=g.id[is_over], why=["end of the recorded trajectory"] * len(is_over)
        )
