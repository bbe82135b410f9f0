"""One page that plays a recorded run by itself: it can be mailed, and asks nobody for anything."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from tussle import __version__
from tussle.errors import ParameterError, ViewError
from tussle.view.export.packing import deflated
from tussle.view.export.still import (
    blocks_data,
    models_data,
    scenery_data,
    teams_data,
    terrain_bytes,
    terrain_note,
)
from tussle.view.export.tracks import FULL_HEALTH, UNIT, Grain, Packed, grain_of, pack
from tussle.view.frame import Frame
from tussle.view.recording import Recording

FORMAT = 1
"""Version of the data in a page, told to whoever reads it from there."""

SCRIPTS = (
    *("words.js", "geometry.js", "packing.js", "layer.js", "camera.js", "shaders.js", "drawing.js"),
    *("models.js", "scenery.js", "trails.js", "overlay.js", "happenings.js", "timeline.js", "panels.js"),
    *("steering.js", "keys.js", "actions.js", "player.js"),
)
"""Files of the player, in the order in which they stand on the page: all are one script, which shares nothing with anything else."""

LEAP_OF_EXTENT = 0.25
"""Share of the diagonal of all positions above which a move counts as a jump: across a closed world it is 0.57 or more."""


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
        notes: What is missing or left out, one line each, as the page says it.
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
    recording: Recording, path: str | Path, *, period: float | None = None, title: str | None = None
) -> HtmlExport:
    """Write the page of a recorded run. The same run and options give the same bytes.

    Positions are rounded to a centimetre or less, attitudes to some hundredths of a degree, health to 1/255 of the most that anybody
    had; the page says how far it may be off. Events are all kept.

    Args:
        recording: The run; of one that was cut short, what there is.
        path: The file, replaced where it is there.
        period: Time between frames that are kept [s]; None keeps all.
        title: Its heading; by default the recording's name.

    Raises:
        ParameterError: The period is not allowed.
        ViewError: There is nothing to show, or the file cannot be written.
    """
    if period is not None and not 0.0 < period < math.inf:
        raise ParameterError(f"period = {period!r} is not allowed; it takes a number of seconds > 0")
    kept = kept_frames(recording.t, period)
    if not len(kept):
        raise ViewError(f"{recording.path}: the run holds no states, so there is nothing to play")
    grain, scenery, looks = _grain(recording), recording.scenery, recording.looks
    leap = LEAP_OF_EXTENT * float(np.linalg.norm(np.subtract(*recording.extent)))
    packed = pack(_frames(recording, kept), grain, leap)
    note = terrain_note(scenery)
    notes = [*recording.notes, *looks.notes, *scenery.notes, *([note] if note else [])]
    blobs = {"index": packed.index, "happenings": deflated(_json(_happenings(recording)).encode())}
    blobs |= {f"piece-{i}": data for i, (_, _, data) in enumerate(packed.pieces)}
    terrain = terrain_bytes(scenery)
    blobs |= {} if terrain is None else {"terrain": terrain}
    blocks = blocks_data(recording, looks)
    document = {
        "format": FORMAT,
        "generator": f"tussle {__version__}",
        "title": recording.name if title is None else title,
        "layers": [
            _layer(recording, packed, grain, len(kept), period)
            | {"blocks": blocks, "teams": teams_data(recording, looks), "notes": notes}
        ],
        "models": models_data({block["model"] for block in blocks} | {"sphere"}),
        "scenery": scenery_data(scenery),
    }
    page = _page(document, blobs)
    n_bytes = _write(Path(path), page)
    return HtmlExport(
        Path(path), len(kept), packed.n_entities, packed.n_rows, n_bytes, grain.position_error,
        grain.angle_error, tuple(notes),
    )  # fmt: skip


def kept_frames(t: np.ndarray, period: float | None) -> np.ndarray:
    """Numbers of the frames that are kept: the first of each period, and the last.

    Args:
        t: Times of all frames [s], (T,), ascending.
        period: [s]; None keeps all.
    """
    if period is None or not len(t):
        return np.arange(len(t))
    number = np.floor((t - t[0]) / max(period, 1e-9 * float(t[-1] - t[0])) + 1e-6)
    is_kept = np.diff(number, prepend=-1.0) > 0.0
    is_kept[-1] = True
    return np.flatnonzero(is_kept)


def _frames(recording: Recording, kept: np.ndarray) -> Iterator[Frame]:
    for i in kept:
        yield recording.frame(int(i))


def _grain(recording: Recording) -> Grain:
    low, high = recording.extent
    smallest = min((recording.looks.scale(i) for i in range(len(recording.blocks))), default=1.0)
    chunks = recording.run.trajectory_table["health"].chunks
    most = [float(h[np.isfinite(h)].max(initial=0.0)) for h in (c.to_numpy() for c in chunks)]
    return grain_of(low, high, smallest, max(most, default=0.0))


# -- what the page says about the run -------------------------------------------------------------------------------------------


def _layer(
    recording: Recording, packed: Packed, grain: Grain, n_frames: int, period: float | None
) -> dict[str, Any]:
    """One recording; a page may come to hold several."""
    return {
        "name": recording.name,
        "facts": _facts(recording, packed, n_frames, period),
        "nFrames": n_frames,
        "nTracks": packed.n_tracks,
        "nEntities": packed.n_entities,
        "nStates": packed.n_rows,
        "low": list(grain.low),
        "step": grain.step,
        "attitudeUnit": UNIT,
        "healthSteps": FULL_HEALTH,
        "fullHealth": grain.full_health,
        "positionError": grain.position_error,
        "angleError": grain.angle_error,
        "pieces": [[first, last] for first, last, _ in packed.pieces],
        "isComplete": recording.run.is_complete,
    }


def _facts(
    recording: Recording, packed: Packed, n_frames: int, period: float | None
) -> list[tuple[str, str]]:
    """Names and values for the page's reader."""
    info, t = recording.run.info, recording.t
    worlds = info.get("worlds", [])
    facts = [("Run", recording.path.resolve().name), ("Mission", recording.name)]
    if recording.world < len(worlds):
        world = worlds[recording.world]
        facts.append(("Seed", str(world["seed"])))
        if len(worlds) > 1:
            facts.append(("World", f"{recording.world} of {len(worlds)}"))
    facts += [
        ("Time", f"{t[0]:g} s to {t[-1]:g} s"),
        (
            "Frames",
            _grouped(n_frames) + (f" of {_grouped(len(t))}, one every {period:g} s" if period else ""),
        ),
        ("Entities", f"{_grouped(packed.n_entities)}, in {_grouped(packed.n_rows)} states"),
    ]
    if info:
        facts.append(("Step", f"{recording.dt:g} s"))
        facts.append(("Played by", f"tussle {info.get('versions', {}).get('tussle', '')}".strip()))
    return facts


