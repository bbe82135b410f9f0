"""Surfaces from files, tags of missions that name them, and hostile files."""

from __future__ import annotations

import json
import os
import struct
import sys
import zlib

import numpy as np
import pytest

from tussle import Simulation
from tussle.errors import MissingExtraError, MissionError, ParameterError, TussleError
from tussle.mission import read_mission, to_python, to_xml
from tussle.scene import Cuboid, FlatGround, HeightField, Origin, Prism
from tussle.view import scenery_of
from tussle.world.geodesy import utm
from tussle.world.rays.files import read_surface

GRID = """ncols 3
nrows 2
xllcorner -5
yllcorner -10
cellsize 10
NODATA_value -1
3 4 5
0 1 -1
"""
VTK = """# vtk DataFile Version 3.0
a tent
ASCII
DATASET POLYDATA
POINTS 5 float
0 0 0 4 0 0 4 4 0 0 4 0 2 2 3
POLYGONS 3 13
3 0 1 4 3 1 2 4
4 0 1 2 3
TRIANGLE_STRIPS 1 5
4 2 3 4 0
CELL_DATA 4
SCALARS x float
"""
TRIANGLES = [[0, 1, 4], [1, 2, 4], [0, 1, 2], [0, 2, 3], [2, 3, 4], [3, 4, 0]]


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (GRID.replace("ncols 3", "ncols 4"), "there are 6 heights; needed are 4 x 2"),
        (GRID.replace("ncols 3\n", ""), "has no ncols"),
        (GRID.replace("ncols 3", "ncols 2.5"), "has no ncols, or one that is not allowed"),
        (GRID.replace("ncols", "ncolls"), r":1: a terrain has no 'ncolls' \(did you mean 'ncols'\?\)"),
        (GRID.replace("cellsize 10", "cellsize ten"), ":5: cellsize takes one number"),
        (GRID.replace("cellsize 10", "cellsize 0"), "every 0 m is not allowed"),
        (GRID.replace("ncols 3", "ncols 3000000"), "is not allowed"),
        (GRID.replace("3 4 5", "3 4 x"), "not all heights are numbers"),
        (GRID.replace("3 4 5\n0 1", "-1 -1 -1\n-1 -1"), "no cell has a height"),
        ("", "has no ncols"),
        ("ncols ä", "cannot be read"),
        (
            GRID.replace("cellsize 10", "cellsize 0.00028"),
            "cells of 0.00028 m are too small .* differ by 5 m, so the grid is in degrees",
        ),
    ],
)
def test_what_is_no_grid(tmp_path, text, told):
    path = tmp_path / "x.asc"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ParameterError, match=told):
        read_surface(path)


def test_too_much_is_not_read(tmp_path):
    path = tmp_path / "x.asc"
    with path.open("wb") as file:
        file.truncate(65_000_000)
    with pytest.raises(ParameterError, match="the limit is 64,000,000"):
        read_surface(path)


def test_a_grid_with_a_position(tmp_path):
    path = tmp_path / "hills.asc"
    path.write_text(GRID)
    assert read_surface(path, position=(100.0, 200.0, 7.0)) == HeightField(
        [[7, 8, 7], [10, 11, 12]], 100.0, 195.0, 10.0
    )


