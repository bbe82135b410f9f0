"""The scene is shown with its textures: on the page, in films and in MCAP files. Hostile images are refused."""

from __future__ import annotations

import io
import json
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
import trimesh
from mcap.reader import make_reader
from page_reader import PageReader
from PIL import Image
from recorded_games import record

from tussle import Simulation
from tussle.errors import MissionError, ParameterError
from tussle.mission import read_mission
from tussle.view import Live, Recording
from tussle.view.export.film.cameras import View
from tussle.view.export.film.renderer import Renderer
from tussle.view.export.foxglove_scene import textured_model
from tussle.view.export.html import write_html
from tussle.view.export.mcap_file import write_mcap
from tussle.view.frame import empty_frame
from tussle.view.page.document import scenery_blobs
from tussle.world.rays.files import read_surface
from tussle.world.rays.textures import MAX_SIDE, decoded

MISSION = """<runscript name="hilly"><run dt="0.1" end="0.2"/><terrain {}>hills.asc</terrain>
<entity><team_id>1</team_id><motion_model>Still</motion_model></entity></runscript>
"""
GRID = "ncols 5\nnrows 5\ncellsize 10\n" + "1 1 1 1 1\n" * 5
RED, BLUE = (220, 0, 0), (0, 0, 220)


def photo() -> np.ndarray:
    """An image whose north is red, (8, 8, 3)."""
    image = np.zeros((8, 8, 3), np.uint8)
    image[:4], image[4:] = RED, BLUE
    return image


def png(image: np.ndarray) -> bytes:
    file = io.BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return file.getvalue()


@pytest.fixture
def hilly(tmp_path):
    """Write a mission with a height field and an image; returns its path."""

    def write(attributes='texture="photo.png"', folder=tmp_path):
        (folder / "hills.asc").write_text(GRID)
        (folder / "photo.png").write_bytes(png(photo()))
        (folder / "hilly.xml").write_text(MISSION.format(attributes))
        return folder / "hilly.xml"

    return write


@pytest.fixture
def recorded(hilly, tmp_path):
    loaded = read_mission(hilly())
    files = {"mission_text": loaded.text, "scene_files": loaded.scene_files}
    found = Recording(record(loaded.mission, tmp_path / "run", **files))
    (tmp_path / "photo.png").unlink()  # the run has its own
    return found


def from_above(style, scenery) -> np.ndarray:
    """A picture from above, 4 pixels to 10 m, (64, 64, 3)."""
    view = View(
        np.array([25.0, 25.0, 500.0]),
        np.array([25.0, 25.0, 0.0]),
        np.array([0.0, 1.0, 0.0]),
        40.0,
        is_parallel=True,
    )

    with Renderer(style, scenery, (64, 64)) as renderer:
        renderer.show(empty_frame(0.0, 0), view)
        return renderer.picture().astype(int)


def is_red_over_blue(picture: np.ndarray) -> bool:
    red = (picture[..., 0] > 80) & (picture[..., 1:].max(axis=2) < 40)
    blue = (picture[..., 2] > 80) & (picture[..., :2].max(axis=2) < 40)
    if min(red.sum(), blue.sum()) < 100:
        return False
    return np.flatnonzero(red.any(axis=1)).max() <= np.flatnonzero(blue.any(axis=1)).min()


def test_a_recorded_terrain_has_its_texture_on_the_page(recorded, tmp_path):
    write_html(recorded, tmp_path / "page.html")
    page = PageReader(tmp_path / "page.html")
    assert page.document["scenery"]["terrain"]["hasTexture"]
    shown = np.asarray(Image.open(io.BytesIO(page.blob("texture"))), int)
    assert np.abs(shown - photo()).mean() < 12  # it is a JPEG file


@pytest.mark.needs("renderer")
def test_a_picture_shows_the_texture_with_its_upper_edge_in_the_north(recorded):
    assert is_red_over_blue(from_above(recorded.style, recorded.scenery))


def test_foxglove_gets_the_surface_with_its_image(recorded):
    part = replace(recorded.scenery.terrain.part(), colours=np.full((25, 3), (255, 128, 0), np.uint8))
    message = textured_model(part).encode()
    model = message[message.index(b"glTF") :]
    model = model[: struct.unpack_from("<I", model, 8)[0]]
    (shown,) = trimesh.load_scene(io.BytesIO(model), file_type="glb").geometry.values()
    # In glTF, y is up and z is south.
    assert np.allclose(shown.vertices * (1, 1, -1), part.vertices[:, [0, 2, 1]])
    image, uv = np.asarray(shown.visual.material.baseColorTexture), np.asarray(shown.visual.uv)
    assert image.tolist() == photo().tolist()
    assert uv[part.vertices[:, 1] == part.vertices[:, 1].max(), 1].tolist() == [1.0] * 5
    content = json.loads(model[20 : 20 + struct.unpack_from("<I", model, 12)[0]])
    assert "COLOR_0" in content["meshes"][0]["primitives"][0]["attributes"]


