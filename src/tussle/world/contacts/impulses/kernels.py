"""Sequential impulses: the contacts of a world are solved one after another, in a fixed order, several times.

E. Catto, Iterative dynamics with temporal coherence, GDC 2005: accumulated impulses are clamped, and those of the last step are the first
guess. Overlaps are undone by moves that leave the velocities alone (split impulses). A world's contacts concern only its own bodies,
so that worlds may be solved in any order and at the same time.
"""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel, lean_device, lean_routine
from tussle.numeric.rigid_body import add, cross, scale, solve
from tussle.world.contacts.bodies.kernels import SLACK
from tussle.world.contacts.boxes.kernels import dot, minus, vector

SLOTS = 12
"""Contacts that a body remembers, as the smaller of two: so many spheres of one size touch another one."""
FEATURES = 64
SETTLED = 1e-9
"""Change of the velocities [m/s] below which a world is solved."""
SHARE = 0.3
"""Share of a small overlap that is undone in a step: if all of it were, piles would tremble. A deeper overlap is undone at once."""
BODY = 16
"""Numbers of a body, two cache lines: velocity and angular velocity, inverse mass, inverse inertia tensor, world frame."""
INVERSE = 6
NORMAL, ARM, OTHER_ARM, TANGENT, MASS, SOFT, GOAL, COUPLING, IMPULSE, PUSHED, OVERLAP, HOLDS, TURNS, ROW = (
    0, 3, 6, 9, 12, 15, 16, 17, 19, 22, 23, 24, 25, 26,
)  # fmt: skip
"""Numbers of a contact: normal; arms; first tangent; effective masses along normal and tangents, and the inverse of the first; goal of
the normal speed; by how much impulses along the tangents change the normal speed; impulses; impulses against the overlap; overlap that is
left alone; 1 if it held during the whole step; 1 if a body turns."""


@kernel("(F F2 F2) (F2 F2) B F2w")
def enter_bodies(shapes, motion, moves, bodies):
    """Write the numbers of bodies, (n, BODY); inverses are 0 for bodies that do not move or turn.

    shapes: mass [kg] (n,), inertia tensor [kg m^2], body frame, (9, n), attitude (4, n). motion: velocity and angular velocity
    [m/s rad/s], (3, n) each. moves (n,).
    """
    mass, inertia, quat = shapes
    vel, omega = motion
    for row in range(bodies.shape[0]):
        for j in range(3):
            bodies[row, j], bodies[row, 3 + j] = vel[j, row], omega[j, row]
        for j in range(INVERSE, BODY):
            bodies[row, j] = 0.0
        if not moves[row] or not mass[row] > 0.0:
            continue
        bodies[row, INVERSE] = 1.0 / mass[row]
        if not inertia[0, row] > 0.0:
            continue
        m = (
            inertia[0, row], inertia[1, row], inertia[2, row], inertia[3, row], inertia[4, row],
            inertia[5, row], inertia[6, row], inertia[7, row], inertia[8, row],
        )  # fmt: skip
        w, x, y, z = quat[0, row], quat[1, row], quat[2, row], quat[3, row]
        a = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)
        b = 2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)
        c = 2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)
        # The columns of R I^-1 R^T, for the axes a, b, c of the body in the world frame.
        for j in range(3):
            s = solve(m, (a[j], b[j], c[j]))
            turned = add(add(scale(s[0], a), scale(s[1], b)), scale(s[2], c))
            for i in range(3):
                bodies[row, 7 + 3 * i + j] = turned[i]


@lean_device
def turned_by(bodies, row, torque):
    """Change of the angular velocity by an angular impulse."""
    return (
        dot(vector(bodies, row, 7), torque),
        dot(vector(bodies, row, 10), torque),
        dot(vector(bodies, row, 13), torque),
    )


@device
def tangents(n):
    """Two unit vectors at right angles to a unit vector and to each other."""
    if abs(n[0]) > 0.6:
        length = math.sqrt(n[0] * n[0] + n[1] * n[1])
        t = n[1] / length, -n[0] / length, 0.0
    else:
        length = math.sqrt(n[1] * n[1] + n[2] * n[2])
        t = 0.0, n[2] / length, -n[1] / length
    return t, cross(n, t)