def png(width, height, rows, bits=8):
    """A grey PNG."""

    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    packed = b"".join(b"\0" + b"".join(v.to_bytes(bits // 8, "big") for v in row) for row in rows)
    head = struct.pack(">IIBBBBB", width, height, bits, 0, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", head)
        + chunk(b"IDAT", zlib.compress(packed))
        + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(("bits", "white"), [(8, 255), (16, 65535)])
def test_images(tmp_path, bits, white):
    pytest.importorskip("PIL")
    path = tmp_path / "a.png"
    path.write_bytes(png(3, 2, [[0, white, 0], [0, 0, white]], bits))
    expected = HeightField([[0.0, 0.0, 50.0], [0.0, 50.0, 0.0]], 1.0, 2.0, 5.0)
    assert read_surface(path, cell=5.0, height=50.0, position=(1.0, 2.0, 0.0)) == expected


HEIGHTS = np.array([[3, 4, -9], [0, 1, 2]], np.float32)


def geotiff(path, heights=HEIGHTS, **tags):
    from PIL import Image
    from PIL.TiffImagePlugin import ImageFileDirectory_v2

    found = ImageFileDirectory_v2()
    for number, (kind, value) in tags.items():
        found.tagtype[int(number[1:])] = kind
        found[int(number[1:])] = value
    Image.fromarray(heights).save(path, tiffinfo=found)
    return path


def test_geotiff(tmp_path):
    pytest.importorskip("PIL")
    path = geotiff(
        tmp_path / "a.tif",
        t33550=(12, (2.0, 2.0, 0.0)),
        t42113=(2, "-9"),
        t34735=(3, (1, 1, 0, 1, 1024, 0, 1, 1)),
    )
    assert read_surface(path) == HeightField([[0, 1, 2], [3, 4, 0]], cell=2.0)
    for tags, message in (
        ({"t34735": (3, (1, 1, 0, 1, 1024, 0, 1, 2))}, "the GeoTIFF is in degrees"),
        ({}, r"the width of a pixel is not known; give cell="),
        ({"t33550": (12, (2.0, 3.0, 0.0))}, "the pixels are 2 x 3 m; they must be square"),
        ({"t33550": (12, (2.0, 2.0, 0.0)), "t42113": (2, "none")}, "data is 'none.*', which is no number"),
        ({"t33550": (12, (1e-4, 1e-4, 0.0))}, "cells of 0.0001 m .*, so the grid is in degrees"),
        *(
            (
                {
                    "t33550": (12, (2.0, 2.0, 0.0)),
                    "t34735": (3, (1, 1, 0, 2, 1024, 0, 1, 1, key, 0, 1, unit)),
                },
                f"{what} in {name}",
            )
            for key, what in ((3076, "coordinates"), (4099, "heights"))
            for unit, name in ((9002, "feet"), (9003, "US survey feet"), (9036, "the unit EPSG:9036"))
        ),
    ):
        with pytest.raises(ParameterError, match=message):
            read_surface(geotiff(tmp_path / "b.tif", **tags))
    metres = (1, 1, 0, 3, 1024, 0, 1, 1, 3076, 0, 1, 9001, 4099, 0, 1, 9001)
    assert read_surface(geotiff(path, t33550=(12, (2.0, 2.0, 0.0)), t34735=(3, metres))).cell == 2.0


@pytest.mark.parametrize("kind", [np.float32, np.int32])
def test_a_geotiff_of_numbers_with_a_sign_holds_heights(tmp_path, kind):
    pytest.importorskip("PIL")
    path = geotiff(tmp_path / "a.tif", HEIGHTS.astype(kind), t33550=(12, (2.0, 2.0, 0.0)), t42113=(2, "-9"))
    assert read_surface(path) == HeightField([[0, 1, 2], [3, 4, 0]], cell=2.0)


def test_a_grid_with_a_mark_of_unicode(tmp_path):
    (tmp_path / "a.asc").write_text(GRID, encoding="utf-8-sig")
    (tmp_path / "b.asc").write_text(GRID)
    assert read_surface(tmp_path / "a.asc") == read_surface(tmp_path / "b.asc")


def binary_vtk():
    points = np.array([0, 0, 0, 4, 0, 0, 4, 4, 0, 0, 4, 0, 2, 2, 3], ">f4").tobytes()
    polygons = np.array([3, 0, 1, 4, 3, 1, 2, 4, 4, 0, 1, 2, 3], ">i4").tobytes()
    strips = np.array([4, 2, 3, 4, 0], ">i4").tobytes()
    return (
        b"# vtk DataFile Version 3.0\na tent\nBINARY\nDATASET POLYDATA\nPOINTS 5 float\n" + points + b"\nPOLYGONS 3 13\n" + polygons
        + b"\nTRIANGLE_STRIPS 1 5\n" + strips + b"\n"
    )  # fmt: skip


def test_vtk(tmp_path):
    path = tmp_path / "tent.vtk"
    fifth = VTK.replace(
        "3 13\n3 0 1 4 3 1 2 4\n4 0 1 2 3",
        "4 10\nOFFSETS vtktypeint64\n0 3 6 10\nCONNECTIVITY vtktypeint64\n0 1 4 1 2 4 0 1 2 3",
    )
    fifth = fifth.replace(
        "1 5\n4 2 3 4 0", "2 4\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n2 3 4 0"
    )
    for data in (VTK.encode(), binary_vtk(), fifth.encode()):
        path.write_bytes(data)
        mesh = read_surface(path, scale=2.0, position=(1.0, 0.0, 0.0))
        assert mesh.faces.tolist() == TRIANGLES
        assert mesh.vertices[[1, 4]].tolist() == [[9.0, 0.0, 0.0], [5.0, 4.0, 6.0]]


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ("nothing", "it is no legacy VTK file"),
        (VTK.replace("POLYDATA", "UNSTRUCTURED_GRID"), "the data set is not POLYDATA"),
        (VTK.replace("POINTS 5", "POINTS 1000000000"), "an array of 3,000,000,000 numbers is not allowed"),
        (VTK.replace("POINTS 5", "POINTS -5"), "an array of -15 numbers is not allowed"),
        (VTK.replace("POINTS 5", "POINTS 50"), "the file ends within 150 numbers"),
        (VTK.replace("POINTS 5", "POINTS 4"), "a list of 12 numbers has 15"),
        (VTK[:120], "the file ends within"),
        (VTK.replace("3 0 1 4", "3 0 1 9"), "refer to other than the 5 vertices"),
        (VTK.replace("3 0 1 4", "900 0 1 4"), "a cell of 900 corners"),
        (VTK.replace("3 0 1 4", "-3 0 1 4"), "a cell of -3 corners"),
        (VTK.replace("2 2 3", "2 2 nan"), "coordinate"),
        (VTK.replace("POLYGONS 3 13", "POLYGONS"), "damaged"),
        (VTK.replace("POLYGONS", "POLYGON"), "the part 'POLYGON' is not known"),
        (VTK.replace("float", "quad"), "damaged"),
        (binary_vtk()[:160].decode("latin-1"), "the file ends within"),
    ],
)
def test_damaged_vtk(tmp_path, data, message):
    path = tmp_path / "a.vtk"
    path.write_bytes(data.encode("latin-1"))
    with pytest.raises(ParameterError, match=message) as error:
        read_surface(path)
    assert str(path) in str(error.value)


def glb(content):
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    return b"glTF" + struct.pack("<III", 2, 20 + len(text), len(text)) + b"JSON" + text


def test_meshes_by_trimesh(tmp_path):
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((2.0, 4.0, 6.0))
    for suffix in ("obj", "ply", "stl", "glb", "off"):
        path = tmp_path / f"box.{suffix}"
        box.export(path)
        mesh = read_surface(path, scale=0.5, position=(0.0, 0.0, 9.0))
        assert len(mesh.faces) == 12
        assert mesh.vertices.max(axis=0).tolist() == [0.5, 1.0, 10.5]


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.stl", b"\0" * 80 + b"\0\0\0\x7f", "announces more than 2,000,000 triangles"),
        (
            "a.ply",
            b"ply\nformat ascii 1.0\nelement face 1000000000\nend_header\n",
            "announces more than 2,000,000",
        ),
        ("a.glb", glb({"asset": {"version": "2.0"}, "accessors": [{"count": 10**9}]}), "announces more than"),
        ("a.glb", glb({"accessors": 5}), "it cannot be read as .glb"),
        (
            "a.gltf",
            b'{"buffers": [{"uri": "../../secret.bin"}]}',
            "its buffer '../../secret.bin' lies in another file; save it in one",
        ),
        (
            "a.obj",
            b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "has the coordinate nan; coordinates are numbers",
        ),
        ("a.obj", b"v 0 0 0\nf 1 2 9\n", "a.obj: "),
        ("a.obj", b"v 0 0\nv 1 0\nv 0 1\nf 1 2 3\n", r"a.obj: its vertices have shape \(3, 2\)"),
        ("a.ply", b"no mesh", "a.ply: it cannot be read as .ply"),
        ("a.off", b"\xff\xfe", "it cannot be read as .off"),
        ("a.zip", b"PK", "'.zip' is no format of surfaces"),
    ],
)
def test_hostile_meshes(tmp_path, name, data, message):
    pytest.importorskip("trimesh")
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(ParameterError, match=message):
        read_surface(path)


