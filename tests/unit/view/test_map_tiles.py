"""Tiles of MBTiles and PMTiles lie where they belong, only those of the area are read, and damaged files are one clear error."""

from __future__ import annotations

import gzip
import math
import os
import sqlite3
from pathlib import Path

import numpy as np
import pytest
from map_files import directory, encoded, write_mbtiles, write_pmtiles

from tussle.errors import ParameterError
from tussle.view import GroundMap
from tussle.view.ground_map.mbtiles import MbTiles
from tussle.view.ground_map.placed import GREY, Area
from tussle.view.ground_map.pmtiles import PmTiles, tile_number
from tussle.view.ground_map.tiles import MAX_TILES
from tussle.world.geodesy import Origin

PLACES = [(52.0, 13.3), (-33.9, 18.4), (0.3, -179.995)]
ZOOM = 13


def place_of(latitude, longitude, zoom):
    """Column and row of a place, in tiles, with fractions."""
    n = 2.0**zoom
    row = (1.0 - math.asinh(math.tan(math.radians(latitude))) / math.pi) / 2.0 * n
    return (longitude + 180.0) / 360.0 * n, row


def tiles_around(latitude, longitude, zoom=ZOOM, reach=3):
    """Tiles about a place; each has its column and row, modulo 16, as levels of red and green from its west and north on."""
    column, row = (int(x) for x in place_of(latitude, longitude, zoom))
    found = {}
    for i in range(column - reach, column + reach + 1):
        for j in range(row - reach, row + reach + 1):
            image = np.full((256, 256, 3), (16 * (i % 16), 16 * (j % 16), zoom), np.uint8)
            found[zoom, i % 2**zoom, j] = encoded(image)
    return found


def area(latitude, longitude, half=3000.0):
    return Area(Origin.from_degrees(latitude, longitude, 40.0), (-half, -half), (half, half), 0.0)


def files(folder: Path, tiles):
    """The same tiles as each kind of file."""
    by_number = {tile_number(*place): data for place, data in tiles.items()}
    zooms = min(p[0] for p in tiles), max(p[0] for p in tiles)
    return [
        write_mbtiles(folder / "m.mbtiles", tiles),
        write_pmtiles(folder / "m.pmtiles", by_number, zooms),
        write_pmtiles(folder / "deep.pmtiles", by_number, zooms, packed=1, leaf=5),
    ]


@pytest.mark.parametrize(("latitude", "longitude"), PLACES)
def test_each_tile_lies_where_it_belongs(tmp_path, latitude, longitude):
    where = area(latitude, longitude)
    for file in files(tmp_path, tiles_around(latitude, longitude)):
        picture = GroundMap(file).over(where)
        assert (picture.low, picture.high) == (where.low, where.high)
        h, w = picture.image.shape[:2]
        assert min(h, w) > 300  # at this zoom a pixel has some ten metres
        for row in range(3, h, 40):
            for column in range(3, w, 40):
                x = picture.low[0] + (column + 0.5) / w * 6000.0
                y = picture.high[1] - (row + 0.5) / h * 6000.0
                lat, lon, _ = where.origin.to_geodetic([x, y, 0.0])
                i, j = place_of(math.degrees(lat), math.degrees(lon), ZOOM)
                if min(i % 1, j % 1) < 0.01 or max(i % 1, j % 1) > 0.99:
                    continue  # an edge between tiles
                assert picture.image[row, column].tolist() == [
                    16 * (int(i) % 16),
                    16 * (int(j) % 16),
                    ZOOM,
                ], file


def test_the_largest_zoom_with_few_enough_tiles_is_read(tmp_path):
    latitude, longitude = PLACES[0]
    tiles = {
        **tiles_around(latitude, longitude, 13),
        **tiles_around(latitude, longitude, 16),
        **tiles_around(latitude, longitude, 9),
    }
    for file in files(tmp_path, tiles):
        near = GroundMap(file).over(area(latitude, longitude, 300.0)).image[..., 2]
        assert (near == 16).all()
        # 8 km take 27 x 27 tiles at zoom 16, which are too many.
        assert set(np.unique(GroundMap(file).over(area(latitude, longitude, 4000.0)).image[..., 2])) == {13}


def test_only_the_tiles_of_the_area_are_read(tmp_path, monkeypatch):
    latitude, longitude = PLACES[0]
    asked = []
    for kind in (MbTiles, PmTiles):
        read = kind.tile
        monkeypatch.setattr(
            kind, "tile", lambda self, *place, read=read: asked.append(place) or read(self, *place)
        )
    for file in files(tmp_path, tiles_around(latitude, longitude, reach=6)):
        asked.clear()
        GroundMap(file).over(area(latitude, longitude, 500.0))
        assert 1 <= len(asked) <= 4


