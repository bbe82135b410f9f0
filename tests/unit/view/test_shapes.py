"""Models are closed, face outwards and point forward; solids have the surface of their shape."""

import numpy as np
import pytest

from tussle.scene import Cuboid, FlatGround, Plane, Polyhedron, Sphere
from tussle.view import MODELS
from tussle.view.shapes import Mesh, ball, box, joined
from tussle.view.solids import mesh_of, outline_of

LOW, HIGH = np.array([-100.0, -100.0, 0.0]), np.array([100.0, 100.0, 50.0])


def is_closed(mesh):
    """Each edge belongs to two triangles and is walked once in each direction."""
    walked = [(a, b) for face in mesh.faces.tolist() for a, b in zip(face, face[1:] + face[:1], strict=True)]
    return len(set(walked)) == len(walked) and {(b, a) for a, b in walked} == set(walked)


def pieces(mesh):
    """The connected pieces of a mesh."""
    label = np.arange(len(mesh.vertices))
    while True:
        least = label[mesh.faces].min(axis=1)
        new = label.copy()
        for corner in range(3):
            np.minimum.at(new, mesh.faces[:, corner], least)
        if (new == label).all():
            break
        label = new
    for root in np.unique(label):
        yield Mesh(mesh.vertices, mesh.faces[label[mesh.faces[:, 0]] == root])


def volume(mesh):
    """By the divergence theorem: positive where triangles face outwards."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]].astype(float) for i in range(3))
    return (a * np.cross(b, c)).sum() / 6.0


def welded(mesh):
    """The mesh with corners at the same place made one."""
    vertices, number = np.unique(mesh.vertices, axis=0, return_inverse=True)
    return Mesh(vertices, number.ravel()[mesh.faces])


@pytest.mark.parametrize("name", MODELS)
def test_models_are_closed_and_face_outwards(name):
    mesh = MODELS[name]
    assert mesh is MODELS[name]
    assert (mesh.vertices.dtype, mesh.faces.dtype) == (np.float32, np.int32)
    assert is_closed(mesh)
    parts = list(pieces(mesh))
    assert all(volume(part) > 1e-6 for part in parts)
    assert volume(mesh) == pytest.approx(sum(volume(part) for part in parts))
    assert len(mesh.faces) <= 320


@pytest.mark.parametrize("name", MODELS)
def test_models_are_a_metre_long_upright_and_alike_left_and_right(name):
    corners = MODELS[name].vertices
    low, high = corners.min(axis=0), corners.max(axis=0)
    assert 0.9 < high[0] - low[0] < 1.1
    assert (np.abs(0.5 * (low + high)) < 0.15).all()
    mirrored = corners * np.array([1, -1, 1], np.float32)
    gap = np.linalg.norm(mirrored[:, None] - corners[None], axis=2).min(axis=1)
    assert gap.max() < 1e-5


def test_models_with_a_nose_have_it_in_front():
    for name in ("aircraft", "boat"):  # pointed in front
        x, y, _ = MODELS[name].vertices.T
        assert np.abs(y[x > 0.45]).max() < 0.05 < np.abs(y[x < -0.45]).max()
    x, _, z = MODELS["car"].vertices.T
    assert x[z > 0.2].mean() < -0.05  # the roof lies behind the bonnet
    x, y, _ = MODELS["quadrotor"].vertices.T
    assert x[np.abs(y) < 0.09].max() > -x[np.abs(y) < 0.09].min() + 0.05  # a camera in front


def test_a_ball_is_round():
    for splits, faces in ((0, 20), (1, 80), (3, 1280)):
        mesh = ball(splits)
        assert len(mesh.faces) == faces
        assert is_closed(mesh)
        np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 0.5, rtol=1e-6)
    assert volume(ball(3)) == pytest.approx(np.pi / 6.0, rel=0.01)


def test_placing_and_joining():
    one = box((0, 0, 0), (1, 2, 3))
    assert volume(one) == pytest.approx(6.0)
    moved = one.placed(2.0, (10.0, 0.0, 0.0))
    assert volume(moved) == pytest.approx(48.0)
    assert moved.vertices.min(axis=0).tolist() == [10.0, 0.0, 0.0]
    assert volume(joined([one, moved])) == pytest.approx(54.0)
    with pytest.raises(ValueError, match="read-only"):
        one.vertices[0, 0] = 1.0


@pytest.mark.parametrize(
    ("shape", "expected", "n_edges"),
    [
        (Cuboid((1, 2, 3), (10, 20, 30), (0.3, -0.2, 1.0)), 6000.0, 12),
        (Polyhedron(((0, 0, 0), (6, 0, 0), (0, 6, 0), (0, 0, 6))), 36.0, 6),
        (Polyhedron(((1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0), (0, 0, 1), (0, 0, -1))), 4.0 / 3.0, 12),
    ],
)
def test_flat_sided_solids(shape, expected, n_edges):
    mesh, lines = mesh_of(shape, LOW, HIGH), outline_of(shape, LOW, HIGH)
    assert is_closed(welded(mesh))
    assert volume(mesh) == pytest.approx(expected, rel=1e-5)
    assert lines.shape == (n_edges, 2, 3)
    middle = mesh.vertices.mean(axis=0)
    for end in lines.reshape(-1, 3):
        assert shape.contains((middle + 0.999 * (end - middle))[:, None])[0]
        assert not shape.contains((middle + 1.001 * (end - middle))[:, None])[0]


def test_a_sphere_is_a_ball_with_three_circles():
    shape = Sphere((1, 2, 3), 7.0)
    np.testing.assert_allclose(
        np.linalg.norm(mesh_of(shape, LOW, HIGH).vertices - (1, 2, 3), axis=1), 7.0, rtol=1e-5
    )
    lines = outline_of(shape, LOW, HIGH)
    np.testing.assert_allclose(np.linalg.norm(lines - np.array([1, 2, 3]), axis=2), 7.0, rtol=1e-5)
    about = lines.reshape(-1, 3) - np.array([1, 2, 3])
    for axis in range(3):
        assert (np.abs(about[:, axis]) < 1e-5).sum() >= 2 * 48


@pytest.mark.parametrize("shape", [Plane((0, 0, 10), (1, 0, 1)), FlatGround(10.0)])
def test_what_has_no_end_is_drawn_as_far_as_one_sees(shape):
    mesh = mesh_of(shape, LOW, HIGH)
    ((normal, offset),) = shape.half_spaces()
    np.testing.assert_allclose(mesh.vertices @ np.array(normal), offset, atol=1e-4)
    a, b, c = mesh.vertices[mesh.faces[0]]
    assert np.cross(b - a, c - a) @ np.array(normal) > 0.0
    assert np.linalg.norm(mesh.vertices[2] - mesh.vertices[0]) > np.linalg.norm(HIGH - LOW)
    assert outline_of(shape, LOW, HIGH).shape == (4, 2, 3)
