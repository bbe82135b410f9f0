"""Tracks and areas as the texts of GeoJSON, KML and CZML, piece by piece."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import chain
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from tussle.view.export.geographic.places import GeographicArea, Track
from tussle.view.style import Colour

NO_XML = re.compile("[^\t\n\r\u0020-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""Characters that XML 1.0 does not have."""
NOBODY = (150, 160, 172)
"""Colour of what belongs to no team."""


@dataclass(frozen=True)
class Heading:
    """What is known of a run before its tracks.

    Attributes:
        name: Its title.
        teams: Names of the teams by their numbers.
        colour_of: Red, green, blue of a team, 0 to 255.
        epoch: Date and time of t = 0.
        span: First and last time [s].
    """

    name: str
    teams: dict[int, str]
    colour_of: Callable[[int], Colour]
    epoch: datetime
    span: tuple[float, float]

    def date(self, t: float) -> str:
        """A time [s] as ISO 8601."""
        moment = (self.epoch + timedelta(seconds=t)).astimezone(UTC)
        return moment.replace(tzinfo=None).isoformat(timespec="microseconds") + "Z"

    def colour(self, team: int | None) -> Colour:
        return NOBODY if team is None else self.colour_of(team)


def geojson(heading: Heading, tracks: Iterable[Track], areas: Iterable[GeographicArea]) -> Iterator[str]:
    """RFC 7946: a line for each entity, a point for one with a single state, a polygon for each area. Heights are above the ellipsoid."""
    yield '{"type":"FeatureCollection","features":[\n'
    features = chain(map(_area_feature, areas), map(_track_feature, tracks))
    yield from _separated(features)
    yield "\n]}\n"


def _track_feature(track: Track) -> dict[str, Any]:
    places = track.places.tolist()
    shape = (
        {"type": "LineString", "coordinates": places}
        if len(places) > 1
        else {"type": "Point", "coordinates": places[0]}
    )
    about = {
        "kind": "track",
        "entity": track.entity,
        "team": track.team,
        "block": track.block,
        "times": track.t.tolist(),
    }
    return {"type": "Feature", "geometry": shape, "properties": about}


def _area_feature(area: GeographicArea) -> dict[str, Any]:
    heights = {"low": float(area.low[:, 2].mean()), "high": float(area.high[:, 2].mean())}
    return {
        "type": "Feature",
        "geometry": {"type": "Polygon", "coordinates": [area.low.tolist()]},
        "properties": {"kind": area.kind, "name": area.name, "team": area.team, **heights},
    }


def czml(heading: Heading, tracks: Iterable[Track], areas: Iterable[GeographicArea]) -> Iterator[str]:
    """Cesium's language: a packet for each entity with samples of its position, and one for each area. Heights are above the ellipsoid."""
    interval = "/".join(map(heading.date, heading.span))
    clock = {
        "interval": interval,
        "currentTime": heading.date(heading.span[0]),
        "multiplier": 1,
        "range": "CLAMPED",
    }
    document = {"id": "document", "name": heading.name, "version": "1.0", "clock": clock}
    areas_as_packets = (_area_packet(heading, n, area) for n, area in enumerate(areas, 1))
    yield "[\n"
    yield from _separated(
        chain([document], areas_as_packets, (_track_packet(heading, track) for track in tracks))
    )
    yield "\n]\n"


def _track_packet(heading: Heading, track: Track) -> dict[str, Any]:
    colour = {"rgba": [*heading.colour(track.team), 255]}
    samples = np.column_stack([track.t, track.places]).ravel().tolist()
    return {
        "id": f"entity-{track.entity}",
        "name": f"{track.block} {track.entity}",
        "availability": f"{heading.date(float(track.t[0]))}/{heading.date(float(track.t[-1]))}",
        "position": {
            "epoch": heading.date(0.0), "interpolationAlgorithm": "LINEAR", "interpolationDegree": 1, "cartographicDegrees": samples,
        },
        "point": {"color": colour, "pixelSize": 7},
        "path": {"material": {"solidColor": {"color": colour}}, "width": 1.5, "leadTime": 0},
        "properties": {"entity": track.entity, "team": track.team, "block": track.block},
    }  # fmt: skip


