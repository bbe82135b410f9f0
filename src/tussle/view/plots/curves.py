"""Plots over time: speed, altitude, the distance of two entities."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import rule_y, shortened
from tussle.errors import ParameterError
from tussle.palette import INK, MUTED, PAPER, mixed
from tussle.palette import TEAM_COLOURS as COLOURS
from tussle.view.plots.selection import Selection, Trajectories
from tussle.view.plots.sheet import Handle, add_head, line_look, line_sign, mark_sign, sheet, time_axis
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MANY = 12
"""Largest team with a line for each entity; larger teams get a band."""
MAX_TIMES = 400
"""Points of a band."""


def speed(tracks: Trajectories) -> Figure:
    """Speed over time: a line for each entity, a band of quantiles for a team of many."""
    return over_time(tracks, {"speed [m/s]": tracks.speed}, "Speed")


def altitude(tracks: Trajectories) -> Figure:
    """Altitude over time: a line for each entity, a band of quantiles for a team of many."""
    return over_time(tracks, {"altitude [m]": tracks.column("z")}, "Altitude")


def distance(recording: Recording, one: int, other: int, selection: Selection | None = None) -> Figure:
    """Distance between two entities while both exist, with its least value.

    Args:
        recording: The recorded run.
        one: Id of the first.
        other: Id of the second.
        selection: Only its times are used.

    Raises:
        ParameterError: An entity does not exist, the two never exist at the same time, or they are the same.
    """
    if one == other:
        raise ParameterError(f"the distance from entity {one} to itself is 0; it takes two entities")
    times = selection or Selection()
    tracks = Trajectories(recording, Selection(entities=(one, other), start=times.start, end=times.end))
    frames, metres = _apart(tracks, one, other)
    t = tracks.frame_times[frames]
    figure = sheet(2.3)
    axes: Any = figure.subplots()
    breaks = np.flatnonzero(np.diff(frames) != 1) + 1
    for part in np.split(np.arange(len(frames)), breaks):
        axes.plot(t[part], metres[part], color=INK, linewidth=1.2)
    signs: list[Handle] = []
    i = int(np.argmin(metres))
    axes.plot(t[i], metres[i], "o", color=COLOURS[1], markersize=4.0, zorder=3)
    signs.append((mark_sign("o", COLOURS[1]), f"least: {metres[i]:.3g} m at {t[i]:g} s"))
    for who in (one, other):
        if who in tracks.deaths and frames[-1] == tracks.frame[tracks.last[tracks.who == who][0]]:
            axes.plot(t[-1], metres[-1], "x", color=INK, markersize=6.0, markeredgewidth=1.4, zorder=4)
            signs.append((mark_sign("x", INK), f"{who} died: {tracks.deaths[who].text}"))
    axes.set_ylim(bottom=0.0)
    axes.set_ylabel("distance [m]")
    time_axis(axes, t)
    rule_y(axes)
    names = (f"{who} ({shortened(tracks.teams[tracks.team_of[who]], 12)})" for who in (one, other))
    add_head(figure, tracks, "Distance between {} and {}".format(*names), signs)
    return figure


def _apart(tracks: Trajectories, one: int, other: int) -> tuple[np.ndarray, np.ndarray]:
    """Frames in which both exist, (T,), and their distance [m], (T,)."""
    pos = tracks.pos()
    first, second = (slice(*tracks.first[i : i + 2]) for i in np.searchsorted(tracks.who, (one, other)))
    both, mine, its = np.intersect1d(
        tracks.frame[first], tracks.frame[second], assume_unique=True, return_indices=True
    )
    if not len(both):
        spans = (
            f"{who} exists from {tracks.t[rows][0]:g} s to {tracks.t[rows][-1]:g} s"
            for who, rows in ((one, first), (other, second))
        )
        raise ParameterError(
            f"{tracks.recording.path}: entities {one} and {other} never exist at the same time: {', '.join(spans)}"
        )
    return both, np.linalg.norm(pos[first][mine] - pos[second][its], axis=1)


def over_time(tracks: Trajectories, values: Mapping[str, np.ndarray], what: str) -> Figure:
    """Values of the states over time, (m,), one below the other with their labels; NaN where there is none."""
    figure = sheet(2.5 * len(values))
    signs: list[Handle] = []
    for axes, (label, each) in zip(
        np.atleast_1d(figure.subplots(len(values), sharex=True)), values.items(), strict=True
    ):
        if tracks.selection.entities and len(tracks) <= len(COLOURS):
            signs = _named_lines(axes, tracks, each)
        else:
            signs = _teams_over_time(axes, tracks, each)
        axes.set_ylabel(label)
        axes.margins(y=0.08)
        time_axis(axes, tracks.frame_times)
        rule_y(axes)
    add_head(figure, tracks, what, signs)
    return figure


def _named_lines(axes: Axes, tracks: Trajectories, values: np.ndarray) -> list[Handle]:
    """A line for each entity, in a colour of its own."""
    signs = []
    for i, (who, team, rows) in enumerate(tracks.each()):
        colour = COLOURS[i]
        _line(axes, tracks, values, rows, color=colour, linewidth=1.1)
        _cross(axes, tracks, values, who, rows, colour)
        signs.append((line_sign(colour), f"{who} ({tracks.teams[team]})"))
    return signs + _death_sign(tracks)


def _teams_over_time(axes: Axes, tracks: Trajectories, values: np.ndarray) -> list[Handle]:
    """Bands below, lines above them."""
    count = {team: int((tracks.team == team).sum()) for team in tracks.teams}
    many = [team for team in count if count[team] > MANY]
    for team in many:
        _band(axes, tracks, values, team)
    for who, team, rows in tracks.each():
        if team not in many:
            _line(axes, tracks, values, rows, alpha=0.85, **line_look(tracks, team, 0.8))
            _cross(axes, tracks, values, who, rows, tracks.colours[team])
    signs = [(line_sign(**line_look(tracks, team)), name) for team, name in tracks.teams.items()]
    if many:
        signs += band_signs("a team", "it")
    is_marked = any(who in tracks.deaths and team not in many for who, team, _ in tracks.each())
    return signs + (_death_sign(tracks) if is_marked else [])


def _line(axes: Axes, tracks: Trajectories, values: np.ndarray, rows: slice, **options: Any) -> None:
    """Draw the values of one entity, with gaps where it did not exist."""
    t, v = tracks.t[rows], values[rows]
    breaks = np.flatnonzero(tracks.is_breaking[rows])[1:]
    axes.plot(np.insert(t, breaks, np.nan), np.insert(v, breaks, np.nan), zorder=2.5, **options)


def _cross(axes: Axes, tracks: Trajectories, values: np.ndarray, who: int, rows: slice, colour: str) -> None:
    """Mark the death of an entity, if it died."""
    if who in tracks.deaths:
        look: dict[str, Any] = {"color": colour, "markersize": 4.5, "markeredgewidth": 1.2, "zorder": 3}
        axes.plot(tracks.t[rows][-1], values[rows][-1], "x", **look)


def _death_sign(tracks: Trajectories) -> list[Handle]:
    return [(mark_sign("x", MUTED), "died")] if tracks.deaths else []


def _band(axes: Axes, tracks: Trajectories, values: np.ndarray, team: int) -> None:
    """Median, middle half and middle nine tenths of a team over time."""
    frames = np.unique(np.linspace(0, len(tracks.frame_times) - 1, MAX_TIMES).round().astype(int))
    mine = np.repeat(tracks.team == team, np.diff(tracks.first)) & np.isin(tracks.frame, frames)
    order = np.argsort(tracks.frame[mine], kind="stable")
    frame, found = tracks.frame[mine][order], values[mine][order]
    edges = np.searchsorted(frame, [*frames, len(tracks.frame_times)])
    samples = np.full((int(np.diff(edges).max(initial=0)), len(frames)), np.nan)
    for i, (begin, end) in enumerate(pairwise(edges)):
        samples[: end - begin, i] = found[begin:end]
    draw_bands(axes, tracks, tracks.frame_times[frames], samples, team)


def band_signs(of: str, it: str) -> list[Handle]:
    """What the shades of a band mean."""
    shades = (mixed(MUTED, PAPER, 0.45), mixed(MUTED, PAPER, 0.75))
    return [(line_sign(shades[0], 5.0), f"half of {of}"), (line_sign(shades[1], 5.0), f"90 % of {it}")]


def draw_bands(axes: Axes, tracks: Trajectories, t: np.ndarray, samples: np.ndarray, team: int) -> None:
    """Median, middle half and middle nine tenths of samples, (n, T), NaN where there is none, at times [s], (T,)."""
    bands = np.full((5, len(t)), np.nan)
    has_some = np.isfinite(samples).any(axis=0)
    bands[:, has_some] = np.nanquantile(samples[:, has_some], [0.05, 0.25, 0.5, 0.75, 0.95], axis=0)
    colour = tracks.colours[team]
    axes.fill_between(t, bands[0], bands[4], color=colour, alpha=0.16, linewidth=0)
    axes.fill_between(t, bands[1], bands[3], color=colour, alpha=0.3, linewidth=0)
    axes.plot(t, bands[2], **line_look(tracks, team))
