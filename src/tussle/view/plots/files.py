"""A recording's plots as files."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from tussle.errors import ParameterError, ViewError, listed, nearest_name
from tussle.view.plots.choice import Choice, Tracks
from tussle.view.plots.counts import captures, has_captures, left
from tussle.view.plots.curves import altitude, distance, speed
from tussle.view.plots.maps import MOST_TRACKS, density, trajectory, trajectory3d
from tussle.view.plots.sheet import check_format, plot_style, save
from tussle.view.recording import Recording

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PLOTS: Mapping[str, Callable[[Tracks], Figure]] = {
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
"""Heights that differ by less are one [m]."""


@dataclass(frozen=True)
class Plots:
    """Plots that have been written.

    Attributes:
        files: The files, in the order of their kinds.
        notes: What who looks at them should know, one line each.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def write_plots(
    recording: Recording,
    directory: str | Path,
    kinds: Sequence[str] = (),
    choice: Choice | None = None,
    between: tuple[int, int] | None = None,
    form: str = "png",
) -> Plots:
    """Write plots of a recording, one file each; the same recording gives the same bytes.

    Args:
        recording: What was recorded.
        directory: Where to; made if need be.
        kinds: Which plots, of `KINDS`; by default the distance where two entities are given, else all that show something.
        choice: Who is plotted, and when.
        between: Ids of the two whose distance is plotted.
        form: "png", "svg" or "pdf".

    Raises:
        ParameterError: There is no such plot, format, team or entity, or nothing of what was recorded is chosen.
        ViewError: Nothing was recorded, or a file cannot be written.
        MissingExtraError: Matplotlib is not installed.
    """
    check_format(form)
    _check_kinds(kinds, between)
    chosen = choice or Choice()
    is_all = not kinds and between is None
    names = list(dict.fromkeys(kinds)) or ([DISTANCE] if between else list(PLOTS))
    notes: list[str] = []
    with plot_style():
        tracks = Tracks(recording, chosen) if names != [DISTANCE] else None
        if is_all and tracks is not None:
            names, notes = _worth_showing(tracks)
        place = _made(Path(directory))
        files, missing = [], set()
        for name in names:
            if name == DISTANCE:
                assert between is not None
                figure, suffix = distance(recording, *between, chosen), "-{}-{}".format(*between)
            else:
                assert tracks is not None
                figure, suffix = PLOTS[name](tracks), ""
            world = f"-world-{recording.world}" if recording.world else ""
            files.append(place / f"{name}{suffix}{world}.{form}")
            missing |= set(save(figure, files[-1], form))
    if tracks is not None:
        notes += _notes_of_ways(tracks, names)
    if missing:
        notes.append(f"the font has no {''.join(sorted(missing))}")
    return Plots(tuple(files), (*dict.fromkeys(recording.notes), *notes))


def _check_kinds(kinds: Sequence[str], between: tuple[int, int] | None) -> None:
    for kind in kinds:
        if kind not in KINDS:
            raise ParameterError(f"there is no plot {kind!r}{nearest_name(kind, KINDS)}; {listed(KINDS)}")
    if DISTANCE in kinds and between is None:
        raise ParameterError("the plot 'distance' is of two entities, and none are given")
    if between is not None and kinds and DISTANCE not in kinds:
        raise ParameterError(
            f"two entities are given, whose distance is plotted, but 'distance' is not among the plots: {', '.join(kinds)}"
        )


def _worth_showing(tracks: Tracks) -> tuple[list[str], list[str]]:
    """The plots that show something, and why the others do not."""
    names, notes = list(PLOTS), []
    height = tracks.column("z")
    if np.ptp(height) < FLAT:
        names = [name for name in names if name not in ("altitude", "trajectory3d")]
        notes.append(
            f"altitude and trajectory3d are left out: all are at {height[0]:g} m; kinds that are named are drawn all the same"
        )
    if tracks.choice.entities:
        names = [name for name in names if name not in ("left", "captures")]
    elif not has_captures(tracks):
        names.remove("captures")
    return names, notes


def _notes_of_ways(tracks: Tracks, names: Sequence[str]) -> list[str]:
    """That not all ways are drawn, if so."""
    if len(tracks) <= MOST_TRACKS or not {"trajectory", "trajectory3d"} & set(names):
        return []
    return [
        f"{MOST_TRACKS} of {len(tracks)} ways are drawn, evenly through all ids; choose teams or entities to see others"
    ]


def _made(directory: Path) -> Path:
    try:
        directory.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ViewError(f"{directory}: the plots cannot be written: {error.strerror or error}") from error
    return directory