@lean_device
def slip(moves, pair, rows, c):
    """Velocity of the first body at a contact relative to the second [m/s]; moves: velocity and angular velocity in the first columns."""
    a, b = pair
    speed = vector(moves, a, 0)
    turns = rows[c, TURNS] > 0.0
    if turns:
        speed = add(speed, cross(vector(moves, a, 3), vector(rows, c, ARM)))
    if b >= 0:
        speed = minus(speed, vector(moves, b, 0))
        if turns:
            speed = minus(speed, cross(vector(moves, b, 3), vector(rows, c, OTHER_ARM)))
    return speed


@lean_device
def change(moves, row, by, way, turn):
    """Add `by` times a change of the velocity, and a change of the angular velocity."""
    moves[row, 0] += by * way[0]
    moves[row, 1] += by * way[1]
    moves[row, 2] += by * way[2]
    moves[row, 3] += turn[0]
    moves[row, 4] += turn[1]
    moves[row, 5] += turn[2]


@lean_device
def push(moves, bodies, pair, rows, c, p):
    """Change the velocities of the bodies of a contact by an impulse on the first [N s], world frame."""
    a, b = pair
    turn = 0.0, 0.0, 0.0
    turns = rows[c, TURNS] > 0.0
    if turns:
        turn = turned_by(bodies, a, cross(vector(rows, c, ARM), p))
    change(moves, a, bodies[a, INVERSE], p, turn)
    if b >= 0:
        if turns:
            turn = turned_by(bodies, b, cross(p, vector(rows, c, OTHER_ARM)))
        change(moves, b, -bodies[b, INVERSE], p, turn)


@lean_device
def impulse_of(rows, c):
    """Impulse of a contact on its first body [N s], world frame."""
    n, t = vector(rows, c, NORMAL), vector(rows, c, TANGENT)
    normal, one, two = vector(rows, c, IMPULSE)
    return add(add(scale(normal, n), scale(one, t)), scale(two, cross(n, t)))


@lean_device
def response(bodies, pair, rows, c, way):
    """Change of the relative velocity at a contact by a unit impulse on the first body [1/kg], without that along it by the masses."""
    a, b = pair
    arm = vector(rows, c, ARM)
    turn = cross(turned_by(bodies, a, cross(arm, way)), arm)
    if b >= 0:
        arm = vector(rows, c, OTHER_ARM)
        turn = add(turn, cross(turned_by(bodies, b, cross(arm, way)), arm))
    return turn


@lean_routine
def prepare(c, pair, lasts, contact, bodies, material, dt, rows):
    """Write the numbers of a contact for the solver, but for its impulses."""
    contacts, i = contact
    moves, sizes = bodies
    restitution, bounce_speed = material
    a, b = pair
    normal, gap = vector(contacts, i, 0), contacts[i, 9]
    t1, t2 = tangents(normal)
    for j in range(9):
        rows[c, j] = contacts[i, j]
    rows[c, TANGENT], rows[c, TANGENT + 1], rows[c, TANGENT + 2] = t1
    rows[c, TURNS] = 1.0 if moves[a, 7] > 0.0 or (b >= 0 and moves[b, 7] > 0.0) else 0.0
    linear = moves[a, INVERSE] + (moves[b, INVERSE] if b >= 0 else 0.0)
    for k in range(3):
        way = normal if k == 0 else t1 if k == 1 else t2
        turn = response(moves, pair, rows, c, way)
        soft = linear + dot(turn, way)
        rows[c, MASS + k] = 1.0 / soft if soft > 0.0 else 0.0
        if k == 0:
            rows[c, SOFT] = soft
        else:
            rows[c, COUPLING + k - 1] = dot(turn, normal)
    speed = dot(slip(moves, pair, rows, c), normal)
    # A bounce if they would touch in the step; else they may approach until they touch. Newton's law also where they part and others
    # push them together again: with any other goal, the energy would grow.
    bounces = restitution > 0.0 and (
        (speed < -bounce_speed and gap + speed * dt <= 0.0) or speed > max(bounce_speed, gap / dt)
    )
    slack = SLACK * (min(sizes[1, a], sizes[1, b]) if b >= 0 else sizes[1, a])
    # A contact that lasts holds within the slack: if it closed the gap in each step, a pile would tremble.
    rests = gap <= 0.0 or (lasts and gap <= slack)
    rows[c, GOAL] = -restitution * speed if bounces else 0.0 if rests else -gap / dt
    rows[c, PUSHED], rows[c, OVERLAP] = 0.0, slack
    rows[c, HOLDS] = 1.0 if lasts and -0.5 * speed * dt <= slack else 0.0


