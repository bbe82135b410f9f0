"""Recorded trajectories of SCRIMMAGE: where they are, and their columns."""

from __future__ import annotations

import csv
import gzip
import os
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from tussle.mission import Mission, read_mission
from tussle.record import FirstStates, read_table

VARIABLE = "TUSSLE_RECORDINGS"
COLUMNS = ("frame", "id", "team", "x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz")


@cache
def folder() -> Path | None:
    """The folder that holds `truth` and `missions`: named by the environment, else one beside the repository; None if there is none."""
    named = os.environ.get(VARIABLE)
    if named:
        return Path(named)
    beside = sorted(Path(__file__).resolve().parents[3].iterdir())
    return next((p for p in beside if (p / "truth").is_dir() and (p / "missions").is_dir()), None)


@dataclass(frozen=True)
class Recording:
    """A run of SCRIMMAGE.

    Frame k is the state before step k, at time k dt; some frames are left out. The last frame is the state after the last step.

    Attributes:
        frame: Number of the frame of each row, (m,).
        id: Entity of each row, (m,).
        team: Its team, (m,).
        pos: Position [m], (3, m).
        quat: Quaternion body to world, (4, m).
        vel: Velocity [m/s], (3, m).
        last_frame: Entity -> last frame in which it was there, from the full run.
        summary: Team -> column -> number, as the run's own metrics counted.
        first_states: Ids, times of birth and first states, as a simulation starts from them.
    """

    frame: np.ndarray
    id: np.ndarray
    team: np.ndarray
    pos: np.ndarray
    quat: np.ndarray
    vel: np.ndarray
    last_frame: dict[int, int]
    summary: dict[int, dict[str, float]]
    first_states: FirstStates

    @property
    def frames(self) -> np.ndarray:
        """The frames that were kept, ascending."""
        return np.unique(self.frame)

    def rows(self, frame: int) -> np.ndarray:
        """Rows of a frame, by id."""
        rows = np.flatnonzero(self.frame == frame)
        return rows[np.argsort(self.id[rows])]


@cache
def load(name: str) -> Recording:
    """The recording of a mission."""
    place = folder()
    assert place is not None
    path = place / "truth" / f"{name}.csv.gz"
    with gzip.open(path, "rt") as file:
        reader = csv.reader(file)
        header = next(reader)
        keep = [header.index(c) for c in COLUMNS]
        table = np.array([[float(row[i]) for i in keep] for row in reader]).T
    frame, ids, team = table[:3].astype(np.int64)
    with (place / "truth" / f"{name}.entities.csv").open() as file:
        last = {int(row["id"]): int(row["last_frame"]) for row in csv.DictReader(file)}
    with (place / "truth" / f"{name}.summary.csv").open() as file:
        summary = {
            int(row["team_id"]): {k: float(v) for k, v in row.items() if v} for row in csv.DictReader(file)
        }
    return Recording(frame, ids, team, table[3:6], table[6:10], table[10:13], last, summary, read_table(path))


NAMES = (
    "straight",
    "straight-no-gui",
    "unicycle",
    "harmonic-oscillator",
    "waypoint_follower",
    "batch-example-mission",
    "uuv-ex1",
    "cars",
)
"""Missions whose plugins all exist here."""


@cache
def mission(name: str) -> Mission:
    """The mission of a recording, from SCRIMMAGE's own file."""
    place = folder()
    assert place is not None
    return read_mission(place / "missions" / f"{name}.xml", strict=False).mission
