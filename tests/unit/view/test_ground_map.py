"""Maps lie where they belong, and files that have no place in a mission are refused with one clear error."""

from __future__ import annotations

import copy
import math
import pickle
import struct
import sys
import zlib
from dataclasses import replace

import numpy as np
import pytest
from map_files import coded, encoded, geo_keys, write_geotiff
from PIL import Image
from PIL.TiffImagePlugin import ImageFileDirectory_v2

from tussle import Block, Mission, Scene
from tussle.errors import MissingExtraError, ParameterError
from tussle.scene import HeightField
from tussle.stock import Still
from tussle.view import GroundMap, scenery_of
from tussle.view.ground_map import read_bounds
from tussle.view.ground_map.placed import GREY, Area
from tussle.view.ground_map.projections import MERCATOR, projection_of
from tussle.world.geodesy import Origin
from tussle.world.rays.files import read_texture
from tussle.world.rays.textures import MAX_SIDE

RADIUS = 6378137.0
PLACES = [(52.0, 13.3), (-33.9, 18.4), (69.6, 18.9), (0.3, -179.98)]
"""Latitude and longitude of origins: north, south, far north, beside the 180th meridian."""


def area(latitude, longitude, half=10_000.0, height=0.0):
    return Area(Origin.from_degrees(latitude, longitude, 40.0), (-half, -half), (half, half), height)


def middles(picture):
    """East and north of the middles of its pixels [m], (h, w) each."""
    h, w = picture.image.shape[:2]
    east = picture.low[0] + (np.arange(w) + 0.5) / w * (picture.high[0] - picture.low[0])
    north = picture.high[1] - (np.arange(h) + 0.5) / h * (picture.high[1] - picture.low[1])
    return np.meshgrid(east, north)


def geodetic(origin, x, y, z=0.0):
    found = origin.to_geodetic(np.stack([x.ravel(), y.ravel(), np.full(x.size, z)]))
    return found[0].reshape(x.shape), found[1].reshape(x.shape)


def assert_coded(picture, column, row, size):
    """Assert that all pixels show what belongs there, to a twentieth of a pixel of the file; grey where the file has none."""
    width, height = size
    is_in = (column > 0.5) & (row > 0.5) & (column < width - 0.5) & (row < height - 0.5)
    assert is_in.mean() > 0.3
    # The middle of a column is half a pixel from its edge, and Pillow rounds colours down: half a step on the mean.
    image = picture.image + 1.0
    assert np.abs(image[:, :, 0] - column)[is_in].max() < 0.55
    assert np.abs(image[:, :, 1] - row)[is_in].max() < 0.55
    is_out = (column < -0.5) | (row < -0.5) | (column > width + 0.5) | (row > height + 0.5)
    assert (picture.image[is_out] == GREY).all()


@pytest.mark.parametrize(("latitude", "longitude"), PLACES)
def test_a_picture_with_bounds_lies_where_latitude_and_longitude_say(tmp_path, latitude, longitude):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    west, south, east, north = longitude - 0.13, latitude - 0.08, longitude + 0.11, latitude + 0.07
    where = area(latitude, longitude)
    picture = GroundMap(tmp_path / "m.png", (west, south, east, north)).over(where)
    lat, lon = (np.degrees(each) for each in geodetic(where.origin, *middles(picture)))
    lon = longitude + (lon - longitude + 180.0) % 360.0 - 180.0
    assert_coded(
        picture, (lon - west) / (east - west) * 240, (north - lat) / (north - south) * 200, (240, 200)
    )


