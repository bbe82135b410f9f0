"""Contacts of bodies with the static scene: half-spaces, triangles and height fields.

The triangle of a wall, of a building or of terrain is solid behind its outward normal; that of a mesh has two sides.
"""

import math

import numpy as np

from tussle.numeric.kernel import kernel, lean_routine
from tussle.numeric.rigid_body import add, cross, scale
from tussle.numeric.triangle import closest_weights
from tussle.world.contacts.bodies.kernels import (
    BOX_REACH,
    MAX_ADVANCES,
    SLACK,
    advanced,
    size_of,
    unit_or,
)
from tussle.world.contacts.boxes.kernels import CONTACT, MAX_FOUND, box_contacts, dot, minus, put, vector

TRIANGLE = 13
"""Numbers of a triangle: corners, unit normal, 1 if only the side of the normal is outside."""
STACK = 128
SAME_PLACE = 1e-3
"""Contacts nearer than this, relative to the body's size, are one."""


@lean_routine
def closest_on_triangle(t, k, p):
    """Closest point of a triangle to a point."""
    a = vector(t, k, 0)
    b, c = minus(vector(t, k, 3), a), minus(vector(t, k, 6), a)
    s, w = closest_weights(b, c, minus(p, a))
    return add(a, add(scale(s, b), scale(w, c)))


@lean_routine
def point_of_triangle(t, k, p):
    """Closest point of a triangle, unit normal towards a point p, and signed distance of p: negative behind a wall's surface."""
    q = closest_on_triangle(t, k, p)
    way = minus(p, q)
    normal, distance = vector(t, k, 9), math.sqrt(dot(way, way))
    if t[k, 12] > 0.0 and dot(way, normal) < 0.0:
        # Behind the surface: below its inside only, so that it does not act beyond its edges.
        depth = dot(way, normal)
        return q, normal, -distance if distance <= -depth * (1.0 + 1e-9) else 1e300
    return q, unit_or(way, distance, normal), distance


@lean_routine
def ball_triangle_contact(place, radius, center, t, k, motion, found, n, feature):
    """Add the contact of a ball at center + place with a triangle, if it touches within the motion [m]."""
    start = add(center, place)
    point, normal, distance = point_of_triangle(t, k, start)
    if distance - radius > SLACK * radius:
        s, is_hit = 0.0, False
        for _ in range(MAX_ADVANCES):
            s, is_over, is_hit = advanced(s, distance - radius, -dot(normal, motion), radius)
            if is_over:
                break
            point, normal, distance = point_of_triangle(t, k, add(start, scale(s, motion)))
        if not is_hit or distance - radius <= -radius:
            return n
    elif distance < -radius:
        return n
    gap = dot(normal, minus(start, point)) - radius
    # At an edge inside one surface, for example a floor of triangles, the contact is with the face beside it, not with the edge.
    for i in range(n):
        if found[i, 10] == feature:
            apart = minus(point, vector(found, i, 6))
            if abs(dot(apart, vector(found, i, 0))) <= SAME_PLACE * radius:
                return n
            if abs(dot(apart, normal)) <= SAME_PLACE * radius:
                found[i, 9] = np.inf
    return put(found, n, normal, minus(place, scale(radius, normal)), point, gap, feature)


@lean_routine
def round_triangle_contacts(items, a, t, k, motion, found, n):
    """Add the contacts of a sphere or capsule with a triangle."""
    radius, half, u, center = items[a, 3], items[a, 4], vector(items, a, 7), vector(items, a, 0)
    if half == 0.0:
        return ball_triangle_contact((0.0, 0.0, 0.0), radius, center, t, k, motion, found, n, 0.0)
    n = ball_triangle_contact(scale(half, u), radius, center, t, k, motion, found, n, 0.0)
    n = ball_triangle_contact(scale(-half, u), radius, center, t, k, motion, found, n, 1.0)
    s = 0.0
    for _ in range(12):  # alternate projections onto two convex bodies
        q = closest_on_triangle(t, k, add(center, scale(s, u)))
        s = min(max(dot(u, minus(q, center)), -half), half)
    if abs(s) > 0.95 * half:
        return n
    return ball_triangle_contact(scale(s, u), radius, center, t, k, motion, found, n, 2.0)


