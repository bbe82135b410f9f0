"""Plots of places: the ways that entities took, from above and in space, and where they were for how long."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import WIDTH, marker_of
from tussle.palette import INK, MUTED, PAPER, colour_of, mixed
from tussle.view.plots.choice import Tracks
from tussle.view.plots.sheet import Handle, add_head, line_sign, mark_sign, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MOST_TRACKS = 2000
"""Ways drawn in one plot: more cannot be told apart, and each costs time and bytes."""
MOST_POINTS = 20_000
"""Of lines that an SVG or PDF file keeps as lines; more make files that are slow to open, and become pixels."""
N_CELLS = 1200
"""Cells across a plot within which a line is one point: more than the pixels of its PNG file."""
MOST_MAPS = 6
"""Teams that each get a map of where they were."""
LEAST_WIDTH = 10.0
"""Of a map on which nobody moves [m]."""


def trajectory(tracks: Tracks) -> Figure:
    """Ways from above, in the teams' colours; how each began and ended, bases and boundaries."""
    shown = tracks.spread(MOST_TRACKS)
    pos = tracks.pos("xy")
    low, high, height = _framed(pos.min(axis=0), pos.max(axis=0))
    figure = sheet(height)
    axes: Any = figure.subplots()
    _map_axes(axes, low, high)
    scenery = _draw_scenery(axes, tracks)
    ways = _ways(tracks, pos, shown, float((high - low).max()) / N_CELLS)
    _draw_ways(axes, tracks, ways)
    marks = _draw_ends(axes, tracks, pos, shown)
    add_head(figure, tracks, "Ways from above", [*_team_signs(tracks), *marks, *scenery])
    return figure


def trajectory3d(tracks: Tracks) -> Figure:
    """Ways in space, all axes in the same scale; where all is flat, heights are drawn some round number of times as high."""
    shown = tracks.spread(MOST_TRACKS)
    pos = tracks.pos()
    low, high = pos.min(axis=0), pos.max(axis=0)
    missing = np.maximum(0.0, np.array([LEAST_WIDTH, LEAST_WIDTH, 1.0]) - (high - low))
    low, high = low - 0.5 * missing, high + 0.5 * missing
    size = high - low
    times = _times_as_high(float(size[2]), float(size[:2].max()))
    figure = sheet(3.1)
    axes: Any = figure.add_subplot(projection="3d")
    ways = _ways(tracks, pos, shown, float(size.max()) / N_CELLS)
    _draw_ways(axes, tracks, ways)
    marks = _draw_ends(axes, tracks, pos, shown)
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    seen = size * [1.0, 1.0, times]
    sides = np.maximum(seen / seen.max(), 0.25)  # none so short that its numbers lie over each other
    _space_look(axes, sides)
    what = "Ways in space" if times == 1.0 else f"Ways in space, {times:g} times as high"
    add_head(figure, tracks, what, [*_team_signs(tracks), *marks])
    _fill_space(figure, axes, sides)
    return figure


def density(tracks: Tracks) -> Figure:
    """Where the entities of each team were for how long, as one map of square cells for each team; of very many teams, one for all."""
    pos = tracks.pos("xy")
    low, high, height = _framed(pos.min(axis=0), pos.max(axis=0), room=1.3)
    step = _round_up(float((high - low).max()) / 110.0)
    edges = [_edges(low[i], high[i], step) for i in (0, 1)]
    lasts = _durations(tracks)[tracks.frame]
    team = np.repeat(tracks.team, np.diff(tracks.first))
    parts = [(name, colour_of(number), team == number) for number, name in tracks.teams.items()]
    if len(parts) > MOST_MAPS:
        parts = [(f"all {len(parts)} teams", MUTED, np.ones(len(team), bool))]
    figure = sheet(height * len(parts))
    panels = figure.subplots(len(parts), 1, sharex=True, sharey=True, squeeze=False)[:, 0]
    for axes, (name, colour, rows) in zip(panels, parts, strict=True):
        held = np.histogram2d(pos[rows, 0], pos[rows, 1], bins=edges, weights=lasts[rows])[0]
        _shade(figure, axes, held, edges, colour)
        _map_axes(axes, low, high)
        axes.set_title(name, loc="left", fontsize=8.5, color=colour, pad=3.0)
        axes.label_outer()
    add_head(figure, tracks, f"Where they were, cells of {step:g} m")
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


# -- ways -------------------------------------------------------------------------------------------------------------------


