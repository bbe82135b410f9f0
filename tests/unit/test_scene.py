"""Where the world lies on Earth, convex shapes, and the scene they make up."""

from __future__ import annotations

import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tussle.errors import ParameterError
from tussle.scene import Base, Cuboid, FlatGround, Origin, Plane, Polyhedron, Scene, Sphere, Volume

CUBE = tuple((x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0))
SHAPES: tuple[Volume, ...] = (
    FlatGround(3.0),
    Plane((1.0, 2.0, 3.0), (1.0, -2.0, 0.5)),
    Cuboid((5.0, -3.0, 1.0), (4.0, 2.0, 6.0), (0.3, -0.7, 2.0)),
    Polyhedron(((0.0, 0.0, 0.0), (4.0, 0.0, 0.0), (0.0, 5.0, 0.0), (1.0, 1.0, 6.0), (1.0, 1.0, 1.0))),
    Sphere((1.0, 2.0, 3.0), 4.0),
)


def columns(*points: tuple[float, float, float]) -> np.ndarray:
    return np.array(points, np.float64).T


# -- Earth ---------------------------------------------------------------------------------------------------------------


def test_local_position_of_a_published_example() -> None:
    # The example of the manual of GeographicLib's CartConvert, to its two printed decimals.
    pos = Origin.from_degrees(33.0, 44.0, 20.0).from_geodetic(
        columns((math.radians(33.3), math.radians(44.4), 6000.0))
    )
    np.testing.assert_allclose(pos[:, 0], [37288.97, 33374.29, 5783.64], rtol=0.0, atol=0.01)


@pytest.mark.parametrize(
    ("origin", "point", "pos"),
    [
        (
            (33.0, 44.0, 20.0),
            (33.3, 44.4, 6000.0),
            (37288.9731966232283, 33374.2949469043575, 5783.6466155181825),
        ),
        (
            (48.8, 2.35, 35.0),
            (50.9, 1.8, 0.0),
            (-38691.0610441877678, 233662.3484833635055, -4437.5865705123863),
        ),
        (
            (-35.3, 149.1, 600.0),
            (-33.9, 151.2, 1200.0),
            (194228.1081604110950, 153263.4049672770024, -4202.9176876439307),
        ),
    ],
)
def test_local_position_against_sixty_digits(
    origin: tuple[float, float, float], point: tuple[float, float, float], pos: tuple[float, float, float]
) -> None:
    # Computed with Python's decimal arithmetic of 60 digits, sine and cosine by their series.
    geodetic = columns((math.radians(point[0]), math.radians(point[1]), point[2]))
    frame = Origin.from_degrees(*origin)
    np.testing.assert_allclose(frame.from_geodetic(geodetic)[:, 0], pos, rtol=0.0, atol=5e-9)
    # On the ground, 5e-9 m are this much of latitude and longitude, beside an ulp of the angle itself.
    metres = np.array([[6.3e6], [6.3e6 * math.cos(math.radians(point[0]))], [1.0]])
    np.testing.assert_allclose(
        metres * frame.to_geodetic(columns(pos)), metres * geodetic, rtol=3e-16, atol=5e-9
    )


def test_axes_of_earth() -> None:
    equator = Origin(0.0, 0.0, 0.0)
    pole, east = equator.from_geodetic(columns((math.pi / 2, 0.0, 0.0), (0.0, math.pi / 2, 100.0))).T
    np.testing.assert_allclose(pole, [0.0, 6356752.314245179, -6378137.0], atol=1e-8)
    np.testing.assert_allclose(east, [6378237.0, 0.0, -6378137.0], atol=1e-8)


def test_origin_is_the_origin_and_up_is_altitude() -> None:
    origin = Origin.from_degrees(35.721025, -120.767925, 300.0)
    heights = np.array([0.0, 10.0, 1e4, -500.0])
    latitude, longitude, altitude = origin.to_geodetic(np.stack([0.0 * heights, 0.0 * heights, heights]))
    np.testing.assert_allclose(latitude, origin.latitude, rtol=0.0, atol=4e-16)
    np.testing.assert_allclose(longitude, origin.longitude, rtol=0.0, atol=4e-16)
    np.testing.assert_allclose(altitude, 300.0 + heights, rtol=0.0, atol=4e-9)


