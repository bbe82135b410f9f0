"""Plots of trajectories from above and in space, and of the time spent in each place."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import WIDTH, marker_of
from tussle.palette import INK, MUTED, PAPER, mixed
from tussle.view.plots.selection import Trajectories
from tussle.view.plots.sheet import Handle, add_head, line_sign, mark_sign, sheet
from tussle.view.scenery import round_up

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MAX_TRAJECTORIES = 2000
"""Trajectories in one plot: more cannot be told apart."""
MAX_POINTS = 20_000
"""Points of lines in an SVG or PDF file; more become pixels, since the file would open slowly."""
N_CELLS = 1200
"""Cells across a plot; of consecutive points in one cell one is drawn. More than the pixels of a PNG file."""
MAX_MAPS = 6
"""Teams with a map of their own."""
_ZOOM = 1.08
"""Size of a flat scene in space."""
MAX_SIGNS = 4
"""Marks of teams beside each other in a legend."""
MIN_WIDTH = 10.0
"""Least width of a map [m]."""


def trajectory(tracks: Trajectories) -> Figure:
    """Trajectories from above in the teams' colours, with first and last positions, bases, walls and boundaries."""
    shown = tracks.spread(MAX_TRAJECTORIES)
    pos = tracks.pos("xy")
    low, high, height = _framed(pos.min(axis=0), pos.max(axis=0))
    figure = sheet(height)
    axes: Any = figure.subplots()
    _map_axes(axes, low, high)
    scenery = _draw_scenery(axes, tracks)
    lines = _lines(tracks, pos, shown, float((high - low).max()) / N_CELLS)
    _draw_lines(axes, tracks, lines)
    marks = _draw_ends(axes, tracks, pos, shown)
    add_head(figure, tracks, "Trajectories from above", [*_team_signs(tracks, lines), *marks, *scenery])
    return figure


def trajectory3d(tracks: Trajectories) -> Figure:
    """Trajectories in space, all axes to the same scale; low heights are exaggerated by a round factor."""
    shown = tracks.spread(MAX_TRAJECTORIES)
    pos = tracks.pos()
    low, high = pos.min(axis=0), pos.max(axis=0)
    missing = np.maximum(0.0, np.array([MIN_WIDTH, MIN_WIDTH, 1.0]) - (high - low))
    low, high = low - 0.5 * missing, high + 0.5 * missing
    size = high - low
    times = max(1.0, round_up(0.2 * float(size[:2].max()) / float(size[2])))
    figure = sheet(3.2)
    axes: Any = figure.add_subplot(projection="3d")
    lines = _lines(tracks, pos, shown, float(size.max()) / N_CELLS)
    _draw_lines(axes, tracks, lines)
    marks = _draw_ends(axes, tracks, pos, shown)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    seen = size * [1.0, 1.0, times]
    sides = np.maximum(seen / seen.max(), 0.25)  # none so short that its numbers lie over each other
    _space_look(axes, sides)
    what = "Trajectories in space" if times == 1.0 else f"Trajectories in space, heights times {times:g}"
    add_head(figure, tracks, what, [*_team_signs(tracks, lines), *marks])
    figure.set_layout_engine("none")  # it would make the scene small
    axes.set_position((0.0, 0.0, 0.98, 0.94))
    _centre(figure, axes, sides)
    return figure


