"""Kernels of convex volumes and spheres: who is inside, and who was on a straight way.

They compute, point by point, what `tussle.world.shapes` says for arrays, and skip what cannot change the result.
"""

import math

from tussle.numeric.kernel import kernel, lean_device

SHORT = 1.0 - 1e-9
"""Ways that are at least this share of the whole outside of a volume only touch its surface."""

MARGIN = 1e-3
"""A sphere that is farther than a way is long by this share of its distance is not reached: rounding errors are far smaller."""


@lean_device
def is_within(faces, x, y, z):
    """Whether a point lies inside all faces, (4, faces): components of the normals, and offsets."""
    for f in range(faces.shape[1]):
        if not faces[0, f] * x + faces[1, f] * y + faces[2, f] * z < faces[3, f]:
            return False
    return True


@lean_device
def first_hit(faces, x, y, z, ux, uy, uz):
    """Distance along a ray to the first point of the surface, or inf: Kay and Kajiya, Ray tracing complex scenes, SIGGRAPH 1986."""
    enter, leave, missed = -math.inf, math.inf, False
    for f in range(faces.shape[1]):
        depth = faces[3, f] - (faces[0, f] * x + faces[1, f] * y + faces[2, f] * z)
        rate = faces[0, f] * ux + faces[1, f] * uy + faces[2, f] * uz
        if rate < 0.0:
            crossing = depth / rate
            enter = crossing if crossing > enter or math.isnan(crossing) else enter
        elif rate > 0.0:
            crossing = depth / rate
            leave = crossing if crossing < leave or math.isnan(crossing) else leave
        elif not (rate != 0.0 or depth > 0.0):
            missed = True
    first = enter if enter >= 0.0 else leave
    return first if not missed and enter <= leave and first >= 0.0 else math.inf


@lean_device
def are_beyond(faces, a, b, i):
    """Whether both ends of a way lie beyond one face, so that the way is outside."""
    for f in range(faces.shape[1]):
        east, north, up, offset = faces[0, f], faces[1, f], faces[2, f], faces[3, f]
        if east * a[0, i] + north * a[1, i] + up * a[2, i] > offset:
            if east * b[0, i] + north * b[1, i] + up * b[2, i] > offset:
                return True
    return False


@kernel("F2 F2 Bw")
def contained(faces, pos, out):
    """Write whether positions, (3, n), lie inside all faces, (4, faces), to out, (n,)."""
    for i in range(out.shape[0]):
        out[i] = is_within(faces, pos[0, i], pos[1, i], pos[2, i])


@kernel("F2 F2 F2 Bw")
def crossed(faces, a, b, out):
    """Leave true in out, (n,), where straight ways from a to b, (3, n) each, have a point inside all faces, (4, faces)."""
    for i in range(out.shape[0]):
        if not out[i]:
            continue
        ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
        if is_within(faces, ax, ay, az) or is_within(faces, bx, by, bz):
            continue
        out[i] = False
        if (ax == bx and ay == by and az == bz) or are_beyond(faces, a, b, i):
            continue
        x, y, z = bx - ax, by - ay, bz - az
        length = math.sqrt(x * x + y * y + z * z)
        unit = length if length > 0.0 else 1.0
        ux, uy, uz = x / unit, y / unit, z / unit
        outside = first_hit(faces, ax, ay, az, ux, uy, uz) + first_hit(faces, bx, by, bz, -ux, -uy, -uz)
        out[i] = outside < SHORT * length


@lean_device
def sphere_hit(center, radius, x, y, z, ux, uy, uz):
    """Distance along a ray to the first point of a sphere, or inf; by the ray's closest point, since the discriminant would cancel."""
    x, y, z = center[0] - x, center[1] - y, center[2] - z
    nearest = x * ux + y * uy + z * uz
    dx, dy, dz = x - nearest * ux, y - nearest * uy, z - nearest * uz
    away = math.sqrt(dx * dx + dy * dy + dz * dz)
    inward = (radius - away) * (radius + away)
    half = math.sqrt(inward) if inward > 0.0 else 0.0
    first = nearest - half if nearest - half >= 0.0 else nearest + half
    is_moving = ux * ux + uy * uy + uz * uz > 0.0
    return first if is_moving and inward >= 0.0 and first >= 0.0 else math.inf


@lean_device
def distance_to(center, x, y, z):
    """Distance of a point from the centre of a sphere."""
    x, y, z = x - center[0], y - center[1], z - center[2]
    return math.sqrt(x * x + y * y + z * z)


@kernel("(f8 f8 f8) f8 F2 Bw")
def sphere_contained(center, radius, pos, out):
    """Write whether positions, (3, n), lie inside a sphere to out, (n,)."""
    for i in range(out.shape[0]):
        out[i] = distance_to(center, pos[0, i], pos[1, i], pos[2, i]) < radius


@kernel("(f8 f8 f8) f8 F2 F2 Bw")
def sphere_crossed(center, radius, a, b, out):
    """Leave true in out, (n,), where straight ways from a to b, (3, n) each, have a point inside a sphere."""
    for i in range(out.shape[0]):
        if not out[i]:
            continue
        ax, ay, az, bx, by, bz = a[0, i], a[1, i], a[2, i], b[0, i], b[1, i], b[2, i]
        far = distance_to(center, ax, ay, az)
        if far < radius or distance_to(center, bx, by, bz) < radius:
            continue
        out[i] = False
        if ax == bx and ay == by and az == bz:
            continue
        x, y, z = bx - ax, by - ay, bz - az
        length = math.sqrt(x * x + y * y + z * z)
        if far - radius > length + MARGIN * (far + radius):
            continue
        unit = length if length > 0.0 else 1.0
        ux, uy, uz = x / unit, y / unit, z / unit
        one = sphere_hit(center, radius, ax, ay, az, ux, uy, uz)
        outside = one + sphere_hit(center, radius, bx, by, bz, -ux, -uy, -uz)
        out[i] = outside < SHORT * length


__all__ = ["contained", "crossed", "sphere_contained", "sphere_crossed"]
