"""A column over time: of the entities of one run, or as means of several runs."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import rule_y
from tussle.errors import ParameterError, ViewError, listed, nearest_name
from tussle.folders import real_path
from tussle.palette import INK
from tussle.palette import TEAM_COLOURS as COLOURS
from tussle.record.schema import FLOAT_COLUMNS
from tussle.view.plots.curves import MAX_TIMES, band_signs, draw_bands, over_time
from tussle.view.plots.selection import Selection, Trajectories
from tussle.view.plots.sheet import DASHES, Handle, add_head, line_look, line_sign, sheet, time_axis
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

UNITS = {"x": "m", "y": "m", "z": "m", "vx": "m/s", "vy": "m/s", "vz": "m/s"}
"""Units of the columns that every run has; the others have none."""


def parts_of(recording: Recording, name: str) -> dict[str, str]:
    """Table columns of a quantity, with their labels: the components of a column of plugins, or one column of the table.

    Raises:
        ParameterError: There is no such column.
    """
    known = {**{each: [each] for each in FLOAT_COLUMNS}}
    units = dict(UNITS)
    for column in recording.columns.values():
        known[column.name] = column.parts
        known |= {part: [part] for part in column.parts}
        units |= dict(zip(column.parts, column.units, strict=True))
    if name not in known:
        text = f"{recording.path}: there is no column {name!r}{nearest_name(name, known)}; {listed(known)}"
        more = "" if recording.columns else "; tussle run --record-columns records those of plugins"
        raise ParameterError(text + more)
    return {part: f"{part} [{units[part]}]" if units.get(part) else part for part in known[name]}


def column(recording: Recording, name: str, selection: Selection | None = None) -> Figure:
    """A column over time: a line for each entity, a band of quantiles for a team of many; components one below the other.

    Args:
        recording: The recorded run.
        name: A column of plugins, such as "Boids.goal", one of its components, "Boids.goal.x", or one of those that every run has: x, y, z,
            vx, vy, vz, qw, qx, qy, qz, health.
        selection: Entities and times; by default all of the teams that have the column.

    Raises:
        ParameterError: There is no such column, or the selected entities do not have it.
    """
    labels = parts_of(recording, name)
    tracks = _with_values(recording, name, labels, selection or Selection())
    return over_time(tracks, {label: tracks.column(part) for part, label in labels.items()}, name)


def _with_values(recording: Recording, name: str, parts: Any, selection: Selection) -> Trajectories:
    """The selected trajectories, of the teams that have values.

    Raises:
        ParameterError: There are no values.
    """
    tracks = Trajectories(recording, selection)
    is_known = np.isfinite([tracks.column(part) for part in parts]).any(axis=0)
    teams = np.unique(np.repeat(tracks.team, np.diff(tracks.first))[is_known]).tolist()
    if not teams:
        raise ParameterError(f"{recording.path}: the selected entities have no values of {name!r}")
    return (
        tracks
        if len(teams) == len(tracks.teams)
        else Trajectories(recording, replace(selection, teams=tuple(teams)))
    )


def runs_of(path: Path) -> list[Path]:
    """The recorded runs of a batch directory; of another directory itself.

    Raises:
        ViewError: No run of the batch is recorded.
    """
    if not (path / "batch.json").exists():
        return [path]
    found = sorted(each.parent for each in path.glob("runs/*/trajectory.arrow"))
    if not found:
        raise ViewError(
            f"{path}: no run of the batch is recorded; tussle batch --record-runs 0:9 records the first ten"
        )
    return found


def column_of_runs(recordings: Sequence[Recording], name: str, selection: Selection | None = None) -> Figure:
    """The mean of a column over the selected entities of each run and team, over time.

    Few runs have a line each, in a colour of its own; of many there are the median and the middle half and nine tenths of the runs.

    Args:
        recordings: The runs.
        name: As for `column`.
        selection: Entities and times, of each run.

    Raises:
        ParameterError: As of `column`.
    """
    labels = parts_of(recordings[0], name)
    games = [_with_values(recording, name, labels, selection or Selection()) for recording in recordings]
    teams = {team: text for tracks in games for team, text in tracks.teams.items()}
    t = np.linspace(min(g.frame_times[0] for g in games), max(g.frame_times[-1] for g in games), MAX_TIMES)
    figure = sheet(2.5 * len(labels))
    signs: list[Handle] = []
    for axes, (part, label) in zip(
        np.atleast_1d(figure.subplots(len(labels), sharex=True)), labels.items(), strict=True
    ):
        means = {
            team: np.array([_mean_at(tracks, part, team, t) for tracks in games]) for team in sorted(teams)
        }
        signs = list(
            _run_lines(axes, t, means, teams, games)
            if len(games) <= len(COLOURS)
            else _run_bands(axes, games[0], t, means, teams)
        )
        axes.set_ylabel(label)
        axes.margins(y=0.08)
        rule_y(axes)
        time_axis(axes, t)
    add_head(figure, games[0], f"{name}, means of {len(games)} runs", signs, has_seed=False)
    return figure


def _mean_at(tracks: Trajectories, part: str, team: int, t: np.ndarray) -> np.ndarray:
    """Mean of a table column over the entities of a team at some times, (T,): that of the last frame not after each; NaN without one."""
    values = tracks.column(part)
    mine = np.isfinite(values) & np.repeat(tracks.team == team, np.diff(tracks.first))
    n = np.bincount(tracks.frame[mine], minlength=len(tracks.frame_times))
    with np.errstate(invalid="ignore"):
        means = np.bincount(tracks.frame[mine], values[mine], len(tracks.frame_times)) / n
    slack = 1e-6 * tracks.recording.dt
    frame = np.searchsorted(tracks.frame_times, t + slack, side="right") - 1
    return np.where((frame >= 0) & (t <= tracks.frame_times[-1] + slack), means[frame], np.nan)


def _run_lines(
    axes: Any, t: np.ndarray, means: Any, teams: dict[int, str], games: Sequence[Trajectories]
) -> Iterator[Handle]:
    for i, tracks in enumerate(games):
        for j, values in enumerate(means.values()):
            axes.plot(t, values[i], color=COLOURS[i], linestyle=DASHES[j % len(DASHES)], linewidth=1.2)
        yield line_sign(COLOURS[i]), f"{real_path(tracks.recording.path).name}"
    if len(means) > 1:
        for j, team in enumerate(means):
            yield line_sign(INK, linestyle=DASHES[j % len(DASHES)]), teams[team]


def _run_bands(
    axes: Any, tracks: Trajectories, t: np.ndarray, means: Any, teams: dict[int, str]
) -> Iterator[Handle]:
    for team, values in means.items():
        draw_bands(axes, tracks, t, values, team)
        yield line_sign(**line_look(tracks, team)), f"{teams[team]}, median"
    yield from band_signs("the runs", "them")