@pytest.mark.parametrize("is_point", [False, True])
@pytest.mark.parametrize(("latitude", "longitude"), PLACES[:3])
def test_a_geotiff_in_web_mercator(tmp_path, latitude, longitude, is_point):
    def mercator(lat, lon):
        return RADIUS * lon, RADIUS * np.log(np.tan(math.pi / 4 + lat / 2))

    x, y = mercator(math.radians(latitude), math.radians(longitude))
    cell = 90.0 / math.cos(math.radians(latitude))
    shift = 0.5 if is_point else 0.0
    file = write_geotiff(
        tmp_path / "m.tif", coded(), 3857, scale=(cell, cell, 0.0), is_point=is_point,
        tie=(10.0, 20.0, 0.0, x - 110 * cell + 10 * cell, y + 90 * cell - 20 * cell, 0.0),
    )  # fmt: skip
    where = area(latitude, longitude)
    picture = GroundMap(file).over(where)
    east, north = mercator(*geodetic(where.origin, *middles(picture)))
    column, row = (east - x) / cell + 110 + shift, (y - north) / cell + 90 + shift
    assert_coded(picture, column, row, (240, 200))


@pytest.mark.parametrize(
    ("code", "latitude", "longitude", "easting", "northing"),
    # The CN Tower, published to the metre, and its mirror image in the south.
    [(32617, 43.642567, -79.387139, 630_084, 4_833_438), (32717, -43.642567, -79.387139, 630_084, 5_166_562)],
)
def test_a_geotiff_in_utm_shows_a_place_where_it_is(tmp_path, code, latitude, longitude, easting, northing):
    image = np.zeros((2000, 2000, 3), np.uint8)
    image[1500:1502, 1200:1202, 0] = 255  # its middle is the corner (1201, 1501)
    file = write_geotiff(
        tmp_path / "m.tif", image, code,
        matrix=(10.0, 0, 0, easting - 12_010.0, 0, -10.0, 0, northing + 15_010.0, 0, 0, 0, 0, 0, 0, 0, 1),
    )  # fmt: skip
    origin = Origin.from_degrees(latitude, longitude)
    moved = Origin(*origin.to_geodetic([-2000.0, 5000.0, 0.0])[:2].tolist())
    place = moved.from_geodetic([origin.latitude, origin.longitude, 0.0])
    picture = GroundMap(file).over(Area(moved, (-10_000.0, -10_000.0), (10_000.0, 10_000.0), 0.0))
    x, y = middles(picture)
    weight = picture.image[:, :, 0].astype(float) - picture.image[:, :, 1]
    assert weight.sum() > 0
    found = [(each * weight).sum() / weight.sum() for each in (x, y)]
    assert found == pytest.approx(place[:2].tolist(), abs=10.0)


def test_a_large_picture_is_cut_and_made_smaller(tmp_path):
    image = np.zeros((4000, 5000, 3), np.uint8)
    image[1000:1004, 4000:4004] = 255
    (tmp_path / "m.jpg").write_bytes(encoded(image, "JPEG"))
    bounds = 10.0, 50.0, 10.5, 50.4
    origin = Origin.from_degrees(50.2, 10.25)
    place = origin.from_geodetic([math.radians(50.4 - 1002 * 1e-4), math.radians(10.0 + 4002 * 1e-4), 0.0])
    for half in (25_000.0, 13_000.0):
        picture = GroundMap(tmp_path / "m.jpg", bounds).over(Area(origin, (-half, -half), (half, half), 0.0))
        assert max(picture.image.shape) <= MAX_SIDE
        x, y = middles(picture)
        pixel = max(x[0, 1] - x[0, 0], y[0, 0] - y[1, 0])
        is_bright = picture.image[:, :, 0] > 140
        assert is_bright.any()
        assert [x[is_bright].mean(), y[is_bright].mean()] == pytest.approx(place[:2].tolist(), abs=pixel)


def test_the_map_ends_where_the_picture_ends(tmp_path):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    where = area(52.0, 13.3)
    west, south, _ = where.origin.from_geodetic([math.radians(51.99), math.radians(13.29), 0.0])
    picture = GroundMap(tmp_path / "m.png", (13.29, 51.99, 13.31, 52.01)).over(where)
    assert picture.low == pytest.approx((west, south), abs=3.0)
    whole = GroundMap(tmp_path / "m.png", (13.29, 51.99, 13.31, 52.01)).over(where, is_trimmed=False)
    assert (whole.low, whole.high) == (where.low, where.high)
    assert (whole.image[0, 0] == GREY).all()


