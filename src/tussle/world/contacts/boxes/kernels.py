"""Contacts of a box with a convex body of flat faces, another box or a triangle: the separating axis test, and the clipping of faces.

S. Gottschalk, M. C. Lin and D. Manocha, OBBTree, SIGGRAPH 1996: two convex bodies are apart if a face normal of one of them, or the
cross product of two of their edges, separates them. D. Gregorius, The separating axis test between convex polyhedra, GDC 2013: the
contact points are those of one face that lie behind the other one.

A body is a row of `items`: centre, radius, half lengths, and its axes in the world frame. A found contact is a row of `found`: unit
normal from the second body to the first, point of contact seen from the centre of each, gap [m], negative where they overlap, and a
number by which a contact is known again in the next step.
"""

import math

import numpy as np

from tussle.numeric.kernel import device, lean_routine
from tussle.numeric.rigid_body import add, cross, scale

CONTACT = 11
"""Numbers of a contact: normal, two arms, gap, feature."""
MAX_FOUND = 64
"""Largest number of contacts of one body with another, or with the scene."""
PREFER_FACES = 0.02
"""Edges must separate by this much more than a face, relative to the smallest half length: faces give more points, and steadier ones."""


SAME_CORNER = 0.1
"""Points of two faces that are nearer than this, relative to the smallest half length, are one, the deeper: the faces of boxes that are
nearly aligned have eight of them, in pairs, and redundant contacts take more iterations."""


@device
def dot(a, b):
    """Scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@device
def minus(a, b):
    """Difference of two vectors."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@device
def vector(array, row, first):
    """Three numbers of a row."""
    return array[row, first], array[row, first + 1], array[row, first + 2]


@lean_routine
def put(found, n, normal, arm_a, arm_b, gap, feature):
    """Add contact number n; of too many, the one with the largest gap is dropped. Returns the number of contacts."""
    k = n
    if n == found.shape[0]:
        k = 0
        for i in range(1, n):
            k = i if found[i, 9] > found[k, 9] else k
        if found[k, 9] <= gap:
            return n
    found[k, 0], found[k, 1], found[k, 2] = normal
    found[k, 3], found[k, 4], found[k, 5] = arm_a
    found[k, 6], found[k, 7], found[k, 8] = arm_b
    found[k, 9], found[k, 10] = gap, feature
    return min(n + 1, found.shape[0])


@lean_routine
def set_box(items, k, corners, axes):
    """Write the corners (8, 3), relative to the origin, and the axes (3, 3) of a box."""
    for i in range(3):
        for j in range(3):
            axes[i, j] = items[k, 7 + 3 * i + j]
    for c in range(8):
        for j in range(3):
            corners[c, j] = (
                items[k, j]
                + (items[k, 4] if c & 4 else -items[k, 4]) * axes[0, j]
                + (items[k, 5] if c & 2 else -items[k, 5]) * axes[1, j]
                + (items[k, 6] if c & 1 else -items[k, 6]) * axes[2, j]
            )


@lean_routine
def span(corners, n, way):
    """Least and greatest component of n corners along a direction."""
    least, most = np.inf, -np.inf
    for c in range(n):
        along = corners[c, 0] * way[0] + corners[c, 1] * way[1] + corners[c, 2] * way[2]
        least, most = min(least, along), max(most, along)
    return least, most


@lean_routine
def between(first, n_first, second, n_second, way):
    """Return the gap between two bodies along a unit vector [m], and True if the first lies towards its tip."""
    low_a, high_a = span(first, n_first, way)
    low_b, high_b = span(second, n_second, way)
    return max(low_a - high_b, low_b - high_a), low_a - high_b >= low_b - high_a