@lean_routine
def box_triangle_contacts(items, a, t, k, motion, found, n, scratch):
    """Add the contacts of a box with a triangle, but for those where it has one already."""
    corners, axes, edges, inner = scratch
    for c in range(3):
        for j in range(3):
            corners[c, j] = t[k, 3 * c + j]
            axes[0, j] = t[k, 9 + j]
    for c in range(3):
        edge = minus(vector(corners, (c + 1) % 3, 0), vector(corners, c, 0))
        edges[c, 0], edges[c, 1], edges[c, 2] = unit_or(edge, math.sqrt(dot(edge, edge)), (1.0, 0.0, 0.0))
    size = size_of(items, a)
    reach = max(SLACK * size, min(BOX_REACH * size, math.sqrt(dot(motion, motion))))
    other = -1, corners, axes, edges, t[k, 12] > 0.0
    m = box_contacts(items, a, other, reach, found, n, inner)
    kept = n
    for i in range(n, m):
        is_new = True
        for j in range(kept):
            way = minus(vector(found, i, 6), vector(found, j, 6))
            if (
                dot(way, way) <= (SAME_PLACE * size) ** 2
                and dot(vector(found, i, 0), vector(found, j, 0)) > 0.99
            ):
                is_new = False
        if is_new:
            for j in range(CONTACT):
                found[kept, j] = found[i, j]
            kept += 1
    return kept


@lean_routine
def leave_far_sides(found, n, radius):
    """Leave out the contacts of a sphere or capsule with surfaces that it is behind, but has not entered.

    A centre that is nearer to the outside of another surface that faces it is in front of a thin wall, not inside: the far side of
    that wall would push it through.
    """
    for k in range(n):
        depth = -(found[k, 9] + radius)
        for j in range(n):
            outside = found[j, 9] + radius
            if (
                depth > 0.0
                and 0.0 <= outside < depth
                and found[j, 10] == found[k, 10]
                and dot(vector(found, j, 0), vector(found, k, 0)) < 0.0
            ):
                found[k, 9] = np.inf


@lean_routine
def one_by_octant(found, n, size):
    """Keep one contact of a box with one plane in each octant of the box; returns the number of contacts.

    Where a floor is made of triangles, its edges add contacts between the corners of the box, and redundant contacts take more
    iterations. The outermost is kept, or one that is deeper by more than the slack.
    """
    kept = 0
    for i in range(n):
        same = kept
        for j in range(kept):
            apart = minus(vector(found, i, 6), vector(found, j, 6))
            normal = vector(found, j, 0)
            is_same = found[i, 10] == found[j, 10] and dot(vector(found, i, 0), normal) > 0.9999
            same = j if is_same and abs(dot(apart, normal)) <= SAME_PLACE * size else same
        deeper = 0.0 if same == kept else found[same, 9] - found[i, 9]
        arm, other = vector(found, i, 3), vector(found, same, 3)
        if (
            same == kept
            or deeper > SLACK * size
            or (deeper >= -SLACK * size and dot(arm, arm) > dot(other, other))
        ):
            for j in range(CONTACT):
                found[same, j] = found[i, j]
        kept += 1 if same == kept else 0
    return kept


@lean_routine
def triangle_contacts(items, a, t, k, motion, found, n, scratch):
    """Add the contacts of a body with a triangle; returns their number."""
    if items[a, 3] > 0.0:
        return round_triangle_contacts(items, a, t, k, motion, found, n)
    return box_triangle_contacts(items, a, t, k, motion, found, n, scratch)


@lean_routine
def plane_contacts(items, a, planes, k, motion, found, n):
    """Add the contacts of a body with a half-space m . x < d; planes (n, 4)."""
    normal, center = vector(planes, k, 0), vector(items, a, 0)
    radius, slack = items[a, 3], SLACK * size_of(items, a) - min(0.0, dot(normal, motion))
    n_ends = 8 if radius == 0.0 else 2 if items[a, 4] > 0.0 else 1
    for c in range(n_ends):
        x = items[a, 4] if c & 1 else -items[a, 4]
        y = items[a, 5] if c & 2 else -items[a, 5]
        z = items[a, 6] if c & 4 else -items[a, 6]
        place = add(
            add(scale(x, vector(items, a, 7)), scale(y, vector(items, a, 10))), scale(z, vector(items, a, 13))
        )
        place = minus(place, scale(radius, normal))
        gap = dot(normal, add(center, place)) - planes[k, 3]
        if gap <= slack:
            point = minus(add(center, place), scale(gap, normal))
            n = put(found, n, normal, place, point, gap, float(c))
    return n


@lean_routine
def tree_contacts(items, a, box, surface, motion, found, n, stack):
    """Add the contacts of a body with the triangles of a tree that a box, lower and upper corner, meets."""
    bounds, links, root, triangles, t, inner = surface
    depth = 0
    if root >= 0:
        stack[0] = root
        depth = 1
    while depth > 0:
        depth -= 1
        node = stack[depth]
        meets = True
        for j in range(3):
            meets = meets and bounds[node, j] <= box[1][j] and box[0][j] <= bounds[node, 3 + j]
        if not meets:
            continue
        if links[node, 1] < 0:
            stack[depth], stack[depth + 1] = links[node, 0], links[node, 0] + 1
            depth += 2
            continue
        for k in range(links[node, 0], links[node, 0] + links[node, 1]):
            for j in range(TRIANGLE):
                t[0, j] = triangles[
                    k, j
                ]  # as for a field: one array type, so that the compiler makes one version
            n = triangle_contacts(items, a, t, 0, motion, found, n, inner)
    return n