def test_an_mcap_file_has_the_image_of_the_terrain(recorded, tmp_path):
    write_mcap(recorded, tmp_path / "run.mcap")
    with (tmp_path / "run.mcap").open("rb") as file:
        scenes = [
            message.data
            for _, channel, message in make_reader(file).iter_messages()
            if b"glTF" in message.data
        ]
    assert len(scenes) == 1
    assert b"model/gltf-binary" in scenes[0]


def test_rays_and_hashes_are_the_same_without_it(hilly):
    hashes = []
    for attributes in ("", 'texture="photo.png"'):
        simulation = Simulation(read_mission(hilly(attributes)).mission, 1)
        simulation.run()
        hashes.append((simulation.state_hash(), simulation.mission.scene.height([11.0], [13.0]).tolist()))
    assert hashes[0] == hashes[1]


def test_a_missing_texture_is_noted_and_one_outside_the_folder_refused(hilly, tmp_path):
    loaded = read_mission(hilly('texture="nothing.png"'))
    assert loaded.mission.scene.terrain.texture is None
    assert any("no 'nothing.png', so the terrain has no texture" in note for note in loaded.notes)
    inner = tmp_path / "inner"
    inner.mkdir()
    hilly()
    with pytest.raises(MissionError, match=r"only files in the mission's folder or below it are read"):
        read_mission(hilly('texture="../photo.png"', folder=inner))


def test_what_is_no_image_is_refused_with_its_place(hilly, tmp_path):
    path = hilly('texture="hills.asc"')
    with pytest.raises(
        MissionError, match=r"hilly\.xml:1.*hills\.asc: it is no PNG, JPEG or TIFF that can be read"
    ):
        read_mission(path)


@pytest.mark.parametrize(
    ("side", "message"),
    [(8_000, r"8,000 x 8,000 pixels; it takes at most 32,000,000"), (40_000, "exceeds limit")],
)
def test_an_image_with_too_many_pixels_is_refused_before_it_is_decoded(side, message):
    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    head = struct.pack(">IIBBBBB", side, side, 8, 2, 0, 0, 0)
    bomb = (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )
    with pytest.raises(ParameterError, match=rf"bomb\.png: .*{message}"):
        decoded("bomb.png", bomb)
    with pytest.raises(ParameterError, match=r"cut\.png: the image cannot be read: image file is truncated"):
        decoded("cut.png", png(photo())[:60])


def test_large_images_are_made_smaller():
    shape = decoded("a.png", png(np.zeros((10, MAX_SIDE + 100, 3), np.uint8))).shape
    assert shape[1] == MAX_SIDE


SQUARE = "mtllib a.mtl\nv 0 0 0\nv 40 0 0\nv 40 40 0\nv 0 40 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl m\nf 1/1 2/2 3/3 4/4\n"
MESHES = """<runscript><run dt="0.1" end="0.2"/><terrain position="5 5 0">{}</terrain>
<entity><motion_model>Still</motion_model></entity></runscript>
"""


@pytest.fixture
def meshed(tmp_path):
    """Read a mission with a mesh from a file."""

    def read(name, **files):
        (tmp_path / "photo.png").write_bytes(png(photo()))
        (tmp_path / "a.mtl").write_text(files.pop("mtl", "newmtl m\nKd 1 1 1\nmap_Kd photo.png\n"))
        (tmp_path / "a.obj").write_text(SQUARE)
        (tmp_path / "meshes.xml").write_text(MESHES.format(name))
        return read_mission(tmp_path / "meshes.xml")

    return read


@pytest.mark.needs("renderer")
def test_an_obj_with_mtl_is_shown_with_its_texture(meshed, tmp_path):
    loaded = meshed("a.obj")
    assert {file.name for file in loaded.files} >= {"a.obj", "a.mtl", "photo.png"}
    live = Live(Simulation(loaded.mission), threaded=False)
    picture = from_above(live.style, live.scenery)
    assert is_red_over_blue(picture)
    (part,) = live.scenery.boundaries[0].parts
    assert (part.vertices.min(axis=0).tolist(), part.vertices.max(axis=0).tolist()) == (
        [5, 5, 0],
        [45, 45, 0],
    )
    blobs = scenery_blobs(live.scenery)
    assert np.frombuffer(blobs["part-0"][:12], "<u4").tolist() == [len(part.vertices), 2, 1]
    assert Image.open(io.BytesIO(blobs["image-0"])).size == (8, 8)
    assert part.corner_colours()[part.vertices[:, 1] > 40].tolist() == [[*RED]] * 2


