"""Spheres that move straight through a scene, against many points of their ways."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tussle.scene import Cuboid, HeightField, Plane, Scene, Sphere, TriangleMesh

N, FINE = 20, 401


def scene(chance):
    """A thin wall, a ball, a block at an angle, a half-space, hills and a triangle, placed by chance."""
    walls = [
        Cuboid(center=chance.normal(0, 1, 3), lengths=(0.01, 4, 4)),
        Sphere(center=chance.normal(0, 4, 3), radius=1.0),
        Cuboid(center=chance.normal(0, 4, 3), lengths=(2, 1, 3), rpy=chance.normal(0, 1, 3)),
        Plane(point=(0, 0, -6), normal=(0, 0, 1)),
    ]
    mesh = TriangleMesh(chance.normal(0, 3, (3, 3)), np.array([[0, 1, 2]]))
    return Scene(
        walls=walls, terrain=HeightField(chance.normal(-4, 0.5, (41, 41)), -50, -50, 2.5), meshes=[mesh]
    )


@given(st.integers(0, 10_000), st.sampled_from([0.0, 0.02, 0.3, 1.0]), st.sampled_from([0.01, 1.0, 6.0]))
def test_a_moving_sphere_is_free_if_all_points_of_its_way_are(seed, radius, length):
    chance = np.random.default_rng(seed)
    world, a = scene(chance), chance.uniform(-7, 7, (3, N))
    b = a + chance.normal(0, length, (3, N))
    ways = (a[:, :, None] + (b - a)[:, :, None] * np.linspace(0, 1, FINE)).reshape(3, -1)
    found = world.free_between(a, b, radius)
    less = world.free(ways, 0.99 * radius).reshape(N, FINE).all(axis=1)
    assert (found <= (less & world.line_of_sight(a, b))).all()
    # What is free by a margin of what lies between two samples is found free.
    step = np.sqrt(((b - a) ** 2).sum(axis=0)) / (FINE - 1)
    wide = world.free(ways, np.repeat(radius + step, FINE)).reshape(N, FINE).all(axis=1)
    assert (found >= wide).all()
