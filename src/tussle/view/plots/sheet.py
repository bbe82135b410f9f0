"""Figures with title and legend, written as files."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.cells import cell_len

from tussle.batch.report.drawing import (
    UNDATED,
    WIDTH,
    house_style,
    lettering,
    printable,
    shortened,
)
from tussle.palette import MUTED
from tussle.view.export.whole_file import whole_file
from tussle.view.plots.selection import Trajectories

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


FORMATS = tuple(UNDATED)
"""File formats."""

DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (5, 1.5, 1, 1.5)), (0, (1, 1.2)))
"""Line styles of teams 1, 2, ..., for readers who do not see colours."""

Handle = tuple[Any, str]
"""A legend handle and its label."""

MAX_NAME, MAX_LINES = 1000, 4
"""Letters of a name, and lines of a title."""
LETTERS = 72
"""Letters in one line of the figure."""


def plot_style() -> AbstractContextManager[None]:
    """Context in which plots are made and saved: the style of the reports of batches.

    Raises:
        MissingExtraError: Matplotlib is not installed.
    """
    return house_style("tussle plot", "view")


def sheet(height: float) -> Figure:
    """An empty figure of a height [inch], without title and legend."""
    from matplotlib.figure import Figure

    return Figure(figsize=(WIDTH, height), layout="compressed")  # maps keep close to their scales and legends


def add_head(
    figure: Figure,
    tracks: Trajectories,
    what: str,
    handles: Sequence[Handle] = (),
    *,
    has_seed: bool = True,
) -> None:
    """Write title and legend over the axes; the figure grows by their lines."""
    from matplotlib.legend_handler import HandlerTuple

    names = [shortened(name, 30) for _, name in handles]
    widths = [6 + len(name) for name in names]
    n_columns = max(1, len(names)) if sum(widths) <= LETTERS else max(1, LETTERS // max(widths))
    title = _wrapped(f"{what} · {_game(tracks, has_seed)}")
    n_lines = title.count("\n") + -(-len(names) // n_columns)
    figure.set_figheight(figure.get_figheight() + 0.2 + 0.17 * n_lines)
    legend = figure.legend(
        [handle for handle, _ in handles], names, loc="outside upper left", ncols=n_columns, borderaxespad=0.2,
        title=title, alignment="left", columnspacing=1.4, handler_map={tuple: HandlerTuple(ndivide=None, pad=0.1)},
    )  # fmt: skip
    legend.get_title().set_color(MUTED)
    legend.get_title().set_fontsize(8)


def _game(tracks: Trajectories, has_seed: bool) -> str:
    """Name, world and, unless it is of several runs, seed of the game."""
    recording = tracks.recording
    worlds = recording.run.info.get("worlds", ())
    seed = f", seed {worlds[recording.world]['seed']}" if has_seed and recording.world < len(worlds) else ""
    about = f", world {recording.world}{seed}" if len(worlds) > 1 else seed
    return printable(recording.name)[:MAX_NAME] + about


def _wrapped(title: str) -> str:
    """A title in as many lines as it needs; one of very many letters ends after some."""
    wide = len(title) / max(1, cell_len(title))
    return "\n".join(textwrap.wrap(title, max(8, int(LETTERS * wide)), max_lines=MAX_LINES, placeholder=" …"))


def line_look(tracks: Trajectories, team: int, linewidth: float = 1.4) -> dict[str, Any]:
    """Line options of a team's curves."""
    return {
        "color": tracks.colours[team],
        "linestyle": DASHES[(team - 1) % len(DASHES)],
        "linewidth": linewidth,
    }


def line_sign(color: str, linewidth: float = 1.6, **options: Any) -> Any:
    """A line for a legend; its options are Matplotlib's."""
    from matplotlib.lines import Line2D

    return Line2D([], [], color=color, linewidth=linewidth, **options)


def mark_sign(marker: str, colour: str = MUTED, **options: Any) -> Any:
    """A marker for a legend."""
    return line_sign(colour, linestyle="none", marker=marker, **options)


def time_axis(axes: Axes, times: np.ndarray) -> None:
    """Let the x axis span ascending times [s]."""
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
    with whole_file(path) as part, lettering(figure) as missing:
        figure.savefig(part, format=form, metadata=UNDATED[form])
    return "".join(sorted(missing))