def test_what_is_transparent_is_grey(tmp_path):
    image = np.zeros((50, 50, 4), np.uint8)
    image[:, 25:] = 255, 0, 0, 255
    (tmp_path / "m.png").write_bytes(encoded(image))
    picture = GroundMap(tmp_path / "m.png", (13.2, 51.9, 13.4, 52.1)).over(area(52.0, 13.3, 1000.0))
    assert (picture.image[:, 0] == GREY).all()
    assert (picture.image[:, -1] == (255, 0, 0)).all()


def test_web_mercator_is_a_square_and_other_projections_are_not_known():
    edge = math.atan(math.sinh(math.pi))
    x, y = MERCATOR.project(np.array([edge, -edge]), np.array([math.pi, -math.pi]))
    assert x.tolist() == pytest.approx([math.pi * RADIUS, -math.pi * RADIUS])
    assert y.tolist() == pytest.approx(x.tolist())
    assert [projection_of(code) for code in (32600, 32661, 32700, 32761, 4269, 2154)] == [None] * 6


# -- in a mission ---------------------------------------------------------------------------------------------------------------


def mission(origin=None, **scene):
    robot = Block(name="robot", position=(100, 0, 20), motion=Still())
    return Mission(blocks=[robot], scene=Scene(origin=origin or Origin(), **scene))


def test_a_mission_shows_the_map_flat_on_its_ground(tmp_path):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    ground_map = GroundMap(tmp_path / "m.png", (13.2, 51.9, 13.4, 52.1))
    seen = scenery_of(mission(Origin.from_degrees(52.0, 13.3)), ground_map=ground_map)
    plain = scenery_of(mission(Origin.from_degrees(52.0, 13.3)))
    assert (seen.low.tolist(), seen.high.tolist()) == (plain.low.tolist(), plain.high.tolist())
    assert (seen.terrain.height == seen.ground).all()
    # 500 m around the visible box of 50 m.
    assert seen.terrain.x.tolist() == pytest.approx([75.0 - 500.0, 125.0 + 500.0])
    assert seen.terrain.texture is not None


def test_a_map_lies_over_hills_and_covers_them(tmp_path):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    hills = HeightField.generate((400.0, 300.0), cell=10.0, z_std=1.0, seed=1)
    scene = mission(Origin.from_degrees(52.0, 13.3), terrain=hills)
    seen = scenery_of(scene, ground_map=GroundMap(tmp_path / "m.png", (13.3, 51.9, 13.4, 52.1)))
    assert np.array_equal(seen.terrain.height, hills.height)
    middle = seen.terrain.texture.shape[1] // 2
    zero = round(middle - seen.terrain.texture.shape[1] * (seen.terrain.x.mean() / np.ptp(seen.terrain.x)))
    assert (seen.terrain.texture[:, : zero - 2] == GREY).all()
    assert not (seen.terrain.texture[:, zero + 2 :] == GREY).all()


# -- what is refused ------------------------------------------------------------------------------------------------------------

BOUNDS = 13.2, 51.9, 13.4, 52.1


@pytest.fixture
def refused(tmp_path):
    def check(match, path=None, bounds=BOUNDS, where=area(52.0, 13.3)):  # noqa: B008
        (tmp_path / "m.png").write_bytes(encoded(coded()))
        with pytest.raises(ParameterError, match=match) as caught:
            GroundMap(path or tmp_path / "m.png", bounds).over(where)
        assert "\n" not in str(caught.value)
        assert str(path or tmp_path / "m.png") in str(caught.value)

    return check


def test_a_mission_without_an_origin(refused):
    origin = Origin()
    refused("no origin.*latitude_origin", where=Area(origin, (-10.0, -10.0), (10.0, 10.0), 0.0))


def test_the_default_place_is_an_origin_where_it_is_given(tmp_path):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    given = Origin.from_degrees(29.0, -95.0)
    over = GroundMap(tmp_path / "m.png", (-95.1, 28.9, -94.9, 29.1)).over(
        Area(given, (-10.0, -10.0), (10.0, 10.0), 0.0)
    )
    assert over is not None
    assert given != Origin()
    assert not copy.deepcopy(given).is_default
    assert not pickle.loads(pickle.dumps(given)).is_default
    assert pickle.loads(pickle.dumps(Origin())).is_default
    assert not replace(given, altitude=3.0).is_default


