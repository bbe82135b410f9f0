"""Export of a recorded run as one HTML page that plays it offline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from tussle.view.export.whole_file import whole_file
from tussle.view.page.assemble import page_html
from tussle.view.page.chunks import ANGLE_ERROR, position_error
from tussle.view.page.compare import Comparison
from tussle.view.page.recorded import RecordedData, opening
from tussle.view.recording import Recording


@dataclass(frozen=True)
class HtmlExport:
    """A page that was written.

    Attributes:
        path: The file.
        n_frames: Frames in it.
        n_entities: Entities in it.
        n_states: Their states in all frames.
        n_bytes: Its size [B].
        position_error: Largest distance between a position on the page and the recorded one [m].
        angle_error: Largest angle between an attitude on the page and the recorded one [rad].
        notes: Missing parts, one line each, as on the page.
    """

    path: Path
    n_frames: int
    n_entities: int
    n_states: int
    n_bytes: int
    position_error: float
    angle_error: float
    notes: tuple[str, ...]


def write_html(
    recording: Recording | Comparison,
    path: str | Path,
    *,
    period: float | None = None,
    title: str | None = None,
) -> HtmlExport:
    """Write the page of a recorded run, or of two. The same run and options give the same bytes.

    Positions are rounded to a centimetre or less, attitudes to some hundredths of a degree, health to 1/255 of its maximum in
    neighbouring frames; the page states the errors. All events are kept.

    Args:
        recording: The run, complete or not; or two of them.
        path: The file; an existing one is replaced.
        period: Time between frames [s]; None keeps all frames.
        title: Its heading; by default the recording's name.

    Raises:
        ParameterError: The period is not allowed.
        ViewError: The run holds no states, or the file cannot be written.
    """
    data = RecordedData(recording, is_file=True, period=period, title=title)
    document = data.document(**opening(recording))
    blobs = {name: data.blob(name) or b"" for name in data.names}
    page = page_html(document, blobs).encode()
    with whole_file(Path(path)) as part:
        part.write_bytes(page)
    return HtmlExport(
        Path(path), document["nFrames"], sum(document["nEntities"]), document["nStates"], len(page),
        position_error(data.step), ANGLE_ERROR, tuple(document["notes"]),
    )  # fmt: skip