def test_tangent_plane_leaves_earth() -> None:
    # z is height over the tangent plane: 10 km to the east the ground has sunk by d^2 / 2N, N the prime vertical radius.
    origin = Origin.from_degrees(45.0, 7.0)
    altitude = origin.to_geodetic(columns((10_000.0, 0.0, 0.0)))[2, 0]
    prime_vertical = 6378137.0 / math.sqrt(1.0 - 6.69437999014e-3 * 0.5)
    assert altitude == pytest.approx(10_000.0**2 / (2.0 * prime_vertical), abs=1e-4)


@given(
    st.floats(-90.0, 90.0),
    st.floats(-180.0, 180.0),
    st.floats(-90.0, 90.0),
    st.floats(-179.0, 180.0),
    st.floats(-20e3, 1e6),
)
def test_there_and_back_anywhere_on_earth(
    lat0: float, lon0: float, lat: float, lon: float, altitude: float
) -> None:
    origin = Origin.from_degrees(lat0, lon0, 100.0)
    pos = origin.from_geodetic(columns((math.radians(lat), math.radians(lon), altitude)))
    again = origin.from_geodetic(origin.to_geodetic(pos))
    # Coordinates of 6e6 m have an ulp of 1e-9 m; a dozen operations either way.
    np.testing.assert_allclose(again, pos, rtol=0.0, atol=2e-8)
    assert origin.to_geodetic(pos)[2, 0] == pytest.approx(altitude, abs=2e-8)


def test_one_point_has_the_bits_of_a_row_of_many() -> None:
    origin = Origin.from_degrees(35.7, -120.8, 300.0)
    pos = np.random.default_rng(1).normal(0.0, 1e4, (3, 37))
    many = origin.to_geodetic(pos)
    one = np.stack([origin.to_geodetic(p) for p in pos.T], axis=1)
    assert many.tobytes() == np.ascontiguousarray(one).tobytes()


@pytest.mark.parametrize(
    "values", [(35.7, 0.0, 0.0), (0.0, -120.0, 0.0), (0.0, math.nan, 0.0), (0.0, 0.0, math.inf)]
)
def test_origin_in_degrees_by_mistake_or_not_finite(values: tuple[float, float, float]) -> None:
    with pytest.raises(ParameterError, match=r"Origin\.\w+ = .* is not allowed"):
        Origin(*values)


# -- shapes --------------------------------------------------------------------------------------------------------------


def test_ground_contains_what_is_below_it() -> None:
    assert FlatGround(2.0).contains(columns((0, 0, 1.9), (0, 0, 2.0), (9, 9, 2.1))).tolist() == [
        True,
        False,
        False,
    ]


def test_ground_is_met_from_above_and_below_and_not_by_level_rays() -> None:
    start = columns((0, 0, 12), (0, 0, -8), (0, 0, 12), (0, 0, 12), (0, 0, 12))
    direction = columns((3, 0, -4), (0, 0, 1), (1, 0, 0), (0, 0, 1), (0, 0, 0))
    assert FlatGround(2.0).ray(start, direction).tolist() == [12.5, 10.0, math.inf, math.inf, math.inf]


def test_plane_contains_what_is_behind_its_normal() -> None:
    plane = Plane(point=(1.0, 0.0, 0.0), normal=(5.0, 0.0, 0.0))
    assert plane.contains(columns((0.9, 7, 7), (1.0, 7, 7), (1.1, 7, 7))).tolist() == [True, False, False]
    assert plane.ray(columns((3, 0, 0), (3, 0, 0)), columns((-1, 0, 0), (1, 0, 0))).tolist() == [
        2.0,
        math.inf,
    ]