@lean_routine
def field_contacts(items, a, box, field, motion, found, n):
    """Add the contacts of a body with the triangles of a height field below and above which a box lies."""
    height, grid, t, inner = field
    ny, nx = height.shape
    low, high = box
    if ny < 2 or low[2] > grid[5]:
        return n
    west, south, wide = grid[0], grid[1], grid[2]
    # Compared as numbers first: a box far away is not brought into the range of integers.
    u0, u1 = max((low[0] - west) / wide, 0.0), min((high[0] - west) / wide, nx - 1.0)
    v0, v1 = max((low[1] - south) / wide, 0.0), min((high[1] - south) / wide, ny - 1.0)
    if not (u0 <= u1 and v0 <= v1):
        return n
    for j in range(math.floor(v0), min(math.floor(v1), ny - 2) + 1):
        for i in range(math.floor(u0), min(math.floor(u1), nx - 2) + 1):
            if low[2] > max(height[j, i], height[j, i + 1], height[j + 1, i], height[j + 1, i + 1]):
                continue
            for half in range(2):
                for c in range(3):
                    # Corners (0, 0), (1, 0), (1, 1) below the diagonal, and (0, 0), (1, 1), (0, 1) above it.
                    e = 1 if (c == 1 or (c == 2 and half == 0)) else 0
                    f = 1 if (c == 2 or (c == 1 and half == 1)) else 0
                    t[0, 3 * c], t[0, 3 * c + 1] = west + (i + e) * wide, south + (j + f) * wide
                    t[0, 3 * c + 2] = height[j + f, i + e]
                a0 = vector(t, 0, 0)
                normal = cross(minus(vector(t, 0, 3), a0), minus(vector(t, 0, 6), a0))
                t[0, 9], t[0, 10], t[0, 11] = scale(1.0 / math.sqrt(dot(normal, normal)), normal)
                t[0, 12] = 1.0
                n = triangle_contacts(items, a, t, 0, motion, found, n, inner)
    return n


@kernel("(F2 F) (F2 f8 I) F2 (F2 I2 I F2) (F2 F) I2w F2w -> i8")
def find_surfaces(bodies, motion, planes, tree, field, ints, contacts):
    """Write the contacts of bodies with the scene; returns their number, which may be larger than there is place for.

    bodies: items (n, ITEM) and the distance of their furthest point from the centre [m], (n,). motion: velocities [m/s], (3, n),
    length of a step [s], and world of each body, (n,). planes: half-spaces (k, 4). tree: bounds, links, roots, one
    for all worlds or one for each, and triangles by place (m, TRIANGLE). field: heights (ny, nx) and grid as for `cast_field`, or
    (0, 0). Written: ints (c, 3): row, -1, number; contacts (c, CONTACT).
    """
    items, reach = bodies
    vel, dt, world = motion
    bounds, links, roots, triangles = tree
    height, grid = field
    found, stack = np.empty((MAX_FOUND, CONTACT)), np.empty(STACK, np.int64)
    corners, axes, edges = np.empty((8, 3)), np.empty((3, 3)), np.empty((3, 3))
    inner = (
        corners, axes, edges,
        (np.empty((8, 3)), np.empty((3, 3)), np.empty((16, 3)), np.empty((16, 3)), np.empty((16, 3))),
    )  # fmt: skip
    single = np.empty((1, TRIANGLE))
    total = 0
    for a in range(items.shape[0]):
        x, y, z = dt * vel[0, a], dt * vel[1, a], dt * vel[2, a]
        far = reach[a] * (1.0 + SLACK) + math.sqrt(x * x + y * y + z * z)
        if not far < 1e9:  # a state that is not finite ends its world
            continue
        center, move = vector(items, a, 0), (x, y, z)
        low = center[0] - far, center[1] - far, center[2] - far
        high = center[0] + far, center[1] + far, center[2] + far
        n = 0
        for k in range(planes.shape[0]):
            if dot(vector(planes, k, 0), center) - planes[k, 3] <= far:
                n = plane_contacts(items, a, planes, k, move, found, n)
        root = roots[world[a] if roots.shape[0] > 1 else 0]
        n = tree_contacts(
            items, a, (low, high), (bounds, links, root, triangles, single, inner), move, found, n, stack
        )
        n = field_contacts(items, a, (low, high), (height, grid, single, inner), move, found, n)
        if items[a, 3] > 0.0:
            leave_far_sides(found, n, items[a, 3])
        else:
            n = one_by_octant(found, n, size_of(items, a))
        for k in range(n):
            if not found[k, 9] < np.inf:  # replaced by another contact
                continue
            if total < contacts.shape[0]:
                ints[total, 0], ints[total, 1], ints[total, 2] = a, -1, k
                for j in range(CONTACT):
                    contacts[total, j] = found[k, j]
            total += 1
    return total