@lean_routine
def face(corners, n, axes, way, polygon):
    """Write the corners of the face that looks most along a direction, in order; returns their number and the face's normal."""
    if n == 3:
        for c in range(3):
            for j in range(3):
                polygon[c, j] = corners[c, j]
        normal = vector(axes, 0, 0)
        return 3, normal if dot(normal, way) >= 0.0 else scale(-1.0, normal)
    best, most = 0, -1.0
    for i in range(3):
        along = abs(dot(vector(axes, i, 0), way))
        if along > most:
            best, most = i, along
    sign = 1.0 if dot(vector(axes, best, 0), way) >= 0.0 else -1.0
    # Corner 4 i + 2 j + k is at the ends i, j, k of the axes; the four of a face in order round it.
    own = 4 >> best
    one, two = (2, 1) if best == 0 else (4, 1) if best == 1 else (4, 2)
    base = own if sign > 0.0 else 0
    for j in range(3):
        polygon[0, j] = corners[base, j]
        polygon[1, j] = corners[base + one, j]
        polygon[2, j] = corners[base + one + two, j]
        polygon[3, j] = corners[base + two, j]
    return 4, scale(sign, vector(axes, best, 0))


@lean_routine
def clip(polygon, n, normal, limit, out):
    """Write the part of a polygon on which normal . x <= limit; returns its number of corners."""
    m = 0
    for c in range(n):
        here, there = vector(polygon, c, 0), vector(polygon, (c + 1) % n, 0)
        a, b = dot(normal, here) - limit, dot(normal, there) - limit
        if a <= 0.0 and m < out.shape[0]:
            out[m, 0], out[m, 1], out[m, 2] = here
            m += 1
        if (a < 0.0 < b or b < 0.0 < a) and m < out.shape[0]:
            out[m, 0], out[m, 1], out[m, 2] = add(here, scale(a / (a - b), minus(there, here)))
            m += 1
    return m


@lean_routine
def clipped_faces(bodies, way, reach, centers, is_first, found, n, scratch):
    """Add the points of the face of one body that lie behind a face of the other.

    bodies: corners, number, axes of the body with the reference face, then of the other; way: unit vector from the first to the other.
    centers: of the first and of the other body. is_first: the body with the reference face is the first of the contact.
    """
    corners, n_corners, axes, others, n_others, other_axes = bodies
    center, other_center = centers
    reference, polygon, spare = scratch
    n_sides, normal = face(corners, n_corners, axes, way, reference)
    m, _ = face(others, n_others, other_axes, scale(-1.0, normal), polygon)
    middle = 0.0, 0.0, 0.0
    for c in range(n_sides):
        middle = add(middle, scale(1.0 / n_sides, vector(reference, c, 0)))
    for c in range(n_sides):
        here, there = vector(reference, c, 0), vector(reference, (c + 1) % n_sides, 0)
        side = cross(minus(there, here), normal)
        if dot(side, minus(middle, here)) > 0.0:
            side = scale(-1.0, side)
        m = clip(polygon, m, side, dot(side, here), spare)
        for k in range(m):
            for j in range(3):
                polygon[k, j] = spare[k, j]
    height = dot(normal, vector(reference, 0, 0))
    for k in range(m):
        point = vector(polygon, k, 0)
        gap = dot(normal, point) - height
        if gap <= reach:
            own = minus(minus(point, scale(gap, normal)), center)
            other = minus(point, other_center)
            if is_first:
                n = put(found, n, scale(-1.0, normal), own, other, gap, 0.0)
            else:
                n = put(found, n, normal, other, own, gap, 0.0)
    return n


@lean_routine
def crossed_edges(pair, way, edges, centers, gap, found, n):
    """Add the contact of two edges: the closest points of the lines through the corners that lie deepest.

    C. Ericson, Real-Time Collision Detection (2005), section 5.1.8.
    """
    first, n_first, second, n_second = pair
    u, v = edges
    k, least = 0, np.inf
    for c in range(n_first):
        along = dot(vector(first, c, 0), way)
        if along < least:
            k, least = c, along
    j, most = 0, -np.inf
    for c in range(n_second):
        along = dot(vector(second, c, 0), way)
        if along > most:
            j, most = c, along
    p, q = vector(first, k, 0), vector(second, j, 0)
    r = minus(p, q)
    a, b, c, d, e = dot(u, u), dot(u, v), dot(u, r), dot(v, v), dot(v, r)
    divisor = a * d - b * b
    s = (b * e - c * d) / divisor if divisor > 0.0 else 0.0
    t = (a * e - b * c) / divisor if divisor > 0.0 else 0.0
    p, q = add(p, scale(s, u)), add(q, scale(t, v))
    return put(found, n, way, minus(p, centers[0]), minus(q, centers[1]), gap, 15.0)