def test_cuboid_turns() -> None:
    turned = Cuboid((10.0, 0.0, 0.0), (8.0, 2.0, 2.0), (0.0, 0.0, math.pi / 2))
    points = columns((10.0, 3.9, 0.0), (13.9, 0.0, 0.0), (10.0, 0.0, 0.9), (10.0, 0.0, 1.1))
    assert turned.contains(points).tolist() == [True, False, True, False]
    flat = Cuboid((10.0, 0.0, 0.0), (8.0, 2.0, 2.0))
    assert flat.contains(points).tolist() == [False, True, True, False]


def test_positive_pitch_of_a_cuboid_turns_its_front_down() -> None:
    turned = Cuboid((0.0, 0.0, 0.0), (8.0, 1.0, 1.0), (0.0, math.pi / 4, 0.0))
    assert turned.contains(columns((2.0, 0.0, -2.0), (2.0, 0.0, 2.0))).tolist() == [True, False]


def test_positive_roll_of_a_cuboid_turns_its_left_side_up() -> None:
    turned = Cuboid((0.0, 0.0, 0.0), (1.0, 8.0, 1.0), (math.pi / 4, 0.0, 0.0))
    assert turned.contains(columns((0.0, 2.0, 2.0), (0.0, 2.0, -2.0))).tolist() == [True, False]


def test_surface_is_outside() -> None:
    box = Cuboid((0.0, 0.0, 0.0), (2.0, 2.0, 2.0))
    assert box.contains(
        columns((1, 0, 0), (0, -1, 0), (0, 0, 1), (np.nextafter(1.0, 0.0), 0, 0))
    ).tolist() == [False, False, False, True]
    assert Sphere((0.0, 0.0, 0.0), 1.0).contains(
        columns((1, 0, 0), (0, np.nextafter(1.0, 0.0), 0))
    ).tolist() == [False, True]


@pytest.mark.parametrize(
    ("shape", "way"),
    [
        (Plane((1.0, 0.0, 0.0), (2.0, 0.0, 0.0)), (-1.0, 0.0, 0.0)),
        (FlatGround(2.0), (0.0, 0.0, -1.0)),
        (Polyhedron(tuple(itertools.product((-1.0, 1.0), repeat=3))), (-1.0, -1.0, -1.0)),
        (Cuboid((1.0, 2.0, 3.0)), (-8.0, -7.0, -6.0)),
        (Sphere((1.0, 2.0, 3.0)), (-8.0, -7.0, -6.0)),
    ],
)
def test_a_way_leads_inside(shape: Volume, way: tuple[float, float, float]) -> None:
    assert shape.inward(columns((9.0, 9.0, 9.0)))[:, 0] == pytest.approx(way)


def test_rays_at_a_box() -> None:
    box = Cuboid((10.0, 0.0, 0.0), (2.0, 2.0, 2.0))
    start = columns((0, 0, 0), (0, 0, 0), (10, 0, 0), (0, 0, 0), (0, 3, 0), (0, 3, 0), (20, 0, 0))
    direction = columns((7, 0, 0), (-1, 0, 0), (0, 0.1, 0), (1, 1, 0), (1, 0, 0), (3, -1, 0), (-1, 0, 0))
    distance = box.ray(start, direction)
    np.testing.assert_allclose(
        distance, [9.0, np.inf, 1.0, np.inf, np.inf, math.hypot(9, 3), 9.0], rtol=1e-15
    )


def test_polyhedron_of_a_cube_is_the_cube() -> None:
    cube, box = Polyhedron((*CUBE, (0.1, 0.2, 0.3), CUBE[0])), Cuboid(lengths=(2.0, 2.0, 2.0))
    assert len(cube.half_spaces()) == 6
    rng = np.random.default_rng(2)
    pos, direction = rng.uniform(-2.0, 2.0, (3, 500)), rng.normal(0.0, 1.0, (3, 500))
    assert cube.contains(pos).tolist() == box.contains(pos).tolist()
    np.testing.assert_allclose(cube.ray(pos, direction), box.ray(pos, direction), rtol=1e-12)


def test_polyhedron_far_from_the_origin_keeps_its_faces() -> None:
    far = Polyhedron(tuple((x + 1e5, y - 3e5, z) for x, y, z in CUBE))
    assert len(far.half_spaces()) == 6
    assert far.contains(columns((1e5, -3e5, 0.0), (1e5 + 1.1, -3e5, 0.0))).tolist() == [True, False]


