"""Quantities over time of a recorded run, for the page."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from tussle.api.bodies import derived_from
from tussle.view.left import numbers_left
from tussle.view.recording import QUAT, VEL, Recording
from tussle.view.series import Changes, CurveName

COLUMNS = {
    "x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s", "speed": "m/s", "yaw": "rad", "climb": "rad", "roll": "rad",
    "health": "",
}  # fmt: skip
"""Columns of a recorded entity, and their units."""
MAX_POINTS = 20_000
"""Frames of a recording from which a column is read; of more, every other one, every third, …"""


def run_changes(run: Recording, team_shift: int = 0, id_shift: int = 0) -> list[Changes]:
    """Return the entities left in each team, from frames and events; those born and the captures made, from events; results; robustness.

    Args:
        run: The run.
        team_shift: What is added to the numbers of the teams.
        id_shift: The id of the run's world.
    """
    team_of = {
        event.id: run.block_teams[run.blocks.index(event.text)]
        for event in run.events
        if event.kind == "birth" and event.text in run.blocks
    }
    born, died = (
        {
            team: [e.t for e in run.events if e.kind == kind and team_of.get(e.id) == team]
            for team in run.teams
        }
        for kind in ("birth", "death")
    )
    changes = [*_left(run, born, died)]
    changes += [_counted(CurveName("born", team), float(run.t[0]), t) for team, t in born.items()]
    by_team = {
        team: [e.t for e in run.events if e.kind == "capture" and team_of.get(e.id) == team]
        for team in run.teams
    }
    if any(by_team.values()):
        changes += [_counted(CurveName("captures", team), float(run.t[0]), t) for team, t in by_team.items()]
    changes += [Changes(CurveName(name, team), 0, *found) for (name, team), found in run.results.items()]
    for quantity, series in run.alarms.series.items() if run.alarms else ():
        changes.append(Changes(quantity, 0, list(map(run.time_of, series.steps)), series.values))
    return [_shifted(each, team_shift, id_shift) for each in changes]


def _shifted(changes: Changes, team_shift: int, id_shift: int) -> Changes:
    q = changes.quantity
    q = q._replace(id=id_shift) if q.team is None else q._replace(team=q.team + team_shift)
    return Changes(q, 0, changes.t, changes.values)


def _left(
    run: Recording, born: Mapping[int, list[float]], died: Mapping[int, list[float]]
) -> Iterable[Changes]:
    """Entities of each team: in the frames in which their number may have changed, and after births and deaths [s] between them."""
    is_changed = np.diff(run.counts, prepend=-1) != 0
    times = [e.t for e in run.events if e.kind in ("birth", "death")]
    for side in ("left", "right"):
        places = np.searchsorted(run.t, times, side=side)
        is_changed[places[places < run.n_frames]] = True
    frames = np.flatnonzero(is_changed)
    counts = np.array([[(run.team_column(int(i)) == team).sum() for team in run.teams] for i in frames])
    for team, seen in zip(run.teams, counts.T, strict=True):
        t, n = numbers_left(run, run.t[frames], seen, born[team], died[team])
        is_new = np.diff(n, prepend=-1) != 0
        yield Changes(CurveName("left", team), 0, t[is_new].tolist(), n[is_new].tolist())


def _counted(quantity: CurveName, start: float, times: list[float]) -> Changes:
    """Number of events up to each time."""
    t, n = np.unique(np.array(times, float), return_counts=True)
    values = np.cumsum(n)
    if not len(t) or t[0] > start:
        t, values = np.append(start, t), np.append(0, values)
    return Changes(quantity, 0, t.tolist(), values.tolist())


def quantities_of(run: Recording) -> dict[str, str]:
    """Return the columns of a run's entities, also recorded ones of plugins, and their units."""
    of_plugins = (zip(column.parts, column.units, strict=True) for column in run.columns.values())
    return COLUMNS | {part: unit for pairs in of_plugins for part, unit in pairs}


def column_changes(run: Recording, who: int, name: str, id_shift: int = 0) -> Changes:
    """Return a column of an entity over the frames; NaN in those without it.

    Args:
        run: The run.
        who: The entity.
        name: One of `quantities_of` the run.
        id_shift: What is added to its id.
    """
    frames = np.arange(0, run.n_frames, -(-run.n_frames // MAX_POINTS))
    rows = np.array([run.row_of(i, who) for i in frames.tolist()])
    values = _values(run, rows, name)
    is_new = np.append(True, ~((values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))))
    quantity = CurveName(name, None, who + id_shift)
    return Changes(quantity, 0, run.t[frames[is_new]].tolist(), values[is_new].tolist())


def _values(run: Recording, rows: np.ndarray, name: str) -> np.ndarray:
    """A column in some rows, (n,); NaN in those below 0."""
    if name == "speed":
        return np.asarray(np.sqrt(sum(run.values_at(rows, axis) ** 2 for axis in VEL)))
    if name in ("yaw", "climb", "roll"):
        quat = np.stack([run.values_at(rows, axis) for axis in QUAT])
        return np.where(rows < 0, np.nan, derived_from(name, quat))
    return run.values_at(rows, name)
