"""Tracks of entities and areas of a mission, by latitude and longitude."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from tussle.errors import MissingExtraError, ViewError
from tussle.record.schema import MISSION_FILE
from tussle.view.page.recorded import frames_to_write
from tussle.view.recording import Recording
from tussle.view.scenery import Region
from tussle.world.geodesy import Origin
from tussle.world.scene import Plane, Prism, Sphere, TriangleMesh

N_CIRCLE = 64
"""Corners of the polygon in place of a circle."""
DEGREE_DIGITS, HEIGHT_DIGITS = 10, 4
"""Decimals of degrees and of heights [m]: places are kept to a hundredth and a tenth of a millimetre."""


@dataclass(frozen=True, eq=False)
class Track:
    """The way of an entity.

    Attributes:
        entity: Its id.
        team: Its team.
        block: Name of its block.
        t: Times [s], (n,), n > 0.
        places: Longitude [deg], latitude [deg], height above the ellipsoid [m], (n, 3).
    """

    entity: int
    team: int
    block: str
    t: np.ndarray
    places: np.ndarray


@dataclass(frozen=True, eq=False)
class GeographicArea:
    """A base, boundary, wall or region of a plugin, as it is seen from above.

    Attributes:
        kind: "base", "boundary" or "wall".
        name: Its id or name.
        team: Its team; None without one.
        low: Its corners at its lower end, counter-clockwise from above, the first again at the end: see `Track.places`, (k, 3).
        high: The same at its upper end, (k, 3).
    """

    kind: str
    name: str
    team: int | None
    low: np.ndarray
    high: np.ndarray


def origin_of(recording: Recording) -> Origin:
    """The origin of a run's mission.

    Raises:
        ViewError: It has none, or the mission is not known.
    """
    mission = recording.mission
    if mission is None:
        raise ViewError(
            f"{recording.path}: {MISSION_FILE} cannot be read, so it is not known where on Earth the run was"
        )
    if mission.scene.origin.is_default:
        raise ViewError(
            f"{recording.path}: the mission has no origin, so the run is nowhere on Earth; set <latitude_origin> and <longitude_origin> "
            f"in {recording.path / MISSION_FILE}, or in the mission"
        )
    return mission.scene.origin


def to_places(origin: Origin, pos: np.ndarray) -> np.ndarray:
    """Places, as `Track.places`, of positions [m], (n, 3).

    Longitudes are within half a turn of the origin's, so no line goes around the Earth.
    """
    latitude, longitude, height = origin.to_geodetic(np.asarray(pos, np.float64).T)
    middle = math.remainder(math.degrees(origin.longitude), 360.0)
    turned = middle + (np.degrees(longitude) - middle + 180.0) % 360.0 - 180.0
    degrees = np.round(np.stack([turned, np.degrees(latitude)], axis=1), DEGREE_DIGITS)
    return np.column_stack([degrees, np.round(height, HEIGHT_DIGITS)])


def tracks_of(
    recording: Recording, period: float | None, show: Callable[[int, int], None] | None = None
) -> Iterator[Track]:
    """The tracks of all entities, in the order of their ids.

    Args:
        recording: The run.
        period: Time between states [s]; None keeps all.
        show: Called after each track with the numbers of tracks made and to make.

    Raises:
        ParameterError: The period is not allowed.
        ViewError: The run has no origin or no states, or a position is not finite.
    """
    origin = origin_of(recording)
    frames = [recording.frame(int(i)) for i in frames_to_write(recording, period)]
    who = np.concatenate([np.zeros(0, int), *(frame.id for frame in frames)])
    if not len(who):
        raise ViewError(f"{recording.path}: the run holds no states, so there is nothing to write")
    t = np.repeat([frame.t for frame in frames], [len(frame.id) for frame in frames])
    order = np.argsort(who, kind="stable")
    ids, first = np.unique(who[order], return_index=True)
    for n, (entity, rows) in enumerate(zip(ids.tolist(), np.split(order, first[1:]), strict=True), 1):
        if n == 1:
            pos, team, block = (
                np.concatenate([getattr(f, name) for f in frames]) for name in ("pos", "team", "block")
            )
            if not np.isfinite(pos).all():
                raise ViewError(
                    f"{recording.path}: a position is not finite, so it has no latitude and longitude"
                )
        places = to_places(origin, pos[rows])
        yield Track(entity, int(team[rows[0]]), recording.blocks[block[rows[0]]], t[rows], places)
        if show is not None:
            show(n, len(ids))


def areas_of(recording: Recording, notes: list[str]) -> Iterator[GeographicArea]:
    """Bases, boundaries, walls and regions of the mission.

    Args:
        recording: The run.
        notes: Receives a line on each that is left out.
    """
    origin, scenery = origin_of(recording), recording.scenery
    for number, base in enumerate(scenery.bases, 1):
        x, y, z = base.position
        ring = _ring(origin, _circle(x, y, base.radius), z)
        yield GeographicArea("base", f"base {number}", base.team, ring, ring)
    for region in scenery.boundaries:
        if isinstance(region.shape, (Plane, TriangleMesh)):
            what = "a plane has no edge" if isinstance(region.shape, Plane) else "it is a mesh"
            notes.append(f"{region.name or 'a region'} is left out: {what}")
            continue
        heights = region.mesh.vertices[:, 2]
        low, high = (_ring(origin, _footprint(region), float(z)) for z in (heights.min(), heights.max()))
        yield GeographicArea("wall" if region.is_wall else "boundary", region.name, region.team, low, high)


def _footprint(region: Region) -> np.ndarray:
    """Corners of what a bounded shape covers seen from above [m], (k, 2), counter-clockwise."""
    shape = region.shape
    if isinstance(shape, Sphere):
        return _circle(shape.center[0], shape.center[1], shape.radius)
    if isinstance(shape, Prism):
        corners = np.array(shape.corners)
        x, y = corners.T
        is_left = (x * np.roll(y, -1) - y * np.roll(x, -1)).sum() > 0.0
        return corners if is_left else corners[::-1]
    try:
        from scipy.spatial import ConvexHull
    except ImportError:
        raise MissingExtraError("the outlines of boundaries need scipy: pip install 'tussle[view]'") from None
    corners = region.mesh.vertices[:, :2].astype(float)
    return np.asarray(corners[ConvexHull(corners).vertices])


def _circle(x: float, y: float, radius: float) -> np.ndarray:
    """Corners of a polygon in place of a circle [m], (k, 2), counter-clockwise."""
    angle = 2.0 * np.pi * np.arange(N_CIRCLE) / N_CIRCLE
    return np.stack([x + radius * np.cos(angle), y + radius * np.sin(angle)], axis=1)


def _ring(origin: Origin, corners: np.ndarray, height: float) -> np.ndarray:
    """A closed ring of corners [m], (k, 2), at a height [m], as places, (k + 1, 3)."""
    closed = np.concatenate([corners, corners[:1]])
    return to_places(origin, np.column_stack([closed, np.full(len(closed), height)]))
