"""The sheet that a plot is drawn on: its head with title and legend, and how it becomes a file."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.batch.report.drawing import (
    UNDATED,
    WIDTH,
    house_style,
    lettering,
    shortened,
)
from tussle.errors import ParameterError, ViewError, listed, nearest_name
from tussle.palette import MUTED, colour_of
from tussle.view.plots.choice import Tracks

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


FORMATS = tuple(UNDATED)
"""Kinds of files that are written."""

DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (5, 1.5, 1, 1.5)), (0, (1, 1.2)))
"""Of teams 1, 2, ..., for those who do not see their colours."""

Handle = tuple[Any, str]
"""A sign of the legend and what stands beside it."""

LETTERS = 72
"""In one line of the sheet."""


def plot_style() -> AbstractContextManager[None]:
    """Plots are made and saved inside; they look like those of the report of a batch.

    Raises:
        MissingExtraError: Matplotlib is not installed.
    """
    return house_style("tussle plot", "view")


def sheet(height: float) -> Figure:
    """An empty figure of the house's width and some height [inch], without its head."""
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH, height), layout="compressed")  # maps keep close to their scales and legends


def add_head(figure: Figure, tracks: Tracks, what: str, handles: Sequence[Handle] = ()) -> None:
    """Write over the axes what is shown, of which game, and what the signs mean; the figure grows by the lines of it."""
    names = [shortened(name, 30) for _, name in handles]
    n_columns = next(n for n in range(max(1, len(names)), 0, -1) if n == 1 or _width(names, n) <= LETTERS)
    n_rows = -(-len(names) // n_columns)
    figure.set_figheight(figure.get_figheight() + 0.2 + 0.17 * n_rows)
    legend = figure.legend(
        [handle for handle, _ in handles], names, loc="outside upper left", ncols=n_columns, borderaxespad=0.2,
        title=f"{what} · {shortened(_game(tracks), LETTERS - 3 - len(what))}", alignment="left", columnspacing=1.4,
    )  # fmt: skip
    legend.get_title().set_color(MUTED)
    legend.get_title().set_fontsize(8)


def _width(names: Sequence[str], n_columns: int) -> int:
    """Letters that names in columns take, each with its sign."""
    n_rows, n_longer = divmod(len(names), n_columns)
    starts = np.cumsum([0, *([n_rows + 1] * n_longer), *([n_rows] * (n_columns - n_longer))])
    return sum(6 + max(map(len, names[i:j]), default=0) for i, j in pairwise(starts.tolist()))


def _game(tracks: Tracks) -> str:
    """Which game it is."""
    recording = tracks.recording
    worlds = recording.run.info.get("worlds", ())
    seed = f", seed {worlds[recording.world]['seed']}" if recording.world < len(worlds) else ""
    name = shortened(recording.name, 44)
    return f"{name}, world {recording.world}{seed}" if len(worlds) > 1 else f"{name}{seed}"


def line_look(team: int, linewidth: float = 1.4) -> dict[str, Any]:
    """Colour and dashes of a team's curves."""
    return {"color": colour_of(team), "linestyle": DASHES[(team - 1) % len(DASHES)], "linewidth": linewidth}


def line_sign(color: str, linewidth: float = 1.6, **options: Any) -> Any:
    """A line, to stand in a legend; its options are Matplotlib's."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, linewidth=linewidth, **options)


def mark_sign(marker: str, colour: str = MUTED, **options: Any) -> Any:
    """A mark, to stand in a legend."""
    return line_sign(colour, linestyle="none", marker=marker, **options)


def time_axis(axes: Axes, times: np.ndarray) -> None:
    """The x axis as the span of some times [s], ascending."""
    first, last = float(times[0]), float(times[-1])
    margin = 0.02 * (last - first) or 0.5
    axes.set_xlim(first - margin, last + margin)
    axes.set_xlabel("time [s]")


def save(figure: Figure, path: Path, form: str) -> str:
    """Write a figure into a file; the same figure gives the same bytes.

    Returns:
        Letters that the font of the file lacks.

    Raises:
        ViewError: It cannot be written.
    """
    try:
        with lettering(figure) as missing:
            figure.savefig(path, format=form, metadata=UNDATED[form])
    except OSError as error:
        raise ViewError(f"{path}: the plot cannot be written: {error.strerror or error}") from error
    return "".join(sorted(missing))


def check_format(form: str) -> None:
    """Refuse a kind of file that is not written.

    Raises:
        ParameterError: It is none of `FORMATS`.
    """
    if form not in FORMATS:
        raise ParameterError(f"there is no format {form!r}{nearest_name(form, FORMATS)}; {listed(FORMATS)}")
