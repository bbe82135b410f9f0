"""An autonomy that flies a recorded trajectory."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from tussle.api import Autonomy, GroupView, HistoricAttributes, Output, Param, Publish
from tussle.declare.messages import RemoveEntity
from tussle.errors import MissingFileError, ParameterError, listed
from tussle.numeric.quaternion import quat_to_yaw
from tussle.plugins import stock
from tussle.tables import check_columns, check_one_state, read_csv, whole_numbers


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


COLUMNS = ("id", "t", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz")


class TrajectoryTable(NamedTuple):
    """States of entities at times.

    Attributes:
        id: Ids, ascending, (m,).
        start: First state of each, then the number of states, (m + 1,).
        t: Time of each state [s], ascending for each entity, (k,).
        values: x y z [m], qw qx qy qz, vx vy vz [m/s], (10, k).
    """

    id: np.ndarray
    start: np.ndarray
    t: np.ndarray
    values: np.ndarray

    def at(self, ids: np.ndarray, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Find the states of entities at times [s], (n,) each.

        Returns:
            For each entity, the index of its last state not after the time, else of its first state; and the time of its last state.
        """
        place = np.searchsorted(self.id, ids)
        first, end = self.start[place], self.start[place + 1]
        low, high = first.copy(), end.copy()
        while (low < high).any():  # bisection, for all rows at once
            middle = np.minimum((low + high) // 2, end - 1)
            is_past = (low < high) & (self.t[middle] <= t)
            low, high = np.where(is_past, middle + 1, low), np.where(is_past | (low >= high), high, middle)
        return np.maximum(low - 1, first), self.t[end - 1]


def read_recorded(name: str) -> TrajectoryTable:
    """Read a table in CSV with the columns of a recorded run; of several worlds, the first one.

    Raises:
        ParameterError: The file cannot be read, has no such columns, or a value is no finite number.
    """
    path = Path(name)
    try:
        about = path.stat()
    except OSError as error:
        raise ParameterError(f"{name}: {error.strerror}; it takes a table of `tussle export --csv`") from None
    return _read(name, about.st_mtime_ns, about.st_size)


@lru_cache(maxsize=8)
def _read(name: str, _changed: int, _size: int) -> TrajectoryTable:
    table = read_csv(name, name, ParameterError)
    check_columns(name, table.column_names, COLUMNS, ParameterError)
    data: dict[str, Any] = {}
    for column in (*COLUMNS, *({"world"} & set(table.column_names))):
        try:
            data[column] = table[column].to_numpy().astype(float)
        except (TypeError, ValueError):
            raise ParameterError(f"{name}: column {column!r} has values that are no numbers") from None
        bad = np.flatnonzero(~np.isfinite(data[column]))
        if len(bad):
            raise ParameterError(f"{name}, line {bad[0] + 2}: {column} is not a finite number")
    order = np.lexsort((data["t"], data["id"]))
    if "world" in data:
        order = order[data["world"][order] == data["world"].min(initial=np.inf)]
    each, t = whole_numbers(name, "id", data["id"], ParameterError)[order], data["t"][order]
    values = np.stack([data[column][order] for column in COLUMNS[2:]])
    check_one_state(name, each, t, values, ParameterError)
    ids, start = np.unique(each, return_index=True)
    return TrajectoryTable(ids, np.append(start, len(order)), t, values)