@pytest.mark.parametrize(
    ("bounds", "match"),
    [
        (None, "--map-bounds"),
        ((13.4, 51.9, 13.2, 52.1), "swapped"),
        ((13.2, 52.1, 13.4, 51.9), "swapped"),
        ((51.9, 113.2, 52.1, 113.4), "not degrees"),
        ((math.nan, 51.9, 13.4, 52.1), "not degrees"),
        ((-30.0, 51.9, -29.0, 52.1), r"outside the mission's area.*-30, 51.9, -29, 52.1 of the map"),
    ],
)
def test_bounds_that_are_wrong(refused, bounds, match):
    refused(match, bounds=bounds)


@pytest.mark.parametrize("text", ["", "1,2,3", "1,2,3,4,5", "a,b,c,d"])
def test_bounds_are_four_numbers(text):
    with pytest.raises(ParameterError, match="four numbers"):
        read_bounds(text)


def test_bounds_as_people_write_them():
    assert read_bounds("-1.5, 2,3 ,4") == (-1.5, 2.0, 3.0, 4.0)
    assert read_bounds("1 2 3 4") == (1.0, 2.0, 3.0, 4.0)


def test_other_files(refused, tmp_path):
    refused("cannot be read", tmp_path / "none.png")
    refused(r"'\.webm' is no format of maps.*\.png", tmp_path / "m.webm")
    (tmp_path / "folder.png").mkdir()
    refused("regular file", tmp_path / "folder.png")
    for name, data in (("empty", b""), ("text", b"a picture"), ("cut", encoded(coded())[:-4000])):
        (tmp_path / f"{name}.png").write_bytes(data)
        refused("the map cannot be read", tmp_path / f"{name}.png")


def test_a_picture_of_a_thousand_million_pixels_is_refused_before_it_is_decoded(refused, tmp_path):
    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    for name, side in (("billion", 31_623), ("more", 9_000)):
        head = chunk(b"IHDR", struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0))
        (tmp_path / f"{name}.png").write_bytes(
            b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", b"") + chunk(b"IEND", b"")
        )
        refused("pixels; it takes at most 67,108,864", tmp_path / f"{name}.png")


SCALE, TIE = (1e-3, 1e-3, 0.0), (0.0, 0.0, 0.0, 13.2, 52.1, 0.0)


@pytest.mark.parametrize(
    ("match", "code", "given"),
    [
        ("EPSG:2154; it takes EPSG:4326", 2154, {"scale": SCALE, "tie": TIE}),
        ("EPSG:4269", 4269, {"scale": SCALE, "tie": TIE}),
        ("EPSG:32767", 32767, {"scale": SCALE, "tie": TIE}),
        ("does not say where it lies", None, {"scale": SCALE, "tie": TIE}),
        ("neither a pixel scale", 4326, {"scale": SCALE}),
        ("neither a pixel scale", 4326, {"scale": SCALE, "tie": TIE * 4}),
        ("not finite", 4326, {"scale": (math.nan, 1.0, 0.0), "tie": TIE}),
        ("rotated or mirrored", 4326, {"matrix": (1e-3, 1e-4, 0, 13.2, 1e-4, -1e-3, 0, 52.1, *[0] * 7, 1)}),
        ("rotated or mirrored", 4326, {"matrix": (1e-3, 0, 0, 13.2, 0, 1e-3, 0, 52.1, *[0] * 7, 1)}),
        ("rotated or mirrored", 4326, {"scale": (0.0, 1e-3, 0.0), "tie": TIE}),
        ("coordinates in feet, not in metres", 32633, {"scale": SCALE, "tie": TIE, "unit": 9002}),
        ("outside the mission's area", 4326, {"scale": SCALE, "tie": (0, 0, 0, 52.1, 13.2, 0)}),
    ],
)
def test_a_geotiff_without_a_place(refused, tmp_path, match, code, given):
    refused(match, write_geotiff(tmp_path / "m.tif", coded(), code, **given), None)