@lean_device
def solve_contact(c, pair, moves, rows, friction):
    """Change the velocities at one contact towards its goal; returns the square of the change of the velocity [m^2/s^2].

    One velocity is read and one impulse applied: what friction does to the normal speed follows from the coupling.
    """
    n, t = vector(rows, c, NORMAL), vector(rows, c, TANGENT)
    v = slip(moves, pair, rows, c)
    normal, one, two = vector(rows, c, IMPULSE)
    speed, limit = dot(n, v), friction * normal
    along, square = (0.0, 0.0, 0.0), 0.0
    if limit > 0.0 or one != 0.0 or two != 0.0:
        t2 = cross(n, t)
        p1 = one - rows[c, MASS + 1] * dot(t, v)
        p2 = two - rows[c, MASS + 2] * dot(t2, v)
        size = p1 * p1 + p2 * p2
        if size > limit * limit:  # Coulomb's cone
            cut = limit / math.sqrt(size)
            p1, p2 = p1 * cut, p2 * cut
        rows[c, IMPULSE + 1], rows[c, IMPULSE + 2] = p1, p2
        d1, d2 = p1 - one, p2 - two
        speed += rows[c, COUPLING] * d1 + rows[c, COUPLING + 1] * d2
        along, square = add(scale(d1, t), scale(d2, t2)), d1 * d1 + d2 * d2
    p = max(0.0, normal + rows[c, MASS] * (rows[c, GOAL] - speed))
    rows[c, IMPULSE] = p
    d = p - normal
    square += d * d
    if square > 0.0:
        push(moves, moves, pair, rows, c, add(along, scale(d, n)))
    return square * rows[c, SOFT] * rows[c, SOFT]


@lean_device
def undo_overlap(c, pair, gap, moves, shifts, rows, dt):
    """Move the bodies of a contact apart, if their velocities do not do it in the next step."""
    n = vector(rows, c, NORMAL)
    speed = dot(n, slip(moves, pair, rows, c))
    deep = max(0.0, -gap - rows[c, OVERLAP] - max(0.0, speed) * dt)
    deep -= (1.0 - SHARE) * min(deep, 5.0 * rows[c, OVERLAP])
    p = max(0.0, rows[c, PUSHED] + rows[c, MASS] * (deep - dot(n, slip(shifts, pair, rows, c))))
    d = p - rows[c, PUSHED]
    if d != 0.0:
        rows[c, PUSHED] = p
        push(shifts, moves, pair, rows, c, scale(d, n))


@lean_routine
def sweep(first, last, begin, row, other, moves, rows, friction, is_back):
    """Solve the contacts of one world once, one after another; returns the square of the largest change of the velocity [m^2/s^2]."""
    largest = 0.0
    for k in range(first, last):
        i = first + last - 1 - k if is_back else k
        if rows[i - begin, MASS] > 0.0:
            largest = max(largest, solve_contact(i - begin, (row[i], other[i]), moves, rows, friction))
    return largest


@lean_routine
def sweep_overlaps(first, last, begin, row, other, contacts, moves, shifts, rows, dt):
    """Undo the overlaps of one world once, one after another."""
    for i in range(first, last):
        c = i - begin
        if rows[c, MASS] > 0.0 and contacts[i, 9] < -rows[c, OVERLAP]:
            undo_overlap(c, (row[i], other[i]), contacts[i, 9], moves, shifts, rows, dt)