@lean_routine
def thinned(found, first, n, distance):
    """Keep the deeper one of contacts nearer than a distance to each other; returns the number of contacts."""
    kept = first
    for i in range(first, n):
        same = kept
        for j in range(first, kept):
            way = minus(vector(found, i, 3), vector(found, j, 3))
            same = j if dot(way, way) < distance * distance else same
        if same == kept or found[i, 9] < found[same, 9]:
            for j in range(CONTACT):
                found[same, j] = found[i, j]
        kept += 1 if same == kept else 0
    return kept


@lean_routine
def least_gap_of_boxes(items, k, j, reach, r, slack):
    """Largest gap of two boxes along an axis [m], inf if they are further apart than `reach`; that axis; its kind; edges.

    The kind is 1 for a face of the first box, 2 for one of the second, 3 for an edge of each, whose numbers follow.

    Projected half lengths instead of corners (Gottschalk, Lin and Manocha 1996, section 5). Written to r, (8, 3): cosines between the
    axes (3, 3), and the way from the second centre to the first along the axes of the first.
    """
    way = minus(vector(items, k, 0), vector(items, j, 0))
    for i in range(3):
        axis = vector(items, k, 7 + 3 * i)
        for e in range(3):
            r[i, e] = dot(axis, vector(items, j, 7 + 3 * e))
        r[3, i] = dot(axis, way)
    best, normal, kind, edge, other_edge = -np.inf, (0.0, 0.0, 1.0), 0, 0, 0
    for i in range(6):
        e = i % 3
        box = k if i < 3 else j
        along = r[3, e] if i < 3 else dot(vector(items, j, 7 + 3 * e), way)
        gap = abs(along) - items[box, 4 + e]
        for m in range(3):
            gap -= items[j, 4 + m] * abs(r[e, m]) if i < 3 else items[k, 4 + m] * abs(r[m, e])
        if gap > reach:
            return np.inf, normal, 0, 0, 0
        # The second body's faces win ties.
        if gap > best + (0.0 if i < 3 else -0.1 * slack):
            best, kind = gap, 1 if i < 3 else 2
            normal = scale(1.0 if along >= 0.0 else -1.0, vector(items, box, 7 + 3 * e))
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for e in range(3):
            square = 1.0 - r[i, e] * r[i, e]
            if square < 1e-6:
                continue
            e1, e2 = (e + 1) % 3, (e + 2) % 3
            along, length = r[3, i2] * r[i1, e] - r[3, i1] * r[i2, e], math.sqrt(square)
            gap = abs(along) - items[k, 4 + i1] * abs(r[i2, e]) - items[k, 4 + i2] * abs(r[i1, e])
            gap -= items[j, 4 + e1] * abs(r[i, e2]) + items[j, 4 + e2] * abs(r[i, e1])
            if gap > reach * length:
                return np.inf, normal, 0, 0, 0
            if gap > (best + slack) * length:
                axis = cross(vector(items, k, 7 + 3 * i), vector(items, j, 7 + 3 * e))
                best, normal, kind = gap / length, scale((1.0 if along >= 0.0 else -1.0) / length, axis), 3
                edge, other_edge = i, e
    return best, normal, kind, edge, other_edge