def test_a_geotiff_of_heights_or_cut_off(refused, tmp_path):
    heights = np.zeros((20, 20), np.float32)
    refused("mode 'F'", write_geotiff(tmp_path / "f.tif", heights, 4326, scale=SCALE, tie=TIE), None)
    whole = write_geotiff(
        tmp_path / "w.tif", coded(), 4326, scale=SCALE, tie=TIE, compression="raw"
    ).read_bytes()
    for n in (9, 2000, len(whole) - 30_000):
        (tmp_path / "cut.tif").write_bytes(whole[:n])
        refused("the map cannot be read", tmp_path / "cut.tif", None)


def test_without_pillow_it_is_said_what_to_install(tmp_path, monkeypatch):
    (tmp_path / "m.png").write_bytes(encoded(coded()))
    monkeypatch.setitem(sys.modules, "PIL", None)
    with pytest.raises(MissingExtraError, match=r"m\.png: maps need Pillow: pip install 'tussle\[maps\]'"):
        GroundMap(tmp_path / "m.png", BOUNDS).over(area(52.0, 13.3))


def test_a_zone_in_which_the_mission_has_no_coordinates(refused, tmp_path):
    given = {"scale": (10.0, 10.0, 0.0), "tie": (0.0, 0.0, 0.0, 5e5, 1e6, 0.0)}
    refused(
        "no coordinates in EPSG:32633",
        write_geotiff(tmp_path / "m.tif", coded(), 32633, **given),
        None,
        area(0.0, 105.0),
    )


def test_a_geotiff_whose_tags_are_of_other_types(refused, tmp_path):
    for tag, kind, value in ((34735, 3, (7,)), (33550, 2, "scale"), (33550, 12, (1e-300, 1e-300, 0.0))):
        tags = ImageFileDirectory_v2()
        for name, its_kind, its_value in ((34735, 3, geo_keys(4326)), (33550, 12, SCALE), (33922, 12, TIE)):
            tags.tagtype[name], tags[name] = (kind, value) if name == tag else (its_kind, its_value)
        Image.fromarray(coded()).save(tmp_path / "odd.tif", tiffinfo=tags)
        refused("odd.tif", tmp_path / "odd.tif", None)


def test_pictures_of_all_kinds_of_pixels(tmp_path):
    for mode in ("1", "L", "LA", "P", "RGB", "RGBA"):
        Image.fromarray(coded()).convert(mode).save(tmp_path / "m.png")
        assert GroundMap(tmp_path / "m.png", BOUNDS).over(area(52.0, 13.3)).image.std() > 10, mode


@pytest.mark.parametrize("turn", range(1, 9))
def test_a_photo_lies_as_all_viewers_of_pictures_show_it(tmp_path, turn):
    from PIL import ImageOps

    exif = Image.Exif()
    exif[0x0112] = turn
    Image.fromarray(coded()).save(tmp_path / "camera.png", exif=exif)
    with Image.open(tmp_path / "camera.png") as photo:
        ImageOps.exif_transpose(photo).save(tmp_path / "plain.png", exif=b"")
    maps = [
        GroundMap(tmp_path / f"{name}.png", BOUNDS).over(area(52.0, 13.3)) for name in ("camera", "plain")
    ]
    np.testing.assert_array_equal(maps[0].image, maps[1].image)
    np.testing.assert_array_equal(read_texture(tmp_path / "camera.png"), read_texture(tmp_path / "plain.png"))
    assert (read_texture(tmp_path / "camera.png").shape[:2] == (200, 240)) is (turn < 5)


def test_a_tiff_without_a_place_takes_bounds(tmp_path):
    Image.fromarray(coded()).save(tmp_path / "plain.tif")
    assert GroundMap(tmp_path / "plain.tif", BOUNDS).over(area(52.0, 13.3)).image.std() > 10
