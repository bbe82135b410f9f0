"""A recording's plots as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tussle.documents import several
from tussle.errors import ParameterError, ViewError, listed, nearest_name
from tussle.view.plots.columns import column, column_of_runs, parts_of
from tussle.view.plots.counts import captures, has_captures, left
from tussle.view.plots.curves import altitude, distance, speed
from tussle.view.plots.maps import MAX_TRAJECTORIES, density, trajectory, trajectory3d
from tussle.view.plots.selection import Selection, Trajectories
from tussle.view.plots.sheet import FORMATS, plot_style, save
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOTS: Mapping[str, Callable[[Trajectories], Figure]] = {
    "trajectory": trajectory,
    "trajectory3d": trajectory3d,
    "speed": speed,
    "altitude": altitude,
    "left": left,
    "captures": captures,
    "density": density,
}
DISTANCE = "distance"
KINDS = (*PLOTS, DISTANCE)
"""Names of the plots."""
FLAT = 1e-3
"""Heights that differ by less are equal [m]."""


@dataclass(frozen=True)
class Plots:
    """Plots that were written.

    Attributes:
        files: The files, in the order of their kinds.
        notes: What the user should know, one line each.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def write_plots(
    recording: Recording,
    directory: str | Path,
    kinds: Sequence[str] = (),
    selection: Selection | None = None,
    between: tuple[int, int] | None = None,
    form: str = "png",
    columns: Sequence[str] = (),
    others: Sequence[Recording] = (),
) -> Plots:
    """Write plots of a recording, one file each; the same recording gives the same bytes.

    Args:
        recording: The recorded run.
        directory: Directory of the files; made if it does not exist.
        kinds: Plots, of `KINDS`; by default the distance if two entities are given, else all that have data, unless columns are given.
        selection: Entities and times.
        between: Ids of the two whose distance is plotted.
        form: "png", "svg" or "pdf".
        columns: Columns that are plotted over time, see `tussle.view.plots.columns.column`.
        others: Further runs, whose columns are plotted with those of the first as means of each run.

    Raises:
        ParameterError: A plot, format, team or entity does not exist, or the selection is empty.
        ViewError: Nothing was recorded, or a file cannot be written.
        MissingExtraError: Matplotlib is not installed.
    """
    kinds, columns = several(kinds), several(columns)
    _check(kinds, between, form)
    if others and (kinds or between or not columns):
        raise ParameterError(
            "of several runs only columns are plotted: give at least one, and no other plots"
        )
    for each in (recording, *others):
        for name in columns:
            parts_of(each, name)
    chosen = selection or Selection()
    is_all = not kinds and between is None and not columns
    names = list(dict.fromkeys(kinds)) or ([DISTANCE] if between else list(PLOTS) if is_all else [])
    notes: list[str] = []
    with plot_style():
        tracks = Trajectories(recording, chosen) if set(names) - {DISTANCE} else None
        if is_all and tracks is not None:
            names, notes = _with_data(tracks)
        place = Path(directory)
        try:
            place.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise ViewError(f"{place}: the plots cannot be written: {error.strerror or error}") from error
        files, missing = [], set()
        world = f"-world-{recording.world}" if recording.world else ""
        for name in dict.fromkeys(columns):
            figure = (
                column_of_runs([recording, *others], name, chosen)
                if others
                else column(recording, name, chosen)
            )
            files.append(place / f"{name.replace('/', '_')}{world}.{form}")
            missing |= set(save(figure, files[-1], form))
        for name in names:
            if name == DISTANCE:
                assert between is not None
                figure, suffix = distance(recording, *between, chosen), "-{}-{}".format(*between)
            else:
                assert tracks is not None
                figure, suffix = PLOTS[name](tracks), ""
            files.append(place / f"{name}{suffix}{world}.{form}")
            missing |= set(save(figure, files[-1], form))
    if tracks is not None:
        notes += _notes_of_lines(tracks, names)
    if missing:
        notes.append(f"the font has no {''.join(sorted(missing))}")
    return Plots(tuple(files), (*dict.fromkeys(recording.notes), *notes))


def _check(kinds: Sequence[str], between: tuple[int, int] | None, form: str) -> None:
    if form not in FORMATS:
        raise ParameterError(f"there is no format {form!r}{nearest_name(form, FORMATS)}; {listed(FORMATS)}")
    for kind in kinds:
        if kind not in KINDS:
            raise ParameterError(f"there is no plot {kind!r}{nearest_name(kind, KINDS)}; {listed(KINDS)}")
    if DISTANCE in kinds and between is None:
        raise ParameterError("the plot 'distance' is of two entities, and none are given")
    if between is not None and kinds and DISTANCE not in kinds:
        raise ParameterError(
            f"two entities are given, whose distance is plotted, but 'distance' is not among the plots: {', '.join(kinds)}"
        )


def _with_data(tracks: Trajectories) -> tuple[list[str], list[str]]:
    """The plots that have data, and notes on the others."""
    names, notes = list(PLOTS), []
    height = tracks.column("z")
    if np.ptp(height) < FLAT:
        names = [name for name in names if name not in ("altitude", "trajectory3d")]
        notes.append(
            f"altitude and trajectory3d are left out: all are at {height[0]:g} m; kinds that are named are always drawn"
        )
    if tracks.selection.entities:
        names = [name for name in names if name not in ("left", "captures")]
    elif not has_captures(tracks):
        names.remove("captures")
    return names, notes


def _notes_of_lines(tracks: Trajectories, names: Sequence[str]) -> list[str]:
    """A note if not all trajectories are drawn."""
    if len(tracks) <= MAX_TRAJECTORIES or not {"trajectory", "trajectory3d"} & set(names):
        return []
    return [
        f"{MAX_TRAJECTORIES} of {len(tracks)} trajectories are drawn, evenly spaced by id; select teams or entities to see others"
    ]