def test_hostile_images_and_places(tmp_path, monkeypatch):
    pytest.importorskip("PIL")
    path = tmp_path / "a.png"
    for data, message in (
        (png(60_000, 60_000, []), "decompression bomb"),  # 3.6 GB from 100 bytes: refused by the header
        (png(3_000, 3_000, []), "3000 x 3000 heights"),
        (b"no image", "is no PNG or TIFF that can be read"),
        (png(3, 3, [[0, 0, 0]])[:-30], "is no PNG or TIFF that can be read"),
    ):
        path.write_bytes(data)
        with pytest.raises(ParameterError, match=message):
            read_surface(path, cell=1.0, height=1.0)
    path.write_bytes(png(2, 2, [[0, 0], [0, 0]]))
    with pytest.raises(ParameterError, match="the pixels are brightnesses; give height="):
        read_surface(path, cell=1.0)
    with pytest.raises(ParameterError, match=r"scale = 0\.0 at"):
        read_surface(path, scale=0.0)
    pipe = tmp_path / "pipe.asc"
    os.mkfifo(pipe)
    for other, message in (
        (pipe, "it is not a regular file"),
        (tmp_path / "none.asc", "cannot be read: No such file"),
    ):
        with pytest.raises(ParameterError, match=message):
            read_surface(other)
    monkeypatch.setitem(sys.modules, "PIL", None)
    monkeypatch.setitem(sys.modules, "trimesh", None)
    with pytest.raises(MissingExtraError, match=r"images need Pillow: pip install 'tussle\[maps\]'"):
        read_surface(path, cell=1.0, height=1.0)
    (tmp_path / "a.obj").write_text("")
    with pytest.raises(MissingExtraError, match=r"meshes need trimesh: pip install 'tussle\[scene\]'"):
        read_surface(tmp_path / "a.obj")