@kernel("(F2w F2w F2) (I I F2 B) (F F F) f8 i8 I F2w (i8 i8)")
def solve_worlds(bodies, found, materials, dt, iterations, span_start, impulses, part):
    """Solve the contacts of worlds part[0] to part[1] - 1.

    The impulses of a contact that held acted during the whole step, so that they also undo half of the path that their change of the
    velocity makes in it: a body at rest, which its motion model lets fall in each step, stays where it is.

    bodies: their numbers (n, BODY), of which the velocities are changed; shifts [m rad], (n, 6), changed from 0; sizes [m] (2, n).
    found: row, other row (-1 for the scene), (m,), contacts (m, CONTACT), and whether they are new, (m,). materials: restitution,
    friction, and speed from which bodies bounce [m/s], by world. dt: length of a step [s]. span_start: first contact of each world,
    (n_worlds + 1,). impulses: along the normal and both tangents [N s], (m, 3), first guess and result.
    """
    moves, shifts, sizes = bodies
    row, other, contacts, is_new = found
    restitution, friction, bounce_speed = materials
    world, end = part
    begin = span_start[world]
    rows = np.empty((span_start[end] - begin, ROW))
    for w in range(world, end):
        first, last = span_start[w], span_start[w + 1]
        for i in range(first, last):
            c, pair = i - begin, (row[i], other[i])
            material = restitution[w], bounce_speed[w]
            prepare(c, pair, not is_new[i], (contacts, i), (moves, sizes), material, dt, rows)
            for k in range(3):
                rows[c, IMPULSE + k] = impulses[i, k]
        for i in range(first, last):
            if impulses[i, 0] > 0.0:
                push(moves, moves, (row[i], other[i]), rows, i - begin, impulse_of(rows, i - begin))
        for k in range(iterations):
            square = sweep(first, last, begin, row, other, moves, rows, friction[w], k % 2 == 1)
            if square < SETTLED * SETTLED:
                break
        for i in range(first, last):
            c, pair = i - begin, (row[i], other[i])
            for k in range(3):
                impulses[i, k] = rows[c, IMPULSE + k]
            if rows[c, HOLDS] > 0.0:
                push(shifts, moves, pair, rows, c, scale(0.5 * dt, impulse_of(rows, c)))
        for _ in range((iterations + 1) // 2):
            sweep_overlaps(first, last, begin, row, other, contacts, moves, shifts, rows, dt)


@device
def owner(c, row, other, sizes):
    """Row of the body that remembers a contact, that of its partner, and the sign of the impulse on it."""
    a, b = row[c], other[c]
    return (b, a, -1.0) if b >= 0 and sizes[0, b] < sizes[0, a] else (a, b, 1.0)


@kernel("(I I F2) (I F2) F2 F2w Bw")
def recall(found, bodies, memory, impulses, is_new):
    """Write the impulses of the last step as a first guess, (m, 3), and which contacts are of bodies that did not touch then, (m,).

    found: row, other row, contacts. bodies: ids (n,) and sizes (2, n). memory (4 SLOTS, n): keys, then impulses on the body [N s].
    """
    row, other, contacts = found
    ids, sizes = bodies
    is_taken = np.zeros((SLOTS, ids.shape[0]), np.bool_)
    for c in range(is_new.shape[0]):
        own, partner, sign = owner(c, row, other, sizes)
        partner_id = float(ids[partner]) if partner >= 0 else 0.0
        key = 1.0 + partner_id * FEATURES + contacts[c, 10]
        impulses[c, 0] = impulses[c, 1] = impulses[c, 2] = 0.0
        is_new[c] = True
        for k in range(SLOTS):
            kept = memory[k, own]
            if not kept > 0.0:
                break
            if math.floor((kept - 1.0) / FEATURES) == partner_id:
                is_new[c] = False
                if kept == key and not is_taken[k, own]:
                    is_taken[k, own] = True
                    key = -1.0
                    p = (
                        sign * memory[SLOTS + k, own], sign * memory[2 * SLOTS + k, own],
                        sign * memory[3 * SLOTS + k, own],
                    )  # fmt: skip
                    normal = vector(contacts, c, 0)
                    t1, t2 = tangents(normal)
                    if dot(p, normal) > 0.0:
                        impulses[c, 0], impulses[c, 1], impulses[c, 2] = (
                            dot(p, normal),
                            dot(p, t1),
                            dot(p, t2),
                        )


@kernel("(I I F2) (I F2) F2 F2w Bw")
def remember(found, bodies, impulses, memory, touches):
    """Write the impulses of this step to the memory (4 SLOTS, n), and which contacts touch: an impulse acts, or they overlap."""
    row, other, contacts = found
    ids, sizes = bodies
    used = np.zeros(ids.shape[0], np.int64)
    memory[:SLOTS] = 0.0
    for c in range(touches.shape[0]):
        touches[c] = impulses[c, 0] > 0.0 or contacts[c, 9] <= 0.0
        own, partner, sign = owner(c, row, other, sizes)
        if not touches[c] or used[own] >= SLOTS:
            continue
        k = min(used[own], SLOTS - 1)
        used[own] += 1
        normal = vector(contacts, c, 0)
        t1, t2 = tangents(normal)
        p = add(add(scale(impulses[c, 0], normal), scale(impulses[c, 1], t1)), scale(impulses[c, 2], t2))
        memory[k, own] = 1.0 + (float(ids[partner]) if partner >= 0 else 0.0) * FEATURES + contacts[c, 10]
        memory[SLOTS + k, own], memory[2 * SLOTS + k, own] = sign * p[0], sign * p[1]
        memory[3 * SLOTS + k, own] = sign * p[2]