@pytest.mark.parametrize("suffix", ["glb", "ply"])
def test_colours_of_corners_and_faces_are_shown(meshed, tmp_path, suffix):
    square = trimesh.Trimesh(
        [(0, 0, 0), (40, 0, 0), (40, 40, 0), (0, 40, 0)], [(0, 1, 2), (0, 2, 3)], process=False
    )
    if suffix == "glb":
        square.visual.vertex_colors = [(*RED, 255)] * 4
    else:
        square.visual.face_colors = [(*RED, 255), (*BLUE, 255)]
    square.export(tmp_path / f"b.{suffix}")
    (mesh,) = meshed(f"b.{suffix}").mission.scene.meshes
    (part,) = mesh.parts
    colours = {tuple(row) for row in part.colours.tolist()}
    assert colours == ({RED} if suffix == "glb" else {RED, BLUE})


def test_a_mesh_without_colours_has_no_parts(meshed, tmp_path):
    trimesh.creation.box().export(tmp_path / "b.stl")
    assert meshed("b.stl").mission.scene.meshes[0].parts == ()
    (tmp_path / "c.obj").write_text(SQUARE.partition("\n")[2].replace("usemtl m\n", ""))
    assert meshed("c.obj").mission.scene.meshes[0].parts == ()


def test_a_gltf_shows_its_image_and_one_with_too_many_pixels_is_refused(meshed, tmp_path):
    def export(image):
        uv = [(0, 0), (1, 0), (1, 1), (0, 1)]
        material = trimesh.visual.material.PBRMaterial(baseColorTexture=Image.fromarray(image))
        visual = trimesh.visual.TextureVisuals(uv=uv, material=material)
        corners = [(0, 0, 0), (40, 0, 0), (40, 40, 0), (0, 40, 0)]
        trimesh.Trimesh(corners, [(0, 1, 2), (0, 2, 3)], visual=visual, process=False).export(
            tmp_path / "b.glb"
        )

    export(photo())
    (part,) = meshed("b.glb").mission.scene.meshes[0].parts
    assert part.corner_colours()[part.vertices[:, 1] > 40].tolist() == [[*RED]] * 2
    export(np.zeros((5000, 7000, 3), np.uint8))
    with pytest.raises(
        MissionError, match=r"b\.glb: the image has 7,000 x 5,000 pixels; it takes at most 32,000,000"
    ):
        meshed("b.glb")


def test_files_that_a_mesh_names_are_checked(meshed, tmp_path):
    (tmp_path.parent / "outside.png").write_bytes(png(photo()))
    with pytest.raises(
        MissionError, match=r"outside\.png: only files in the mission's folder or below it are read"
    ):
        meshed("a.obj", mtl="newmtl m\nmap_Kd ../outside.png\n")
    (tmp_path / "text.png").write_text("no image")
    with pytest.raises(MissionError, match=r"text\.png: it is no PNG, JPEG or TIFF that can be read"):
        meshed("a.obj", mtl="newmtl m\nmap_Kd text.png\n")
    assert any(
        "names 'gone.png', which is not there" in note
        for note in meshed("a.obj", mtl="newmtl m\nmap_Kd gone.png\n").notes
    )


def test_rays_meet_a_mesh_with_texture_as_one_without(meshed):
    with_texture = meshed("a.obj").mission.scene
    without = read_surface(meshed("a.obj").path.parent / "a.obj", position=(5.0, 5.0, 0.0))
    assert with_texture.meshes[0].parts
    np.testing.assert_array_equal(with_texture.meshes[0].triangles(), without.triangles())


def test_the_texture_of_a_terrain_xml_is_laid_over_it(meshed, tmp_path):
    (tmp_path / "t.xml").write_text(
        "<terrain><polydata>a.obj</polydata><texture>photo.png</texture></terrain>"
    )
    loaded = meshed("t.xml")
    (part,) = loaded.mission.scene.meshes[0].parts
    assert part.corner_colours()[part.vertices[:, 1] > 40].tolist() == [[*RED]] * 2
    assert {"t.xml", "a.obj", "photo.png"} <= set(loaded.scene_files)
    (tmp_path / "t.xml").write_text("<terrain><polydata>a.obj</polydata><texture>no.png</texture></terrain>")
    assert meshed("t.xml").mission.scene.meshes[0].parts == ()


def test_a_gltf_whose_image_lies_nowhere_is_refused(meshed, tmp_path):
    trimesh.creation.box().export(tmp_path / "b.glb")
    data = (tmp_path / "b.glb").read_bytes()
    n = int.from_bytes(data[12:16], "little")
    content = json.loads(data[20 : 20 + n]) | {"images": [{"bufferView": 99}]}
    text = json.dumps(content).encode()
    text += b" " * (-len(text) % 4)
    body = struct.pack("<I", len(text)) + b"JSON" + text + data[20 + n :]
    (tmp_path / "b.glb").write_bytes(data[:8] + struct.pack("<I", 12 + len(body)) + body)
    with pytest.raises(MissionError, match=r"b\.glb: its colours cannot be read: IndexError"):
        meshed("b.glb")
