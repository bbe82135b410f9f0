"""Contacts of spheres, capsules and boxes.

A sphere is a point with a radius, a capsule a segment along its x axis with a radius. A pair that is apart is followed along its
relative motion in the step, so that fast bodies do not pass through each other, and the normal is that of the first touch. Rotation
is not followed. The distance of convex bodies that move along a line is a convex function of time, so that Newton's method does not
pass the first touch (conservative advancement; B. Mirtich, Impulse-based dynamic simulation of rigid body systems, 1996, section 2.3).
"""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel, lean_device, lean_routine
from tussle.numeric.rigid_body import add, cross, scale
from tussle.world.contacts.boxes.kernels import (
    CONTACT,
    MAX_FOUND,
    box_contacts,
    dot,
    minus,
    put,
    vector,
)

ITEM = 16
"""Numbers of a body: centre, radius, half lengths, axes."""
SLACK = 0.01
"""Gap below which bodies touch, and overlap that is left alone, relative to the size of the smaller one. Without it, a body at rest
would lose and find its contacts in turn."""
MAX_ADVANCES = 24
BOX_REACH = 0.25
"""Boxes are not followed, but are kept apart from this gap on, relative to the smallest half length, if they approach fast enough."""
UP = (0.0, 0.0, 1.0)


@lean_device
def size_of(items, k):
    """Radius, or smallest half length of a box [m]."""
    return items[k, 3] if items[k, 3] > 0.0 else min(items[k, 4], items[k, 5], items[k, 6])


@kernel("(F2 F2 F) I F2 F2w F2w")
def place_shapes(bodies, block, shapes, items, sizes):
    """Write the items (n, ITEM) of all bodies; the distance of their furthest point from the centre, and their size [m], (2, n).

    bodies: positions [m] (3, n), attitudes (4, n), radii [m] (n,). block (n,). shapes: radius and half lengths of each block [m],
    (n_blocks, 4); a negative radius for spheres with the body's own one.
    """
    pos, quat, radius = bodies
    for row in range(block.shape[0]):
        b = min(max(block[row], 0), shapes.shape[0] - 1)
        w, x, y, z = quat[0, row], quat[1, row], quat[2, row], quat[3, row]
        items[row, 0], items[row, 1], items[row, 2] = pos[0, row], pos[1, row], pos[2, row]
        items[row, 3] = radius[row] if shapes[b, 0] < 0.0 else shapes[b, 0]
        items[row, 4], items[row, 5], items[row, 6] = shapes[b, 1], shapes[b, 2], shapes[b, 3]
        items[row, 7], items[row, 8] = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z)
        items[row, 9], items[row, 10] = 2.0 * (x * z - w * y), 2.0 * (x * y - w * z)
        items[row, 11], items[row, 12] = 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)
        items[row, 13], items[row, 14] = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x)
        items[row, 15] = 1.0 - 2.0 * (x * x + y * y)
        half = vector(items, row, 4)
        sizes[0, row], sizes[1, row] = items[row, 3] + math.sqrt(dot(half, half)), size_of(items, row)


@device
def unit_or(v, length, other):
    """A vector over its length, or another vector where it has none."""
    return scale(1.0 / length, v) if length > 0.0 else other


@lean_routine
def closest_of_segments(offset, u, a, v, b):
    """Places s in [-a, a] and t in [-b, b] of the closest points offset + s u and t v. C. Ericson (2005), section 5.1.9."""
    cosine, c, f = dot(u, v), dot(u, offset), dot(v, offset)
    divisor = 1.0 - cosine * cosine
    s = (cosine * f - c) / divisor if divisor > 1e-9 and a > 0.0 and b > 0.0 else (-c if b == 0.0 else 0.0)
    s = min(max(s, -a), a)
    t = min(max(cosine * s + f, -b), b)
    s = min(max(cosine * t - c, -a), a)
    return s, t


@lean_routine
def segment_gap(first, a, second, b, offset):
    """Points on the segments seen from their centres, difference and distance; the first body moved by offset from the second's centre."""
    u, v = vector(first, a, 7), vector(second, b, 7)
    s, t = closest_of_segments(offset, u, first[a, 4], v, second[b, 4])
    p, q = scale(s, u), scale(t, v)
    way = minus(add(offset, p), q)
    return p, q, way, math.sqrt(dot(way, way))


@device
def advanced(s, gap, rate, radius):
    """A step of conservative advancement: share of the motion, whether the search is over, and whether the bodies touch.

    gap: distance of the surfaces after the share s of the motion [m]. rate: by how much it closes along the whole motion, at most [m].
    """
    if gap <= 1e-9 * radius:
        return s, True, True
    if not rate > 0.0:
        return s, True, False
    s += gap / rate
    return s, not s <= 1.0, False