def test_sphere_is_met_from_outside_and_inside() -> None:
    ball = Sphere((10.0, 0.0, 0.0), 2.0)
    start = columns((0, 0, 0), (10, 0, 0), (0, 3, 0), (20, 0, 0), (0, 0, 0))
    direction = columns((2, 0, 0), (0, 0, 3), (1, 0, 0), (1, 0, 0), (0, 0, 0))
    assert ball.ray(start, direction).tolist() == [8.0, 2.0, math.inf, math.inf, math.inf]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_ray_ends_where_containment_changes(shape: Volume) -> None:
    rng = np.random.default_rng(3)
    start = rng.uniform(-8.0, 8.0, (3, 400))
    direction = rng.uniform(-3.0, 8.0, (3, 400)) - start
    distance = shape.ray(start, direction)
    hit = np.isfinite(distance)
    assert hit.sum() > 20
    unit = direction / np.sqrt((direction**2).sum(axis=0))
    reach = np.where(hit, distance, 0.0)
    before, after = start + (reach - 1e-6) * unit, start + (reach + 1e-6) * unit
    assert (shape.contains(before)[hit] != shape.contains(after)[hit]).all()
    inside = shape.contains(start)
    on_the_way = start + rng.uniform(0.0, 1.0, 400) * np.where(hit, distance, 50.0) * unit
    assert (shape.contains(on_the_way) == inside).all()


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_shapes_do_not_care_where_a_row_stands(shape: Volume) -> None:
    rng = np.random.default_rng(4)
    start, direction = rng.uniform(-8.0, 8.0, (3, 33)), rng.normal(0.0, 1.0, (3, 33))
    together = shape.ray(start, direction)
    alone = np.concatenate([shape.ray(start[:, i : i + 1], direction[:, i : i + 1]) for i in range(33)])
    assert together.tobytes() == alone.tobytes()


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_kernels_say_what_arrays_say(shape: Volume) -> None:
    """Bit for bit, at random places and at such that lie on surfaces, beside them, and nowhere."""
    rng = np.random.default_rng(5)
    n = 40_000
    a = rng.normal(0.0, 5.0, (3, n))
    b = a + rng.normal(0.0, 5.0, (3, n)) * rng.choice([0.0, 1e-9, 1.0], n)
    a[:, : n // 4], b[:, : n // 4] = np.round(a[:, : n // 4]), np.round(b[:, : n // 4])
    for k, odd in enumerate((np.nan, np.inf, -np.inf, 1e300, 1e-300)):
        a[k % 3, k * 100 : k * 100 + 60] = odd
        b[(k + 1) % 3, k * 100 + 40 : k * 100 + 100] = odd
    with np.errstate(all="ignore"):
        if isinstance(shape, Sphere):
            x, y, z = (p - c for p, c in zip(a, shape.center, strict=True))
            inside = np.sqrt(x * x + y * y + z * z) < shape.radius
        else:
            faces = shape.half_spaces()
            inside = np.all([m[0] * a[0] + m[1] * a[1] + m[2] * a[2] < d for m, d in faces], axis=0)
        way = Volume.crossed(shape, a, b)
    assert (shape.contains(a) == inside).all()
    assert (shape.crossed(a, b) == way).all()
    assert 100 < way.sum() < n - 100
    alone = [bool(shape.crossed(a[:, i], b[:, i])) for i in range(0, n, 1000)]
    assert alone == way[::1000].tolist()


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_nan_is_nowhere(shape: Volume) -> None:
    lost = np.full((3, 1), np.nan)
    assert shape.contains(lost).tolist() == [False]
    assert shape.ray(lost, columns((1.0, 2.0, 3.0))).tolist() == [math.inf]
    assert shape.ray(columns((1.0, 2.0, 3.0)), lost).tolist() == [math.inf]


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: type(s).__name__)
def test_shapes_are_values(shape: Volume) -> None:
    shape.contains(np.zeros((3, 1)))
    again = pickle.loads(pickle.dumps(shape))
    assert again == shape
    assert hash(again) == hash(shape)