def test_missing_tiles_are_grey_and_zooms_without_tiles_are_left_out(tmp_path):
    latitude, longitude = PLACES[1]
    tiles = tiles_around(latitude, longitude)
    column, row = (int(x) for x in place_of(latitude, longitude, ZOOM))
    del tiles[ZOOM, column, row]
    for file in files(tmp_path, tiles):
        image = GroundMap(file).over(area(latitude, longitude)).image
        assert (image == GREY).all(axis=2).any()
    (tmp_path / "far").mkdir()
    for file in files(tmp_path / "far", {**tiles, **tiles_around(latitude + 1.0, longitude, 14)}):
        image = GroundMap(file).over(area(latitude, longitude)).image
        assert (image[..., 2] == ZOOM).mean() > 0.3


def test_a_part_of_a_smaller_zoom_is_shown_in_place_of_a_missing_tile(tmp_path):
    latitude, longitude = PLACES[0]
    column, row = (int(x) for x in place_of(latitude, longitude, ZOOM))
    tiles = tiles_around(latitude, longitude)
    del tiles[ZOOM, column, row]
    # Two zooms below; its part where the missing tile belongs is white.
    image = np.zeros((256, 256, 3), np.uint8)
    left, top = 64 * (column % 4), 64 * (row % 4)
    image[top : top + 64, left : left + 64] = 255
    tiles[ZOOM - 2, column // 4, row // 4] = encoded(image)
    where = area(latitude, longitude)
    for file in files(tmp_path, tiles):
        picture = GroundMap(file).over(where)
        h, w = picture.image.shape[:2]
        is_white = (picture.image > 200).all(axis=2)
        for y, x in [(h // 2, w // 2), *np.argwhere(is_white)[::997]]:
            east, north = (x + 0.5) / w * 6000.0 - 3000.0, 3000.0 - (y + 0.5) / h * 6000.0
            lat, lon, _ = where.origin.to_geodetic([east, north, 0.0])
            i, j = place_of(math.degrees(lat), math.degrees(lon), ZOOM)
            assert (int(i), int(j)) == (column, row)
            assert is_white[y, x]
        assert not (picture.image == GREY).all(axis=2).any()


def test_numbers_of_tiles_are_those_of_the_specification():
    assert [tile_number(0, 0, 0), tile_number(1, 0, 0), tile_number(1, 0, 1), tile_number(1, 1, 1), tile_number(1, 1, 0)] == [
        0, 1, 2, 3, 4,
    ]  # fmt: skip
    assert tile_number(2, 0, 0) == 5
    assert tile_number(12, 3423, 1763) == 19078479
    assert sorted(tile_number(4, i, j) for i in range(16) for j in range(16)) == list(range(85, 341))


# -- what is refused ------------------------------------------------------------------------------------------------------------


def refused(path, match, where=None):
    with pytest.raises(ParameterError, match=match) as caught:
        GroundMap(path).over(where or area(*PLACES[0]))
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_map_elsewhere_and_one_of_too_large_an_area(tmp_path):
    for file in files(tmp_path, tiles_around(*PLACES[0])):
        refused(file, "outside the mission's area", area(*PLACES[1]))
        refused(file, rf"zoom, 13, .* tiles; allowed are {MAX_TILES}", area(*PLACES[0], half=100_000.0))
        with pytest.raises(ParameterError, match="their own bounds"):
            GroundMap(file, (1.0, 2.0, 3.0, 4.0))


@pytest.mark.parametrize("suffix", ["mbtiles", "pmtiles"])
def test_files_that_are_something_else(tmp_path, suffix):
    path = tmp_path / f"m.{suffix}"
    refused(path, "cannot be read")
    for data in (b"", b"PMTiles\x03", b"SQLite format 3\0", os.urandom(5000)):
        path.write_bytes(data)
        refused(path, "it is no")
    path.unlink()
    path.mkdir()
    refused(path, "regular file")
    path.rmdir()
    os.mkfifo(path)
    refused(path, "regular file")


def test_tiles_that_are_no_pictures(tmp_path):
    tiles = tiles_around(*PLACES[0])
    refused(write_mbtiles(tmp_path / "v.mbtiles", tiles, "pbf"), "tiles are 'pbf'")
    numbered = {tile_number(*place): data for place, data in tiles.items()}
    refused(write_pmtiles(tmp_path / "v.pmtiles", numbered, (13, 13), kind=1), "its tiles are no pictures")
    refused(write_pmtiles(tmp_path / "p.pmtiles", numbered, (13, 13), packed=4), "neither gzip nor nothing")
    refused(write_pmtiles(tmp_path / "z.pmtiles", numbered, (13, 200)), "no zooms of a map")
    for place in tiles:
        tiles[place] = b"no picture"
    for file in files(tmp_path, tiles):
        refused(file, "cannot be read")
    refused(write_mbtiles(tmp_path / "t.mbtiles", dict.fromkeys(tiles, "text")), "a tile is no picture")
    refused(write_mbtiles(tmp_path / "l.mbtiles", dict.fromkeys(tiles, b"\0" * 5_000_000)), "5,000,000 bytes")
    odd = dict.fromkeys(tiles, encoded(np.zeros((8, 9, 3), np.uint8)))
    refused(write_mbtiles(tmp_path / "o.mbtiles", odd), "not squares of one size")
    huge = dict.fromkeys(tiles, encoded(np.zeros((700, 700, 3), np.uint8)))
    refused(write_mbtiles(tmp_path / "h.mbtiles", huge), "700 x 700 pixels; it takes at most 262,144")


def test_an_mbtiles_file_without_tables_and_one_that_never_ends(tmp_path):
    base = sqlite3.connect(tmp_path / "e.mbtiles")
    base.execute("CREATE TABLE other (x)")
    base.close()
    refused(tmp_path / "e.mbtiles", "no such table")
    refused(write_mbtiles(tmp_path / "n.mbtiles", {}), "no zooms")
    base = sqlite3.connect(write_mbtiles(tmp_path / "f.mbtiles", {}))
    base.execute("DROP TABLE tiles")
    base.execute(
        "CREATE VIEW tiles AS WITH RECURSIVE n(zoom_level) AS (SELECT 1 UNION ALL SELECT zoom_level + 1 FROM n) SELECT * FROM n"
    )
    base.close()
    refused(tmp_path / "f.mbtiles", "interrupted")
    base = sqlite3.connect(write_mbtiles(tmp_path / "b.mbtiles", {}))
    base.execute("DROP TABLE tiles")
    base.execute(
        "CREATE VIEW tiles AS SELECT 0 AS zoom_level, 0 AS tile_column, 0 AS tile_row, "
        "CAST(zeroblob(900000000) AS TEXT) || 'x' AS tile_data"
    )
    base.close()
    refused(tmp_path / "b.mbtiles", "too big")


def test_a_pmtiles_file_that_is_damaged(tmp_path, monkeypatch):
    tiles = {tile_number(*place): data for place, data in tiles_around(*PLACES[0]).items()}
    whole = write_pmtiles(tmp_path / "w.pmtiles", tiles, (13, 13)).read_bytes()
    path = tmp_path / "d.pmtiles"
    for n, match in ((140, "cut off"), (len(whole) - 20_000, "cut off")):
        path.write_bytes(whole[:n])
        refused(path, match)
    path.write_bytes(whole[:127] + b"\xff" * 200 + whole[327:])
    refused(path, "a directory is damaged")
    path.write_bytes(whole[:16] + (2**63).to_bytes(8, "little") + whole[24:])
    refused(path, "9,223,372,036,854,775,808 bytes")
    path.write_bytes(whole[:8] + (2**63).to_bytes(8, "little") + whole[16:])
    refused(path, "cannot be read|cut off")

    def with_root(content):
        head = bytearray(whole[:127])
        packed = gzip.compress(content)
        head[16:24] = len(packed).to_bytes(8, "little")
        path.write_bytes(bytes(head) + packed)

    for content in (
        b"\xff\xff\xff\xff\x7f",
        b"\x05\x01",
        b"\xff" * 12,
        b"\x01\x00\x01\x01\x00",
        b"\0" * (1 << 25),
    ):
        with_root(content)
        refused(
            path,
            "a directory is damaged|outside the mission's area"
            if content[0] == 0
            else "a directory is damaged",
        )
    # A directory that is its own leaf.
    loop = write_pmtiles(tmp_path / "loop.pmtiles", {0: b"x"}, (13, 13), packed=1)
    content = bytearray(loop.read_bytes())
    own = directory([(0, 0, 5, 0)])
    content[8 + 8 * 0 + 0 : 24] = (127).to_bytes(8, "little") + len(own).to_bytes(8, "little")
    content[40:48] = (127).to_bytes(8, "little")
    loop.write_bytes(bytes(content[:127]) + own)
    refused(loop, "more than 4 deep")