# -- missions ------------------------------------------------------------------------------------------------------------

MISSION = """<runscript><run dt="0.1" end="1"/>{tags}
<entity><team_id>1</team_id><motion_model>Still</motion_model><box_x>4</box_x><box_y>2</box_y><box_z>1</box_z></entity></runscript>
"""
TAGS = """<terrain position="10 0 1">hills.asc</terrain><terrain scale="2">tent.vtk</terrain><ground>-3</ground>
<wall center="1 2 3" lengths="4, 5, 6" rpy="0 0 90"/><building corners="[0 0] [9 0] [9 5]" high="12"/>"""


@pytest.fixture
def folder(tmp_path):
    (tmp_path / "hills.asc").write_text(GRID)
    (tmp_path / "tent.vtk").write_text(VTK)
    return tmp_path


def read(folder, tags):
    path = folder / "m.xml"
    path.write_text(MISSION.format(tags=tags))
    return read_mission(path)


def test_tags_of_the_scene(folder, monkeypatch):
    loaded = read(folder, TAGS)
    scene = loaded.mission.scene
    assert loaded.notes == ()
    assert scene.terrain == HeightField([[1, 2, 1], [4, 5, 6]], 10.0, -5.0, 10.0)
    assert len(scene.meshes[0].faces) == 6
    assert scene.ground == FlatGround(-3.0)
    assert scene.walls == (
        Cuboid((1, 2, 3), (4, 5, 6), (0, 0, np.pi / 2)),
        Prism(((0, 0), (9, 0), (9, 5)), 0, 12),
    )
    assert loaded.mission.blocks[0].box == (4.0, 2.0, 1.0)
    assert [path.name for path in loaded.files] == ["m.xml", "hills.asc", "tent.vtk"]
    sim = Simulation(loaded.mission, seeds=[1, 2])
    sim.run()
    (folder / "back.xml").write_text(to_xml(loaded.mission))
    again = read_mission(folder / "back.xml").mission
    assert (again.scene, again.blocks) == (scene, loaded.mission.blocks)
    monkeypatch.setattr("tussle.view.scenery.MAX_FACES", 5)
    monkeypatch.setattr("tussle.view.solids.MAX_FACES", 5)
    shown = scenery_of(loaded.mission)
    assert [(region.name, len(region.mesh.faces)) for region in shown.boundaries] == [
        ("mesh 1", 5),
        ("wall 1", 12),
        ("wall 2", 8),
    ]
    assert shown.notes == ("mesh 1 has 6 triangles; 5 of them are shown",)
    assert shown.terrain.height.max() == 6.0
    with pytest.raises(MissionError, match=r"HeightField\(3 x 2.*cannot be written as code"):
        to_python(loaded.mission)


def crates(folder, text):
    path = folder / "m.xml"
    path.write_text(MISSION.format(tags="").replace("</entity>", f"<box_mesh>{text}</box_mesh></entity>"))
    return read_mission(path)


def test_entities_with_the_bounds_of_a_mesh(folder):
    mesh = read_surface(folder / "tent.vtk")
    loaded = crates(folder, "tent.vtk")
    assert loaded.mission.blocks[0].box == tuple(np.ptp(mesh.vertices, axis=0))
    assert loaded.mission.blocks[0].box != (4.0, 2.0, 1.0)
    assert loaded.scene_files == {"tent.vtk": folder / "tent.vtk"}


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("tnet.vtk", "m.xml:2: box_mesh: 'tnet.vtk' is no mesh beside the mission"),
        ("hills.asc", "box_mesh: 'hills.asc' is no mesh beside the mission; it takes a file of .vtk, .obj"),
        ("../hills.asc", "only files in the mission's folder"),
        ("bad.vtk", "box_mesh: .*bad.vtk"),
        ("flat.vtk", "box = 0.0 is not allowed"),
    ],
)
def test_meshes_that_are_no_shape_of_an_entity(folder, name, message):
    inner = folder / "inner"
    inner.mkdir()
    (inner / "hills.asc").write_text(GRID)
    (inner / "bad.vtk").write_text(VTK[:60])
    flat = "POINTS 3 float\n0 0 1 2 0 1 0 1 1\nPOLYGONS 1 4\n3 0 1 2\n"
    (inner / "flat.vtk").write_text(VTK[: VTK.index("POINTS")] + flat)
    with pytest.raises(TussleError, match=message):
        crates(inner, name)


