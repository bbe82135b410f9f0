"""A prism over an L against the two cuboids that it is made of."""

from __future__ import annotations

import numpy as np
import pytest

from tussle.errors import ParameterError
from tussle.scene import Cuboid, Prism
from tussle.view.solids import mesh_of, outline_of

CORNERS = ((0, 0), (4, 0), (4, 1), (1, 1), (1, 3), (0, 3))
L = Prism(CORNERS, low=-1.0, high=1.0)
FOOT = Cuboid(center=(2.0, 0.5, 0.0), lengths=(4.0, 1.0, 2.0))
LEG = Cuboid(center=(0.5, 1.5, 0.0), lengths=(1.0, 3.0, 2.0))
POINTS = np.random.default_rng(1).uniform(-3.0, 6.0, (3, 4000)) * [[1.0], [1.0], [0.5]]


def gap(box, points):
    """Vector from points to the nearest point of a box."""
    center, half = np.array(box.center)[:, None], 0.5 * np.array(box.lengths)[:, None]
    return np.clip(points, center - half, center + half) - points


def test_it_contains_what_its_parts_contain():
    inside = L.contains(POINTS)
    assert (inside == FOOT.contains(POINTS) | LEG.contains(POINTS)).all()
    assert 100 < inside.sum() < 1000
    assert not L.contains(np.full((3, 1), np.nan)).any()


def test_inward_ends_at_the_nearest_point():
    outside = POINTS[:, ~L.contains(POINTS)]
    foot, leg = gap(FOOT, outside), gap(LEG, outside)
    nearest = np.minimum(np.linalg.norm(foot, axis=0), np.linalg.norm(leg, axis=0))
    assert np.linalg.norm(L.inward(outside), axis=0) == pytest.approx(nearest, abs=1e-12)


def test_rays_end_at_the_first_surface():
    outside = POINTS[:, ~L.contains(POINTS)]
    way = np.random.default_rng(2).normal(size=outside.shape)
    assert L.ray(outside, way) == pytest.approx(np.minimum(FOOT.ray(outside, way), LEG.ray(outside, way)))
    inside = np.array([[0.5], [0.5], [0.0]])
    for way, distance in (((1, 0, 0), 3.5), ((0, 2, 0), 2.5), ((0, 0, -1), 1.0), ((0, 0, 0), np.inf)):
        assert L.ray(inside, np.array(way, float)[:, None])[0] == distance


def test_pictures_show_its_walls_from_outside():
    for shape in (L, Prism(CORNERS[::-1], low=-1.0, high=1.0)):
        assert len(outline_of(shape, np.zeros(3), np.zeros(3))) == 18  # six above, six below, six between
        mesh = mesh_of(shape, np.zeros(3), np.zeros(3))
        a, b, c = (np.asarray(mesh.vertices, float)[mesh.faces[:, i]] for i in range(3))
        normal, middle = np.cross(b - a, c - a), (a + b + c) / 3.0
        assert not L.contains((middle + 0.01 * normal).T).any()
        assert L.contains((middle - 0.01 * normal).T).all()


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"corners": ((0, 0), (1, 0))}, "2 corners; it takes 3 to 1000"),
        ({"corners": ((0, 0), (1, 1), (2, 2))}, "all of them lie on one line"),
        ({"corners": ((0.1, 0.3), (0.2, 0.6), (0.3, 0.9), (0.1, 0.3))}, "all of them lie on one line"),
        ({"corners": ((5, 5), (5, 5), (5, 5))}, "all of them lie on one line"),
        ({"corners": ((0, 0), (1, 0), (0, np.inf))}, "finite numbers"),
        ({"corners": CORNERS, "low": 2.0, "high": 2.0}, "Prism.high = 2.0.*> 2"),
    ],
)
def test_values_are_checked(values, text):
    with pytest.raises(ParameterError, match=text):
        Prism(**values)


@pytest.mark.parametrize("way", [1, -1])
def test_roof_and_floor_cover_a_concave_prism_and_face_outwards(way):
    corners = [(0, 0), (20, 0), (20, 10), (10, 10), (10, 20), (0, 20)][::way]
    area = {}
    for a, b, c in Prism(corners, low=1.0, high=5.0).ends():
        _, _, up = np.cross(b - a, c - a)
        assert a[2] == b[2] == c[2]
        area[a[2]] = area.get(a[2], 0.0) + 0.5 * up
    assert area == pytest.approx({5.0: 300.0, 1.0: -300.0})
