"""Writing of a run for maps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path

from tussle.errors import ParameterError, ViewError, listed, nearest_name
from tussle.view.export.geographic.formats import Heading, czml, geojson, kml
from tussle.view.export.geographic.places import areas_of, origin_of, tracks_of
from tussle.view.export.whole_file import whole_file
from tussle.view.recording import Recording

FORMATS = {"geojson": geojson, "kml": kml, "czml": czml}
DEFAULT_EPOCH = datetime(2000, 1, 1, tzinfo=UTC)
"""Date and time of t = 0; simulated time has none of its own."""


@dataclass
class GeographicExport:
    """A file that was written.

    Attributes:
        path: The file.
        n_tracks: Entities in it.
        n_areas: Bases, boundaries and walls in it.
        notes: What is left out, one line each.
    """

    path: Path
    n_tracks: int = 0
    n_areas: int = 0
    notes: list[str] = field(default_factory=list)


def write_geographic(
    recording: Recording,
    path: str | Path,
    kind: str,
    *,
    period: float | None = None,
    epoch: datetime = DEFAULT_EPOCH,
    show: Callable[[int, int], None] | None = None,
) -> GeographicExport:
    """Write the tracks of a run, complete or not, and the geometry of its mission by latitude and longitude.

    One track at a time is converted and written. The same run and options give the same bytes.

    Args:
        recording: The run.
        path: The file; an existing one is replaced.
        kind: "geojson", "kml" or "czml".
        period: Time between states [s]; None keeps all.
        epoch: Date and time of t = 0, in KML and CZML; one without a zone is UTC.
        show: Called after each track with the numbers of tracks written and to write.

    Raises:
        ParameterError: The kind does not exist.
        ViewError: The mission has no origin, the run has no states or none that can be written, or the file cannot be written.
    """
    if kind not in FORMATS:
        raise ParameterError(
            f"kind = {kind!r} is not allowed{nearest_name(kind, FORMATS)}; {listed(FORMATS)}"
        )
    origin_of(recording)
    report = GeographicExport(Path(path))
    epoch = epoch if epoch.tzinfo else epoch.replace(tzinfo=UTC)
    span = (float(recording.t[0]), float(recording.t[-1])) if recording.n_frames else (0.0, 0.0)
    heading = Heading(recording.name, recording.teams, recording.style.colour, epoch, span)
    areas = list(areas_of(recording, report.notes))
    report.n_areas = len(areas)

    def count(done: int, of: int) -> None:
        report.n_tracks = done
        if show is not None:
            show(done, of)

    try:
        with whole_file(report.path) as part, part.open("w", encoding="utf-8", newline="\n") as file:
            file.writelines(FORMATS[kind](heading, tracks_of(recording, period, count), areas))
    except OverflowError:
        raise ViewError(f"{recording.path}: t = {span[1]:g} s after {epoch.isoformat()} is no date") from None
    return report