def _ways(
    tracks: Tracks, pos: np.ndarray, shown: np.ndarray, cell: float
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


def _draw_ways(axes: Any, tracks: Tracks, ways: list[tuple[int, list[np.ndarray]]]) -> None:
    """Draw the lines, the larger teams first, so that they do not hide the smaller ones."""
    from matplotlib.collections import LineCollection
    from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

    kind = Line3DCollection if axes.name == "3d" else LineCollection
    n_points = sum(len(line) for _, lines in ways for line in lines)
    for order, (team, lines) in enumerate(sorted(ways, key=lambda way: -len(way[1]))):
        if not lines:
            continue
        drawn = kind(
            lines, colors=colour_of(team), linewidths=_thinner(len(lines)), zorder=2.0 + 0.1 * order,
            alpha=float(np.clip(4.0 / math.sqrt(len(lines)), 0.25, 1.0)), rasterized=n_points > MOST_POINTS,
        )  # fmt: skip
        axes.add_collection(drawn, autolim=False)


def _team_signs(tracks: Tracks) -> list[Handle]:
    return [(line_sign(colour_of(team)), name) for team, name in tracks.teams.items()]


def _thinner(n: int) -> float:
    """Width of one of so many lines [pt]."""
    return float(np.clip(3.0 / n**0.35, 0.45, 1.2))


def _draw_ends(axes: Any, tracks: Tracks, pos: np.ndarray, shown: np.ndarray) -> list[Handle]:
    """Mark where each began, where it is at the end, where it died; what the marks mean."""
    has_died = np.isin(tracks.who, list(tracks.deaths))
    small = float(np.clip(60.0 / math.sqrt(len(shown)), 0.8, 14.0))
    for team in tracks.teams:
        mine = shown[tracks.team[shown] == team]
        colour, over = colour_of(team), {"zorder": 4.0, "rasterized": len(mine) > MOST_TRACKS // 4}
        if axes.name == "3d":
            over["depthshade"] = False
        here = pos[tracks.first[mine]]
        axes.scatter(
            *here.T,
            s=0.7 * small,
            marker="o",
            facecolors=PAPER,
            edgecolors=colour,
            linewidths=min(0.6, 0.15 * small),
            **over,
        )
        alive, dead = mine[~has_died[mine]], mine[has_died[mine]]
        axes.scatter(
            *pos[tracks.last[alive]].T, s=2.0 * small, marker=marker_of(team), color=colour,
            edgecolors=PAPER, linewidths=min(0.4, 0.05 * small), **over,
        )  # fmt: skip
        axes.scatter(
            *pos[tracks.last[dead]].T,
            s=1.6 * small,
            marker="x",
            color=colour,
            linewidths=min(0.9, 0.25 * small),
            **over,
        )
    signs = [(mark_sign("o", markerfacecolor=PAPER, markersize=3.5), "first")]
    signs.append((mark_sign("o", markersize=4.5), "last"))
    if has_died[shown].any():
        signs.append((mark_sign("x", markersize=4.0), "died"))
    return signs


# -- maps -------------------------------------------------------------------------------------------------------------------


def _framed(low: np.ndarray, high: np.ndarray, room: float = 0.75) -> tuple[np.ndarray, np.ndarray, float]:
    """Corners of a map around others, each (2,), and the height of its figure [inch], so that both axes have one scale."""
    size = np.maximum(high - low, LEAST_WIDTH)
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


def _draw_scenery(axes: Axes, tracks: Tracks) -> list[Handle]:
    """Bases and boundaries that lie in the picture; what the lines mean."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Circle

    scenery = tracks.recording.scenery
    corners = np.array([axes.get_xlim(), axes.get_ylim()])
    signs: dict[str, Handle] = {}
    for base in scenery.bases:
        place = base.pos[:2]
        if _is_in_picture(place - base.radius, place + base.radius, corners):
            colour = colour_of(base.team)
            pale = mixed(colour, PAPER, 0.8)
            axes.add_patch(Circle((place[0], place[1]), base.radius, facecolor=pale, edgecolor=colour))
            signs["base"] = (mark_sign("o", MUTED, markersize=7.0, markerfacecolor="none"), "base")
    for region in scenery.boundaries:
        lines = region.outline[:, :, :2]
        if _is_in_picture(lines.min(axis=(0, 1)), lines.max(axis=(0, 1)), corners):
            look: dict[str, Any] = {"linewidth": 0.8, "linestyle": "--"}
            axes.add_collection(LineCollection(list(lines), colors=MUTED, **look), autolim=False)
            signs["boundary"] = (line_sign(MUTED, **look), "boundary")
    return list(signs.values())


def _is_in_picture(low: np.ndarray, high: np.ndarray, corners: np.ndarray) -> bool:
    """Whether a box, each (2,), reaches into a map whose limits are (2 axes, 2)."""
    return bool((high >= corners[:, 0]).all() and (low <= corners[:, 1]).all())


def _times_as_high(height: float, width: float) -> float:
    """1, 2, 5, 10, ...: times as high as it is so that a scene's height is a quarter of its width."""
    return max(1.0, _round_up(0.2 * width / height))


def _round_up(wanted: float) -> float:
    """1, 2 or 5 times a power of ten, not less than a number."""
    power = 10.0 ** math.floor(math.log10(wanted))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= wanted * (1.0 - 1e-9))


def _space_look(axes: Any, sides: np.ndarray) -> None:
    """Thin walls, the view from the south-east, and no more numbers along an axis than it has room for."""
    from matplotlib.ticker import MaxNLocator

    axes.set_box_aspect(sides.tolist())
    axes.view_init(elev=26.0, azim=-58.0)
    axes.set(xlabel="east [m]", ylabel="north [m]", zlabel="up [m]")
    for axis, side in zip((axes.xaxis, axes.yaxis, axes.zaxis), sides.tolist(), strict=True):
        axis.set_pane_color((0.97, 0.975, 0.98, 1.0))
        axis.line.set_linewidth(0.6)
        axis.set_major_locator(MaxNLocator(max(2, round(6 * side)), steps=[1, 2, 2.5, 5, 10]))
        axis.set_tick_params(labelsize=7, pad=4)
        axis.labelpad = 14.0 if axis is axes.zaxis else 26.0


def _fill_space(figure: Figure, axes: Any, sides: np.ndarray) -> None:
    """Draw the scene with its words as wide as the sheet, and the sheet as high as that: Matplotlib leaves room or cuts words off."""
    figure.draw_without_rendering()
    figure.set_layout_engine("none")
    dpi, zoom = figure.dpi, 0.4
    width, head = figure.bbox.width, figure.legends[0].get_window_extent().height + 0.1 * dpi
    side = 2.0 * width  # nothing that is drawn reaches an edge of the axes, which would cut it off
    left, bottom, total = 0.0, 0.0, figure.bbox.height
    for _ in range(4):  # words keep their size, so that one look is not enough
        axes.set_position((left / width, bottom / total, side / width, side / total))
        axes.set_box_aspect(sides.tolist(), zoom=zoom)
        figure.draw_without_rendering()
        low, high = _seen(axes)
        fits = min((width - 0.1 * dpi) / (high - low)[0], 3.4 * dpi / (high - low)[1])
        height = fits * (high - low)[1]
        total = height + head + 0.1 * dpi
        figure.set_figheight(total / dpi)
        zoom *= fits
        # Zooming keeps the middle of the axes where it is.
        middle = np.array([left, bottom]) + 0.5 * side
        off = fits * (0.5 * (low + high) - middle)
        left, bottom = np.array([0.5 * width, 0.05 * dpi + 0.5 * height]) - off - 0.5 * side


def _seen(axes: Any) -> tuple[np.ndarray, np.ndarray]:
    """Corners of what axes in space show, with their words [pixels], each (2,)."""
    from mpl_toolkits.mplot3d.proj3d import proj_transform  # type: ignore[import-untyped]

    limits = (axes.get_xlim3d(), axes.get_ylim3d(), axes.get_zlim3d())
    corners = np.array([(x, y, z) for x in limits[0] for y in limits[1] for z in limits[2]])
    x, y, _ = proj_transform(*corners.T, axes.get_proj())
    points = [axes.transData.transform(np.stack([x, y], axis=1))]
    points += [axis.get_tightbbox().get_points() for axis in (axes.xaxis, axes.yaxis, axes.zaxis)]
    return np.concatenate(points).min(axis=0), np.concatenate(points).max(axis=0)


def _edges(low: float, high: float, step: float) -> np.ndarray:
    """Multiples of a step around an interval."""
    return np.arange(math.floor(low / step), math.ceil(high / step) + 1) * step


def _durations(tracks: Tracks) -> np.ndarray:
    """How long each frame of the span stands for [s], (T,): until the next one; the last as long as they usually do."""
    lasts = np.diff(tracks.frame_times)
    usual = float(np.median(lasts)) if len(lasts) else tracks.recording.dt
    return np.append(lasts, usual)
