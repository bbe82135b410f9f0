"""Plots of counts over time: entities left, captures, collisions."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import rule_y
from tussle.errors import ParameterError
from tussle.palette import INK, MUTED
from tussle.view.left import numbers_left
from tussle.view.plots.selection import Trajectories
from tussle.view.plots.sheet import Handle, add_head, line_look, line_sign, mark_sign, sheet, time_axis

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MAX_MARKS = 80
"""Deaths of a team up to which each is marked."""
CAUSE_MARKS = ("x", "+", "d", "1")
"""Markers of causes of death in alphabetical order; the last one stands for all further causes."""


def left(tracks: Trajectories) -> Figure:
    """Number of entities of each team over time, with a mark for each death and its cause."""
    figure = sheet(2.5)
    axes: Any = figure.subplots()
    signs: list[Handle] = []
    causes: set[str] = set()
    for number, name in tracks.teams.items():
        t, n = _number_left(tracks, number)
        axes.step(t, n, where="post", **line_look(tracks, number))
        signs.append((line_sign(**line_look(tracks, number)), f"{name}: {n[0]}, then {n[-1]}"))
        causes |= _mark_deaths(axes, tracks, number, t, n)
    _whole_numbers(axes)
    axes.set_ylabel("entities")
    time_axis(axes, tracks.frame_times)
    add_head(figure, tracks, "Entities left", [*signs, *_cause_signs(tracks, causes)])
    return figure


def _number_left(tracks: Trajectories, team: int) -> tuple[np.ndarray, np.ndarray]:
    """Times [s], and how many entities of a team there are from then on, (k,) each."""
    is_mine = np.repeat(tracks.team == team, np.diff(tracks.first))
    n = np.bincount(tracks.frame[is_mine], minlength=len(tracks.frame_times))
    mine = [h for h in tracks.events if tracks.team_of.get(h.id) == team and _is_chosen(tracks, h.id)]
    born, died = ([h.t for h in mine if h.kind == kind] for kind in ("birth", "death"))
    return numbers_left(tracks.recording, tracks.frame_times, n, born, died)


def captures(tracks: Trajectories) -> Figure:
    """Captures of each team and collisions since the beginning of the span.

    Raises:
        ParameterError: There are none.
    """
    caught, met = _captures(tracks), _collisions(tracks)
    if not caught and not met:
        raise ParameterError(
            f"{tracks.recording.path}: there are no captures and no collisions to be plotted"
        )
    figure = sheet(0.5 + 1.9 * (bool(caught) + bool(met)))
    panels = list(figure.subplots(bool(caught) + bool(met), 1, sharex=True, squeeze=False)[:, 0])
    signs: list[Handle] = []
    bottom = panels[-1]
    if caught:
        axes = panels.pop(0)
        for team, times in sorted(caught.items()):
            _staircase(axes, tracks, times, **line_look(tracks, team))
            signs.append(
                (line_sign(**line_look(tracks, team)), f"{tracks.recording.teams[team]}: {len(times)}")
            )
        axes.set_ylabel("captures so far")
        _whole_numbers(axes)
    if met:
        _staircase(panels[0], tracks, met, color=INK, linewidth=1.2)
        panels[0].set_ylabel("collisions so far")
        _whole_numbers(panels[0])
    time_axis(bottom, tracks.frame_times)
    what = " and ".join(word for word, found in (("captures", caught), ("collisions", met)) if found)
    add_head(figure, tracks, what.capitalize(), signs)
    return figure


def has_captures(tracks: Trajectories) -> bool:
    """Return True if the plot of captures has data."""
    return bool(_captures(tracks) or _collisions(tracks))


def _is_chosen(tracks: Trajectories, who: int) -> bool:
    """Return True if an entity is selected by id and team, at any time."""
    selection = tracks.selection
    return (not selection.entities or who in selection.entities) and (
        not selection.teams or tracks.team_of.get(who) in selection.teams
    )


def _captures(tracks: Trajectories) -> dict[int, list[float]]:
    """Times of the captures by selected entities [s], by team."""
    found: dict[int, list[float]] = {}
    for h in tracks.events:
        if h.kind == "capture" and h.id in tracks.team_of and _is_chosen(tracks, h.id):
            found.setdefault(tracks.team_of[h.id], []).append(h.t)
    return found


def _collisions(tracks: Trajectories) -> list[float]:
    """Times of the collisions of selected entities [s]."""
    return [
        h.t
        for h in tracks.events
        if h.kind == "collision" and (_is_chosen(tracks, h.id) or _is_chosen(tracks, h.other))
    ]


def _staircase(axes: Axes, tracks: Trajectories, times: list[float], **look: Any) -> None:
    """Draw the number of events so far over the whole span."""
    first, last = tracks.frame_times[0], tracks.frame_times[-1]
    axes.step([first, *times, last], [*range(len(times) + 1), len(times)], where="post", **look)


def _mark_deaths(axes: Axes, tracks: Trajectories, team: int, t: np.ndarray, n: np.ndarray) -> set[str]:
    """Mark deaths of a team on its curve.

    Args:
        axes: Where the curve is.
        tracks: What is plotted.
        team: The team.
        t: Times [s], (k,).
        n: How many of it are there from each on, (k,).

    Returns:
        Why they died.
    """
    is_mine = {who: team == of for who, of in tracks.team_of.items() if _is_chosen(tracks, who)}
    deaths = [h for h in tracks.events if h.kind == "death" and is_mine.get(h.id)]
    if len(deaths) > MAX_MARKS:
        return set()
    causes = _causes(tracks)
    for h in deaths:
        at = int(np.searchsorted(t, h.t + 1e-6 * tracks.recording.dt, side="right")) - 1
        axes.plot(
            h.t,
            n[at],
            causes[h.text],
            color=tracks.colours[team],
            markersize=3.8,
            markeredgewidth=0.9,
            zorder=3,
        )
    return {h.text for h in deaths}


def _causes(tracks: Trajectories) -> dict[str, str]:
    """Mark of each cause of death in the recording."""
    texts = sorted({h.text for h in tracks.recording.events if h.kind == "death"})
    last = len(CAUSE_MARKS) - 1
    return {text: CAUSE_MARKS[min(i, last)] for i, text in enumerate(texts)}


def _cause_signs(tracks: Trajectories, seen: set[str]) -> list[Handle]:
    """The marks that were drawn, each with all that it stands for."""
    words: dict[str, list[str]] = {}
    for text, mark in _causes(tracks).items():
        if text in seen:
            words.setdefault(mark, []).append(text or "died")
    return [(mark_sign(mark, MUTED), ", ".join(texts)) for mark, texts in words.items()]


def _whole_numbers(axes: Axes) -> None:
    """Let the y axis start at 0, with whole numbers; called after drawing."""
    from matplotlib.ticker import MaxNLocator

    axes.yaxis.set_major_locator(MaxNLocator(6, integer=True, steps=[1, 2, 5, 10]))
    axes.set_ylim(0.0, max(1.0, axes.get_ylim()[1]))
    rule_y(axes)