@lean_routine
def round_contact(first, a, second, b, motion, found, n):
    """Add the contact of two spheres or capsules, if they touch within the motion [m] of the first relative to the second."""
    radius = first[a, 3] + second[b, 3]
    slack = SLACK * min(first[a, 3], second[b, 3])
    start = minus(vector(first, a, 0), vector(second, b, 0))
    offset = start
    p, q, way, distance = segment_gap(first, a, second, b, offset)
    if distance - radius > slack:
        s, is_hit = 0.0, False
        for _ in range(MAX_ADVANCES):
            s, is_over, is_hit = advanced(s, distance - radius, -dot(way, motion) / distance, radius)
            if is_over:
                break
            offset = add(start, scale(s, motion))
            p, q, way, distance = segment_gap(first, a, second, b, offset)
        if not is_hit:
            return n
    normal = unit_or(way, distance, UP)
    arm_a, arm_b = minus(p, scale(first[a, 3], normal)), add(q, scale(second[b, 3], normal))
    gap = dot(normal, minus(add(start, p), q)) - radius
    return put(found, n, normal, arm_a, arm_b, gap, 0.0)


@lean_routine
def round_contacts(first, a, second, b, motion, found, n):
    """Add the contacts of two spheres or capsules: two for capsules side by side."""
    u, v = vector(first, a, 7), vector(second, b, 7)
    half, other = first[a, 4], second[b, 4]
    side = cross(u, v)
    if not (half > 0.0 and other > 0.0 and dot(side, side) < 1e-3):
        return round_contact(first, a, second, b, motion, found, n)
    radius = first[a, 3] + second[b, 3]
    start = minus(vector(first, a, 0), vector(second, b, 0))
    along = -dot(u, start)
    begin = min(max(along - other, -half), half)
    end = min(max(along + other, -half), half)
    if end - begin < 1e-3 * radius:
        return round_contact(first, a, second, b, motion, found, n)
    for k in range(2):
        p = scale(begin if k == 0 else end, u)
        t = min(max(dot(v, add(start, p)), -other), other)
        way = minus(add(start, p), scale(t, v))
        distance = math.sqrt(dot(way, way))
        normal = unit_or(way, distance, UP)
        if distance - radius + min(0.0, dot(normal, motion)) <= SLACK * min(first[a, 3], second[b, 3]):
            arm_a = minus(p, scale(first[a, 3], normal))
            arm_b = add(scale(t, v), scale(second[b, 3], normal))
            n = put(found, n, normal, arm_a, arm_b, distance - radius, float(k))
    return n


@lean_routine
def point_of_box(items, b, offset):
    """Closest point of a box's surface seen from its centre, outward unit normal there, and signed distance of a point at offset."""
    x, y, z = vector(items, b, 7), vector(items, b, 10), vector(items, b, 13)
    lx, ly, lz = dot(x, offset), dot(y, offset), dot(z, offset)
    hx, hy, hz = items[b, 4], items[b, 5], items[b, 6]
    qx, qy, qz = min(max(lx, -hx), hx), min(max(ly, -hy), hy), min(max(lz, -hz), hz)
    dx, dy, dz = lx - qx, ly - qy, lz - qz
    distance = math.sqrt(dx * dx + dy * dy + dz * dz)
    if distance > 0.0:
        nx, ny, nz = dx / distance, dy / distance, dz / distance
    else:
        ex, ey, ez = abs(lx) - hx, abs(ly) - hy, abs(lz) - hz
        nx, ny, nz = 0.0, 0.0, 0.0
        distance = max(ex, ey, ez)
        if distance == ex:
            nx = 1.0 if lx >= 0.0 else -1.0
            qx = nx * hx
        elif distance == ey:
            ny = 1.0 if ly >= 0.0 else -1.0
            qy = ny * hy
        else:
            nz = 1.0 if lz >= 0.0 else -1.0
            qz = nz * hz
    point = add(add(scale(qx, x), scale(qy, y)), scale(qz, z))
    return point, add(add(scale(nx, x), scale(ny, y)), scale(nz, z)), distance