@pytest.mark.parametrize(
    ("make", "place"),
    [
        (lambda: FlatGround(math.nan), "FlatGround.height"),
        (lambda: Sphere(radius=0.0), "Sphere.radius"),
        (lambda: Sphere(center=(0.0, 0.0)), "Sphere.center"),
        (lambda: Cuboid(lengths=(1.0, 0.0, 1.0)), "Cuboid.lengths"),
        (lambda: Plane((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), "Plane.normal"),
        (lambda: Polyhedron(CUBE[:3]), "Polyhedron.points has 3"),
        (lambda: Polyhedron(CUBE[:4]), "all of them lie in one plane"),
        (lambda: Polyhedron((*CUBE, (0.0, 0.0, math.inf))), r"Polyhedron.points\[8\]"),
        (lambda: Polyhedron(CUBE * 5), "it takes 4 to 32"),
        (lambda: Base(1, (0.0, 0.0, 0.0), opacity=1.5), "Base.opacity"),
        (lambda: Base(1, (0.0, 0.0, 0.0), radius=-1.0), "Base.radius"),
    ],
)
def test_shapes_refuse_what_cannot_be(make, place: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(ParameterError, match=place):
        make()


# -- scene ---------------------------------------------------------------------------------------------------------------


def test_scene_answers_for_its_parts() -> None:
    scene = Scene(
        ground=FlatGround(0.0),
        walls=[Cuboid((10.0, 0.0, 5.0), (2.0, 20.0, 10.0))],
        boundaries={1: Sphere(radius=3.0), "field": Cuboid(lengths=(100.0, 100.0, 100.0))},
        bases=[Base(1, (0.0, 0.0, 0.0)), Base(2, (9.0, 0.0, 0.0), radius=5.0), Base(1, (3.0, 0.0, 0.0))],
    )
    start, direction = columns((0, 0, 5), (0, 0, 5), (0, 0, 5)), columns((1, 0, 0), (0, 0, -1), (-1, 0, 0))
    assert scene.cast(start, direction).distance.tolist() == [9.0, 5.0, math.inf]
    assert scene.contains(1, columns((2, 0, 0), (4, 0, 0))).tolist() == [True, False]
    assert scene.contains("field", columns((2, 0, 0), (60, 0, 0))).tolist() == [True, False]
    assert [base.position[0] for base in scene.bases_of(1)] == [0.0, 3.0]
    assert scene.bases_of(3) == ()
    assert pickle.loads(pickle.dumps(scene)) == scene


def test_empty_scene_stops_no_ray() -> None:
    assert Scene().cast(np.zeros((3, 2)), columns((0, 0, -1), (1, 0, 0))).distance.tolist() == [
        math.inf,
        math.inf,
    ]


def test_unknown_boundary_names_the_nearest() -> None:
    with pytest.raises(ParameterError, match=r"no boundary 'feild' \(did you mean 'field'\?\)"):
        Scene(boundaries={1: Sphere(), "field": Sphere()}).boundary("feild")


@pytest.mark.parametrize(
    "pos", [[1.0, -2.0, 300.0], [[1.0, 4.0], [-2.0, 5.0], [300.0, 6.0]]], ids=["one", "two"]
)
def test_earth_centred_positions_have_the_shape_of_what_is_given(pos):
    origin = Origin.from_degrees(-33.9, 151.2, 40.0)
    latitude, longitude, altitude = origin.to_geodetic(pos)
    curvature = 6378137.0 / np.sqrt(1.0 - 6.69437999014e-3 * np.sin(latitude) ** 2)
    out = (curvature + altitude) * np.cos(latitude)
    up = (curvature * (1.0 - 6.69437999014e-3) + altitude) * np.sin(latitude)
    expected = np.array([out * np.cos(longitude), out * np.sin(longitude), up])
    found = origin.to_earth_centred(pos)
    assert found.shape == np.shape(pos)
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-6)
    np.testing.assert_allclose(origin.from_earth_centred(found.tolist()), pos, rtol=0.0, atol=1e-6)