@pytest.mark.parametrize(
    ("tags", "message"),
    [
        (
            "<terrain>../x.asc</terrain>",
            "m.xml:1: <terrain>: .*x.asc: only files in the mission's folder or below it are read",
        ),
        ("<terrain>link.asc</terrain>", "only files in the mission's folder"),
        ("<terrain>hills.asc</terrain>" * 2, "several <terrain> with a height field"),
        ("<terrain scale='x'>tent.vtk</terrain>", "<terrain>: 'x' is not a number"),
        ("<terrain position='1 2'>tent.vtk</terrain>", "position = '1 2' has 2 numbers; it takes 3"),
        ("<terrain>bad.asc</terrain>", "bad.asc: .*no ncols"),
        ("<wall lengths='1 0 1'/>", "Cuboid.lengths = .* is not allowed"),
        ("<wall/>" * 20_001, "there are 20,001 walls and buildings; the limit is 20,000"),
        ("<building corners='[0 0] [1 1]'/>", "Prism.corners has 2 corners"),
        ("<ground>deep</ground>", "<ground>: 'deep' is not a number"),
        (
            "<terrain>odd.xml</terrain>",
            r"odd.xml:1: a terrain has no 'polidata' \(did you mean 'polydata'\?\)",
        ),
        ("<terrain>empty.xml</terrain>", "empty.xml: the terrain has no <polydata>"),
        ("<terrain>out.xml</terrain>", "x.vtk: only files in the mission's folder"),
    ],
)
def test_hostile_tags(folder, tags, message):
    inner = folder / "inner"
    inner.mkdir()
    for name, text in {
        "bad.asc": "nrows 3", "odd.xml": "<params><polidata>a</polidata></params>", "empty.xml": "<params/>", "hills.asc": GRID,
        "tent.vtk": VTK, "out.xml": "<params><polydata>../x.vtk</polydata></params>", "../x.asc": GRID, "../x.vtk": VTK,
    }.items():  # fmt: skip
        (inner / name).write_text(text)
    (inner / "link.asc").symlink_to(folder / "hills.asc")
    with pytest.raises(MissionError, match=message):
        read(inner, tags)


def test_a_terrain_that_is_elsewhere_is_noted(tmp_path):
    loaded = read(
        tmp_path, "<terrain>mcmillan</terrain><wall centre='1 2 3'/><stream_port>5555</stream_port>"
    )
    assert loaded.mission.scene.terrain is None
    assert any(
        "there is no 'mcmillan' beside the mission or in a folder of data (--data-path), so the mission has no terrain"
        in note
        for note in loaded.notes
    )
    assert any("did you mean 'center'" in note for note in loaded.notes)


def test_terrain_xml_in_utm(folder):
    east, north = utm(0.0, np.radians(-87.0), 16, is_south=False)
    assert (east, north) == pytest.approx((500_000.0, 0.0), abs=1e-6)
    # The CN Tower at 43 38 33.24 N, 79 23 13.7 W: 17T 630084 4833438, as published (to the metre).
    tower = Origin.from_degrees(43 + 38 / 60 + 33.24 / 3600, -(79 + 23 / 60 + 13.7 / 3600))
    assert utm(tower.latitude, tower.longitude, 17, is_south=False) == pytest.approx(
        (630_084.0, 4_833_438.0), abs=1.0
    )
    assert utm(tower.latitude, tower.longitude, 17, is_south=True)[1] == pytest.approx(14_833_438.0, abs=1.0)
    (folder / "tent.xml").write_text(
        "<params><polydata>tent.vtk</polydata><zone>16</zone><origin_offset_z>2</origin_offset_z></params>"
    )
    tags = (
        "<latitude_origin>0</latitude_origin><longitude_origin>-87</longitude_origin><terrain>tent</terrain>"
    )
    mesh = read(folder, tags).mission.scene.meshes[0]
    assert mesh.vertices[4] == pytest.approx([2.0 - 500_000.0, 2.0, 5.0], abs=1e-6)