def density(tracks: Trajectories) -> Figure:
    """Time that entities spent in square cells: one map for each team, or one for very many teams."""
    pos = tracks.pos("xy")
    low, high, height = _framed(pos.min(axis=0), pos.max(axis=0), room=1.3)
    step = round_up(float((high - low).max()) / 110.0)
    edges = [_edges(low[i], high[i], step) for i in (0, 1)]
    lasts = _durations(tracks)[tracks.frame]
    team = np.repeat(tracks.team, np.diff(tracks.first))
    parts = [(name, tracks.colours[number], team == number) for number, name in tracks.teams.items()]
    if len(parts) > MAX_MAPS:
        parts = [(f"all {len(parts)} teams", MUTED, np.ones(len(team), bool))]
    figure = sheet(height * len(parts))
    panels = figure.subplots(len(parts), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (name, colour, rows) in zip(panels, parts, strict=True):
        held = np.histogram2d(pos[rows, 0], pos[rows, 1], bins=edges, weights=lasts[rows])[0]
        _shade(figure, axes, held, edges, colour)
        _map_axes(axes, low, high)
        axes.set_title(name, loc="left", fontsize=8.5, pad=3.0)
        axes.label_outer()
    add_head(figure, tracks, f"Time spent in cells of {step:g} m")
    return figure


def _shade(figure: Figure, axes: Axes, held: np.ndarray, edges: list[np.ndarray], colour: str) -> None:
    """Draw one map and its scale.

    Args:
        figure: The figure.
        axes: What is drawn on.
        held: Time that entities spent in each cell [s], (nx, ny).
        edges: Edges of the cells east and north [m].
        colour: Of cells in the middle of the scale.
    """
    from matplotlib.colors import LinearSegmentedColormap, LogNorm, Normalize

    some = held[held > 0.0]
    is_wide = some.max() > 50.0 * np.median(some)
    shades = [mixed(colour, PAPER, 0.8), colour, mixed(colour, INK, 0.8)]
    image = axes.imshow(
        np.ma.masked_equal(held, 0.0).T,
        norm=LogNorm(some.min(), some.max()) if is_wide else Normalize(0.0, some.max()),
        cmap=LinearSegmentedColormap.from_list("team", shades),
        extent=(edges[0][0], edges[0][-1], edges[1][0], edges[1][-1]),
        origin="lower", interpolation="nearest", zorder=2.0,
    )  # fmt: skip
    bar = figure.colorbar(image, ax=axes, pad=0.02, fraction=0.05)
    bar.outline.set_visible(False)
    bar.set_label("entity seconds a cell", fontsize=7.5)
    bar.ax.tick_params(labelsize=7.5)


# -- lines -------------------------------------------------------------------------------------------------------------------


def _lines(
    tracks: Trajectories, pos: np.ndarray, shown: np.ndarray, cell: float
) -> list[tuple[int, list[np.ndarray]]]:
    """Lines of each team, without the points that lie in the same cell [m] as the one before."""
    is_shown = np.zeros(len(tracks), bool)
    is_shown[shown] = True
    n_states = np.diff(tracks.first)
    team = np.repeat(tracks.team, n_states)
    place = np.floor(pos / cell).astype(np.int64)
    is_kept = tracks.is_breaking.copy()
    is_kept[1:] |= (place[1:] != place[:-1]).any(axis=1)
    is_kept[:-1] |= tracks.is_breaking[1:]
    is_kept[-1] = True
    is_kept &= np.repeat(is_shown, n_states)
    lines = []
    for number in tracks.teams:
        rows = np.flatnonzero(is_kept & (team == number))
        parts = np.split(pos[rows], np.flatnonzero(tracks.is_breaking[rows])[1:])
        lines.append((number, [part for part in parts if len(part) > 1]))
    return lines


def _draw_lines(axes: Any, tracks: Trajectories, by_team: list[tuple[int, list[np.ndarray]]]) -> None:
    """Draw the lines, the larger teams first, so that they do not hide the smaller ones."""
    from matplotlib.collections import LineCollection
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

    kind = Line3DCollection if axes.name == "3d" else LineCollection
    n_points = sum(len(line) for _, lines in by_team for line in lines)
    for order, (team, lines) in enumerate(sorted(by_team, key=lambda pair: -len(pair[1]))):
        if not lines:
            continue
        drawn = kind(
            lines, colors=tracks.colours[team], linewidths=_thinner(len(lines)), zorder=2.0 + 0.1 * order,
            alpha=float(np.clip(4.0 / math.sqrt(len(lines)), 0.25, 1.0)), rasterized=n_points > MAX_POINTS,
        )  # fmt: skip
        axes.add_collection(drawn, autolim=False)


def _team_signs(tracks: Trajectories, by_team: list[tuple[int, list[np.ndarray]]]) -> list[Handle]:
    """A line for each team, or a square for one of which no line is drawn, since nobody of it moved."""
    has_lines = {team for team, lines in by_team if any(np.ptp(line, axis=0).any() for line in lines)}
    return [
        (line_sign(colour) if team in has_lines else mark_sign("s", colour, markersize=5.0), name)
        for team, name in tracks.teams.items()
        for colour in (tracks.colours[team],)
    ]


def _thinner(n: int) -> float:
    """Width of each of n lines [pt]."""
    return float(np.clip(3.0 / n**0.35, 0.45, 1.2))


def _draw_ends(axes: Any, tracks: Trajectories, pos: np.ndarray, shown: np.ndarray) -> list[Handle]:
    """Mark first and last positions and deaths; return the legend of the marks."""
    has_died = np.isin(tracks.who, list(tracks.deaths))
    small = float(np.clip(60.0 / math.sqrt(len(shown)), 0.8, 14.0))
    for team in tracks.teams:
        mine = shown[tracks.team[shown] == team]
        colour, over = tracks.colours[team], {"zorder": 4.0, "rasterized": len(mine) > MAX_TRAJECTORIES // 4}
        if axes.name == "3d":
            over["depthshade"] = False
        here = pos[tracks.first[mine]]
        axes.scatter(
            *here.T, s=0.7 * small, marker="o", facecolors=PAPER, edgecolors=colour,
            linewidths=min(0.6, 0.15 * small), **over,
        )  # fmt: skip
        alive, dead = mine[~has_died[mine]], mine[has_died[mine]]
        axes.scatter(
            *pos[tracks.last[alive]].T, s=2.0 * small, marker=marker_of(team), color=colour,
            edgecolors=PAPER, linewidths=min(0.4, 0.05 * small), **over,
        )  # fmt: skip
        axes.scatter(
            *pos[tracks.last[dead]].T, s=1.6 * small, marker="x", color=colour,
            linewidths=min(0.9, 0.25 * small), **over,
        )  # fmt: skip
    signs: list[Handle] = [(mark_sign("o", markerfacecolor=PAPER, markersize=3.5), "first")]
    alive_teams = np.unique(tracks.team[shown[~has_died[shown]]]).tolist()
    if alive_teams:
        markers = [mark_sign(marker_of(team), tracks.colours[team], markersize=4.5) for team in alive_teams]
        signs.append((tuple(markers[:MAX_SIGNS]), "last"))
    if has_died[shown].any():
        signs.append((mark_sign("x", markersize=4.0), "died"))
    return signs


# -- maps -------------------------------------------------------------------------------------------------------------------


def _framed(low: np.ndarray, high: np.ndarray, room: float = 0.75) -> tuple[np.ndarray, np.ndarray, float]:
    """Corners of a map around others, each (2,), and the height of its figure [inch], so that both axes have one scale."""
    size = np.maximum(high - low, MIN_WIDTH)
    size = 1.08 * np.maximum(size, 0.02 * size.max())
    width = WIDTH - room
    height = float(np.clip(width * size[1] / size[0], 1.5, 4.6))
    size = np.maximum(size, [size[1] * width / height, size[0] * height / width])
    middle = 0.5 * (low + high)
    return middle - 0.5 * size, middle + 0.5 * size, height + 0.6


def _map_axes(axes: Axes, low: np.ndarray, high: np.ndarray) -> None:
    axes.set_xlim(low[0], high[0])
    axes.set_ylim(low[1], high[1])
    axes.set_aspect("equal")
    axes.set(xlabel="east [m]", ylabel="north [m]")
    axes.grid(True)


def _draw_scenery(axes: Axes, tracks: Trajectories) -> list[Handle]:
    """Draw bases, walls and boundaries inside the map; return their legend."""
    from matplotlib.collections import LineCollection, PolyCollection
    from matplotlib.patches import Circle

    scenery = tracks.recording.scenery
    corners = np.array([axes.get_xlim(), axes.get_ylim()])
    signs: dict[str, Handle] = {}
    for base in scenery.bases:
        place = np.array(base.position[:2])
        if _is_in_picture(place - base.radius, place + base.radius, corners):
            colour = tracks.colours[base.team]
            pale = mixed(colour, PAPER, 0.8)
            axes.add_patch(Circle((place[0], place[1]), base.radius, facecolor=pale, edgecolor=colour))
            signs["base"] = (mark_sign("o", MUTED, markersize=7.0, markerfacecolor="none"), "base")
    for region in scenery.boundaries:
        lines = region.outline[:, :, :2]
        if region.is_wall:
            triangles = region.mesh.vertices[region.mesh.faces][:, :, :2]
            grey = mixed(MUTED, PAPER, 0.6)
            axes.add_collection(
                PolyCollection(triangles, facecolor=grey, edgecolor=grey, linewidth=0.3), autolim=False
            )
            signs["wall"] = (mark_sign("s", grey, markersize=7.0), "wall")
        elif _is_in_picture(lines.min(axis=(0, 1)), lines.max(axis=(0, 1)), corners):
            look: dict[str, Any] = {"linewidth": 0.8, "linestyle": "--"}
            axes.add_collection(LineCollection(list(lines), colors=MUTED, **look), autolim=False)
            signs["boundary"] = (line_sign(MUTED, **look), "boundary")
    return list(signs.values())


def _is_in_picture(low: np.ndarray, high: np.ndarray, corners: np.ndarray) -> bool:
    """Return True if a box, each (2,), reaches into a map whose limits are (2 axes, 2)."""
    return bool((high >= corners[:, 0]).all() and (low <= corners[:, 1]).all())


def _space_look(axes: Any, sides: np.ndarray) -> None:
    """Set pane colours, a view from the south-east, and ticks that fit each axis."""
    from matplotlib.ticker import MaxNLocator

    axes.set_box_aspect(sides.tolist(), zoom=_ZOOM - 0.3 * sides[2])  # as large as leaves room for the labels
    axes.view_init(elev=26.0, azim=-58.0)
    axes.set(xlabel="east [m]", ylabel="north [m]", zlabel="up [m]")
    axes.zaxis.labelpad = -3.0
    for axis, side in zip((axes.xaxis, axes.yaxis, axes.zaxis), sides.tolist(), strict=True):
        axis.set_pane_color((0.97, 0.975, 0.98, 1.0))
        axis.line.set_linewidth(0.6)
        axis.set_major_locator(MaxNLocator(max(2, round(6 * side)), steps=[1, 2, 2.5, 5, 10]))
        axis.set_tick_params(labelsize=7, pad=0)


def _centre(figure: Figure, axes: Any, sides: np.ndarray) -> None:
    """Move a scene in space to the middle of its figure, and make it smaller until its labels lie on the figure."""
    figure.draw_without_rendering()
    room = np.array([figure.bbox.width, figure.legends[0].get_window_extent().y0])
    for zoom in (_ZOOM - 0.3 * sides[2]) * 0.94 ** np.arange(12):
        axes.set_box_aspect(sides.tolist(), zoom=zoom)
        figure.draw_without_rendering()
        boxes = [axis.get_tightbbox() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
        low, high = np.min([box.min for box in boxes], axis=0), np.max([box.max for box in boxes], axis=0)
        place = axes.get_position()
        shift = 0.5 * (room - low - high) / [figure.bbox.width, figure.bbox.height]
        axes.set_position((place.x0 + shift[0], place.y0 + shift[1], place.width, place.height))
        if (high - low <= 0.99 * room).all():
            break


def _edges(low: float, high: float, step: float) -> np.ndarray:
    """Multiples of a step around an interval."""
    return np.arange(math.floor(low / step), math.ceil(high / step) + 1) * step


def _durations(tracks: Trajectories) -> np.ndarray:
    """Return the time from each frame of the span to the next [s], (T,); nothing for the last one, unless there is no other."""
    lasts = np.diff(tracks.frame_times)
    return np.append(lasts, 0.0 if len(lasts) else tracks.recording.dt)