def _grouped(count: int) -> str:
    """A count with narrow spaces between thousands, as the page's script writes it."""
    return f"{count:,}".replace(",", "\u202f")


def _happenings(recording: Recording) -> dict[str, list[Any]]:
    """All happenings, as columns."""
    names = ("t", "kind", "id", "other", "text")
    return {name: [getattr(happening, name) for happening in recording.happenings] for name in names}


# -- the file -------------------------------------------------------------------------------------------------------------------


def _json(data: object) -> str:
    return json.dumps(data, separators=(",", ":"), allow_nan=False)


def _page(document: Mapping[str, Any], blobs: Mapping[str, bytes]) -> str:
    """The whole page."""
    folder = files("tussle.view.export").joinpath("page")
    read = {
        name: folder.joinpath(name).read_text(encoding="utf-8")
        for name in ("page.html", "page.css", *SCRIPTS)
    }
    script = "(() => {\n'use strict';\n" + "\n".join(read[name] for name in SCRIPTS) + "})();\n"
    style = read["page.css"]
    # Nothing is fetched, and nothing runs but this very script: what got in as text cannot.
    policy = (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )
    parts = {
        "policy": policy,
        "generator": escape(document["generator"]),
        "title": escape(document["title"]),
        "style": style,
        # No character that means something to HTML is left in it.
        "document": re.sub("[<>&]", lambda found: f"\\u{ord(found[0]):04x}", _json(document)),
        "blobs": "\n".join(_blob(name, data) for name, data in blobs.items()),
        "script": script,
    }
    return re.sub(r"\{\{(\w+)\}\}", lambda found: parts[found[1]], read["page.html"])


def _hash(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _blob(name: str, data: bytes) -> str:
    return (
        f'<script type="application/octet-stream" id="data-{name}">{base64.b64encode(data).decode()}</script>'
    )


def _write(path: Path, page: str) -> int:
    """Write a file whole or not at all; its size [B].

    Raises:
        ViewError: It cannot be written.
    """
    data, beside = page.encode(), path.with_name(path.name + ".part")
    try:
        beside.write_bytes(data)
        beside.replace(path)
    except OSError as error:
        beside.unlink(missing_ok=True)
        raise ViewError(f"{path}: the page cannot be written: {error.strerror or error}") from error
    return len(data)