@lean_routine
def least_gap_of_triangle(center, bodies, is_one_sided, reach, slack):
    """The same of a box and a triangle; bodies: corners and axes of the box, of the triangle corners, normal and edges."""
    first, axes, second, normals, edges = bodies
    best, normal, kind, edge, other_edge = -np.inf, (0.0, 0.0, 1.0), 0, 0, 0
    for i in range(4):
        axis = vector(axes, i, 0) if i < 3 else vector(normals, 0, 0)
        gap, is_above = between(first, 8, second, 3, axis)
        if i == 3:
            # The whole box lies on the side of its centre; behind a wall's surface there is the inside of the wall.
            is_above = is_one_sided or dot(axis, minus(center, vector(second, 0, 0))) >= 0.0
            low, high = span(first, 8, axis)
            height = dot(axis, vector(second, 0, 0))
            gap = low - height if is_above else height - high
        # The scene's surfaces win ties.
        if gap > best + (0.0 if i < 3 else -0.1 * slack):
            best, normal, kind = gap, axis if is_above else scale(-1.0, axis), 1 if i < 3 else 2
        if gap > reach:
            return np.inf, normal, 0, 0, 0
    for i in range(3):
        for j in range(3):
            axis = cross(vector(axes, i, 0), vector(edges, j, 0))
            square = dot(axis, axis)
            if square < 1e-6:
                continue
            axis = scale(1.0 / math.sqrt(square), axis)
            gap, is_above = between(first, 8, second, 3, axis)
            if gap > reach:
                return np.inf, normal, 0, 0, 0
            if gap > best + slack:
                best, normal, kind = gap, axis if is_above else scale(-1.0, axis), 3
                edge, other_edge = i, j
    return best, normal, kind, edge, other_edge


@lean_routine
def box_contacts(items, k, other, reach, found, n, scratch):
    """Add the contacts of box k with a body nearer than `reach` [m]; returns the number of contacts.

    other: item of the other box, -1 for a triangle; corners (8, 3); axes (3, 3), of a triangle its normal; edges (3, 3), unit
    vectors; whether only the side of the normal is solid, as for the triangle of a wall. scratch: arrays (8, 3), (3, 3) and three (16, 3).
    """
    box, second, axes_b, edges_b, is_one_sided = other
    first, axes_a, reference, polygon, spare = scratch
    center_a = vector(items, k, 0)
    center_b, n_second = (vector(items, box, 0), 8) if box >= 0 else ((0.0, 0.0, 0.0), 3)
    slack = PREFER_FACES * min(items[k, 4], items[k, 5], items[k, 6])
    if box >= 0:
        best, way, kind, edge_a, edge_b = least_gap_of_boxes(items, k, box, reach, first, slack)
        if best > reach:
            return n
        set_box(items, k, first, axes_a)
        set_box(items, box, second, axes_b)
    else:
        set_box(items, k, first, axes_a)
        best, way, kind, edge_a, edge_b = least_gap_of_triangle(
            center_a, (first, axes_a, second, axes_b, edges_b), is_one_sided, reach, slack
        )
        if best > reach:
            return n
    if is_one_sided and dot(way, vector(axes_b, 0, 0)) < -1e-3:
        return n
    if kind == 3:
        edges = vector(axes_a, edge_a, 0), vector(edges_b, edge_b, 0)
        return crossed_edges((first, 8, second, n_second), way, edges, (center_a, center_b), best, found, n)
    polygons, before = (reference, polygon, spare), n
    if kind == 1:
        bodies = first, 8, axes_a, second, n_second, axes_b
        n = clipped_faces(bodies, scale(-1.0, way), reach, (center_a, center_b), True, found, n, polygons)
    else:
        bodies = second, n_second, axes_b, first, 8, axes_a
        n = clipped_faces(bodies, way, reach, (center_b, center_a), False, found, n, polygons)
    n = thinned(found, before, n, SAME_CORNER * min(items[k, 4], items[k, 5], items[k, 6]))
    for i in range(
        before, n
    ):  # the octant of the box: it stays the same when the polygon gets another corner
        arm = vector(found, i, 3)
        found[i, 10] = 0.0
        for j in range(3):
            found[i, 10] += float(1 << j) if dot(arm, vector(axes_a, j, 0)) > 0.0 else 0.0
    return n