def _area_packet(heading: Heading, number: int, area: GeographicArea) -> dict[str, Any]:
    colour = heading.colour(area.team)
    polygon: dict[str, Any] = {
        "positions": {"cartographicDegrees": area.low[:-1].ravel().tolist()},
        "height": float(area.low[:, 2].mean()),
        "material": {"solidColor": {"color": {"rgba": [*colour, 50]}}},
        "outline": True,
        "outlineColor": {"rgba": [*colour, 255]},
    }
    if area.kind != "base":
        polygon["extrudedHeight"] = float(area.high[:, 2].mean())
    about = {"kind": area.kind, "team": area.team}
    return {"id": f"area-{number}", "name": area.name, "polygon": polygon, "properties": about}


def _separated(objects: Iterable[dict[str, Any]]) -> Iterator[str]:
    for n, each in enumerate(objects):
        yield (",\n" if n else "") + json.dumps(each, allow_nan=False, separators=(",", ":"))


def kml(heading: Heading, tracks: Iterable[Track], areas: Iterable[GeographicArea]) -> Iterator[str]:
    """OGC 07-147r2 with Google's gx:Track: a track for each entity, in the colour of its team, and a polygon for each area."""
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2">\n'
    yield f"<Document>\n<name>{_text(heading.name)}</name>\n"
    for team in (None, *heading.teams):
        red, green, blue = heading.colour(team)
        colour = f"{blue:02x}{green:02x}{red:02x}"
        yield (
            f'<Style id="{_style(team)}"><IconStyle><color>ff{colour}</color><scale>0.5</scale></IconStyle>'
            f"<LineStyle><color>ff{colour}</color><width>2</width></LineStyle><PolyStyle><color>40{colour}</color></PolyStyle></Style>\n"
        )
    for area in areas:
        ring = " ".join(",".join(map(_number, place)) for place in _turned(area.low))
        yield _placemark(heading, area.name, area.team, {"kind": area.kind})
        yield (
            "<Polygon><altitudeMode>absolute</altitudeMode><outerBoundaryIs><LinearRing><coordinates>"
            f"{ring}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>\n"
        )
    for track in tracks:
        about = {"entity": track.entity, "team": track.team, "block": track.block}
        yield _placemark(heading, f"{track.block} {track.entity}", track.team, about)
        yield "<gx:Track><altitudeMode>absolute</altitudeMode>\n"
        yield "".join(f"<when>{heading.date(t)}</when>\n" for t in track.t.tolist())
        yield "".join(
            f"<gx:coord>{' '.join(map(_number, place))}</gx:coord>\n" for place in _turned(track.places)
        )
        yield "</gx:Track></Placemark>\n"
    yield "</Document>\n</kml>\n"


def _placemark(heading: Heading, name: str, team: int | None, about: dict[str, object]) -> str:
    """The beginning of a placemark."""
    style = _style(team if team in heading.teams else None)
    data = "".join(f'<Data name="{key}"><value>{_text(value)}</value></Data>' for key, value in about.items())
    return f"<Placemark><name>{_text(name)}</name><styleUrl>#{style}</styleUrl><ExtendedData>{data}</ExtendedData>"


def _style(team: int | None) -> str:
    return "no-team" if team is None else f"team{team}"


def _text(value: object) -> str:
    return escape(NO_XML.sub("\ufffd", str(value)))


def _number(value: float) -> str:
    """A number without an exponent, which not all readers of KML know."""
    return f"{value:.10f}".rstrip("0").rstrip(".")


def _turned(places: np.ndarray) -> list[list[float]]:
    """Places with longitudes from -180 to 180 degrees, which are all that KML allows, (n, 3)."""
    longitude = (places[:, 0] + 180.0) % 360.0 - 180.0
    return np.column_stack([longitude, places[:, 1:]]).tolist()  # type: ignore[no-any-return]