@lean_routine
def ball_box_contact(ball, box, b, motion, found, n):
    """Add the contact of a ball of a capsule with a box. ball: place seen from the centre, radius, offset of the centre, feature."""
    place, radius, start, feature, sign = ball
    offset = add(start, place)
    point, normal, distance = point_of_box(box, b, offset)
    if distance - radius > SLACK * min(radius, size_of(box, b)):
        s, is_hit = 0.0, False
        for _ in range(MAX_ADVANCES):
            s, is_over, is_hit = advanced(s, distance - radius, -dot(normal, motion), radius)
            if is_over:
                break
            point, normal, distance = point_of_box(box, b, add(offset, scale(s, motion)))
        if not is_hit:
            return n
    gap = dot(normal, minus(offset, point)) - radius
    arm = minus(place, scale(radius, normal))
    if sign > 0.0:
        return put(found, n, normal, arm, point, gap, feature)
    return put(found, n, scale(-1.0, normal), point, arm, gap, feature)


@lean_routine
def round_box_contacts(ball, a, box, b, motion, sign, found, n):
    """Add the contacts of a sphere or capsule with a box. sign: 1 if it is the first body of the contact, -1 if the second."""
    radius, half, u = ball[a, 3], ball[a, 4], vector(ball, a, 7)
    start = minus(vector(ball, a, 0), vector(box, b, 0))
    if half == 0.0:
        return ball_box_contact(((0.0, 0.0, 0.0), radius, start, 0.0, sign), box, b, motion, found, n)
    n = ball_box_contact((scale(half, u), radius, start, 0.0, sign), box, b, motion, found, n)
    n = ball_box_contact((scale(-half, u), radius, start, 1.0, sign), box, b, motion, found, n)
    s = 0.0
    for _ in range(12):  # alternate projections onto two convex bodies
        point, _, distance = point_of_box(box, b, add(start, scale(s, u)))
        if distance <= 0.0:
            break
        s = min(max(dot(u, minus(point, start)), -half), half)
    if abs(s) > 0.95 * half:
        return n
    return ball_box_contact((scale(s, u), radius, start, 2.0, sign), box, b, motion, found, n)


@lean_routine
def pair_contacts(items, a, b, motion, found, scratch):
    """Write the contacts of two bodies; returns their number."""
    is_round, other_is_round = items[a, 3] > 0.0, items[b, 3] > 0.0
    if is_round and other_is_round:
        return round_contacts(items, a, items, b, motion, found, 0)
    if is_round:
        return round_box_contacts(items, a, items, b, motion, 1.0, found, 0)
    if other_is_round:
        return round_box_contacts(items, b, items, a, scale(-1.0, motion), -1.0, found, 0)
    first, axes_a, second, axes_b, one, two, three = scratch
    size = min(size_of(items, a), size_of(items, b))
    reach = max(SLACK * size, min(BOX_REACH * size, math.sqrt(dot(motion, motion))))
    other = b, second, axes_b, axes_b, False
    return box_contacts(items, a, other, reach, found, 0, (first, axes_a, one, two, three))


@kernel("(F2 F2) (I I) (F2 f8) I2w F2w -> i8")
def find_pairs(shapes, pairs, motion, ints, contacts):
    """Write the contacts of pairs of bodies; returns their number, which may be larger than there is place for.

    shapes: items (n, ITEM), and furthest point and size of each body [m], (2, n). pairs: row and other row, (m,). motion: velocities
    [m/s], (3, n), and length of a step [s]. Written: ints (c, 3): row, other row and pair; contacts (c, CONTACT).
    """
    items, sizes = shapes
    row, other = pairs
    vel, dt = motion
    found = np.empty((MAX_FOUND, CONTACT))
    scratch = (
        np.empty((8, 3)), np.empty((3, 3)), np.empty((8, 3)), np.empty((3, 3)),
        np.empty((16, 3)), np.empty((16, 3)), np.empty((16, 3)),
    )  # fmt: skip
    n = 0
    for i in range(row.shape[0]):
        a, b = row[i], other[i]
        move = (
            dt * (vel[0, a] - vel[0, b]), dt * (vel[1, a] - vel[1, b]), dt * (vel[2, a] - vel[2, b]),
        )  # fmt: skip
        apart = minus(vector(items, a, 0), vector(items, b, 0))
        limit = (1.0 + SLACK) * (sizes[0, a] + sizes[0, b]) + math.sqrt(dot(move, move))
        if not dot(apart, apart) <= limit * limit:  # true also if a state is not finite
            continue
        for k in range(pair_contacts(items, a, b, move, found, scratch)):
            if n < contacts.shape[0]:
                ints[n, 0], ints[n, 1], ints[n, 2] = a, b, i
                for j in range(CONTACT):
                    contacts[n, j] = found[k, j]
            n += 1
    return n
