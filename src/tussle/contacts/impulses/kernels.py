"""Sequential impulses: the contacts of a world are solved one after another, in a fixed order, several times.

E. Catto, Iterative dynamics with temporal coherence, GDC 2005: accumulated impulses are clamped, and those of the last step are the first
guess. Overlaps are undone by moves that leave the velocities alone (split impulses). A world's contacts concern only its own bodies,
so that worlds may be solved in any order and at the same time.
"""

from __future__ import annotations

import math

import numpy as np

from tussle.contacts.bodies.kernels import SLACK
from tussle.contacts.boxes.kernels import dot, vector
from tussle.numeric.kernel import device, kernel, routine
from tussle.numeric.rigid_body import add, cross, scale, solve

SLOTS = 12
"""Contacts that a body remembers, as the smaller of two: so many spheres of one size touch another one."""
FEATURES = 64
SETTLED = 1e-9
"""Change of the velocities [m/s] below which a world is solved."""
SHARE = 0.3
"""Share of a small overlap that is undone in a step: with all of it, piles tremble. What is deeper is undone at once."""
WAY, MASS = 16, 15
"""Numbers of a contact for each of its directions, the normal and two tangents: unit vector; how the angular velocities of both bodies
change the speed along it, and how an impulse along it changes them; last, at MASS, the effective mass."""
SOFT, GOAL, FRICTION, OVERLAP, TURNS, HOLDS, ROW = 48, 49, 50, 51, 52, 53, 54
"""Further numbers: inverse of the effective mass along the normal, goal of the normal speed, friction, allowed overlap, 1 if a body turns,
and 1 if the contact held during the whole step."""


@kernel("(F F2 F2) B F2w")
def invert_masses(bodies, moves, inverse):
    """Write inverse mass and inverse inertia tensor, world frame, (n, 10); 0 for bodies that do not move or turn.

    bodies: mass [kg] (n,), inertia tensor [kg m^2], body frame, (9, n), attitude (4, n). moves (n,).
    """
    mass, inertia, quat = bodies
    for row in range(inverse.shape[0]):
        for j in range(10):
            inverse[row, j] = 0.0
        if not moves[row] or not mass[row] > 0.0:
            continue
        inverse[row, 0] = 1.0 / mass[row]
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
                inverse[row, 1 + 3 * i + j] = turned[i]


@device
def turned_by(inverse, row, torque):
    """Change of the angular velocity by an angular impulse."""
    return (
        inverse[row, 1] * torque[0] + inverse[row, 2] * torque[1] + inverse[row, 3] * torque[2],
        inverse[row, 4] * torque[0] + inverse[row, 5] * torque[1] + inverse[row, 6] * torque[2],
        inverse[row, 7] * torque[0] + inverse[row, 8] * torque[1] + inverse[row, 9] * torque[2],
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


@device
def speed_along(moves, pair, rows, c, first):
    """Speed of the first body at a contact relative to the second, along the normal or a tangent; moves (n, 6)."""
    a, b = pair
    speed = rows[c, first] * moves[a, 0] + rows[c, first + 1] * moves[a, 1] + rows[c, first + 2] * moves[a, 2]
    if b >= 0:
        speed -= (
            rows[c, first] * moves[b, 0] + rows[c, first + 1] * moves[b, 1] + rows[c, first + 2] * moves[b, 2]
        )
    if rows[c, TURNS] > 0.0:
        speed += (
            rows[c, first + 3] * moves[a, 3]
            + rows[c, first + 4] * moves[a, 4]
            + rows[c, first + 5] * moves[a, 5]
        )
        if b >= 0:
            speed += (
                rows[c, first + 6] * moves[b, 3]
                + rows[c, first + 7] * moves[b, 4]
                + rows[c, first + 8] * moves[b, 5]
            )
    return speed


@device
def push(moves, inverse, pair, rows, c, first, impulse):
    """Change the velocities of the bodies of a contact by an impulse along the normal or a tangent on the first."""
    a, b = pair
    p = impulse * inverse[a, 0]
    moves[a, 0] += p * rows[c, first]
    moves[a, 1] += p * rows[c, first + 1]
    moves[a, 2] += p * rows[c, first + 2]
    if b >= 0:
        p = impulse * inverse[b, 0]
        moves[b, 0] -= p * rows[c, first]
        moves[b, 1] -= p * rows[c, first + 1]
        moves[b, 2] -= p * rows[c, first + 2]
    if rows[c, TURNS] > 0.0:
        moves[a, 3] += impulse * rows[c, first + 9]
        moves[a, 4] += impulse * rows[c, first + 10]
        moves[a, 5] += impulse * rows[c, first + 11]
        if b >= 0:
            moves[b, 3] += impulse * rows[c, first + 12]
            moves[b, 4] += impulse * rows[c, first + 13]
            moves[b, 5] += impulse * rows[c, first + 14]


@routine
def prepare(c, pair, lasts, contacts, bodies, material, dt, rows):
    """Write the numbers of a contact for the solver."""
    moves, inverse, sizes = bodies
    restitution, friction, bounce_speed = material
    a, b = pair
    normal, gap = vector(contacts, c, 0), contacts[c, 9]
    t1, t2 = tangents(normal)
    rows[c, TURNS] = 1.0 if inverse[a, 1] > 0.0 or (b >= 0 and inverse[b, 1] > 0.0) else 0.0
    for k in range(3):
        way = normal if k == 0 else t1 if k == 1 else t2
        lever = cross(vector(contacts, c, 3), way)
        turned = turned_by(inverse, a, lever)
        soft = inverse[a, 0] + dot(turned, lever)
        i = WAY * k
        rows[c, i], rows[c, i + 1], rows[c, i + 2] = way
        rows[c, i + 3], rows[c, i + 4], rows[c, i + 5] = lever
        rows[c, i + 9], rows[c, i + 10], rows[c, i + 11] = turned
        if b >= 0:
            lever = cross(way, vector(contacts, c, 6))
            turned = turned_by(inverse, b, lever)
            soft += inverse[b, 0] + dot(turned, lever)
            rows[c, i + 6], rows[c, i + 7], rows[c, i + 8] = lever
            rows[c, i + 12], rows[c, i + 13], rows[c, i + 14] = turned
        rows[c, i + 15] = 1.0 / soft if soft > 0.0 else 0.0
    rows[c, SOFT] = 1.0 / rows[c, MASS] if rows[c, MASS] > 0.0 else 0.0
    speed = speed_along(moves, pair, rows, c, 0)
    # A bounce if they would touch in the step; else they may approach until they touch. Newton's law also where they part and others
    # push them together again: with any other goal, the energy would grow.
    bounces = restitution > 0.0 and (
        (speed < -bounce_speed and gap + speed * dt <= 0.0) or speed > max(bounce_speed, gap / dt)
    )
    slack = SLACK * (min(sizes[1, a], sizes[1, b]) if b >= 0 else sizes[1, a])
    # A contact that lasts holds within the slack: if it closed the gap in each step, a pile would tremble.
    rests = gap <= 0.0 or (lasts and gap <= slack)
    rows[c, GOAL] = -restitution * speed if bounces else 0.0 if rests else -gap / dt
    rows[c, FRICTION], rows[c, OVERLAP] = friction, slack
    rows[c, HOLDS] = 1.0 if lasts and -0.5 * speed * dt <= slack else 0.0


@device
def solve_contact(c, pair, moves, inverse, rows, impulses):
    """Change the velocities at one contact towards its goal; returns the square of the change of the velocity [m^2/s^2]."""
    change = 0.0
    limit = rows[c, FRICTION] * impulses[c, 0]
    if limit > 0.0 or impulses[c, 1] != 0.0 or impulses[c, 2] != 0.0:
        p1 = impulses[c, 1] - rows[c, MASS + WAY] * speed_along(moves, pair, rows, c, WAY)
        p2 = impulses[c, 2] - rows[c, MASS + 2 * WAY] * speed_along(moves, pair, rows, c, 2 * WAY)
        square = p1 * p1 + p2 * p2
        if square > limit * limit:  # Coulomb's cone
            p1, p2 = p1 * limit / math.sqrt(square), p2 * limit / math.sqrt(square)
        d1, d2 = p1 - impulses[c, 1], p2 - impulses[c, 2]
        impulses[c, 1], impulses[c, 2] = p1, p2
        push(moves, inverse, pair, rows, c, WAY, d1)
        push(moves, inverse, pair, rows, c, 2 * WAY, d2)
        change = d1 * d1 + d2 * d2
    p = max(0.0, impulses[c, 0] + rows[c, MASS] * (rows[c, GOAL] - speed_along(moves, pair, rows, c, 0)))
    d = p - impulses[c, 0]
    if d != 0.0:
        impulses[c, 0] = p
        push(moves, inverse, pair, rows, c, 0, d)
    return (change + d * d) * rows[c, SOFT] * rows[c, SOFT]


@device
def undo_overlap(c, pair, gap, bodies, rows, pushes, dt):
    """Move the bodies of a contact apart, if their velocities do not do it in the next step."""
    moves, inverse, shifts = bodies
    speed = speed_along(moves, pair, rows, c, 0)
    deep = max(0.0, -gap - rows[c, OVERLAP] - max(0.0, speed) * dt)
    deep -= (1.0 - SHARE) * min(deep, 5.0 * rows[c, OVERLAP])
    p = max(0.0, pushes[c] + rows[c, MASS] * (deep - speed_along(shifts, pair, rows, c, 0)))
    d = p - pushes[c]
    if d != 0.0:
        pushes[c] = p
        push(shifts, inverse, pair, rows, c, 0, d)


@device
def push_all(c, pair, inverse, rows, impulses, factor, moves):
    """Change velocities, or shifts, by the impulses of a contact, times a factor."""
    for k in range(3):
        push(moves, inverse, pair, rows, c, WAY * k, factor * impulses[c, k])


@kernel("(F2w F2w F2 F2) (I I F2 B) (F F F) f8 i8 I F2w (i8 i8)")
def solve_worlds(bodies, found, materials, dt, iterations, starts, impulses, part):
    """Solve the contacts of worlds part[0] to part[1] - 1.

    The impulses of a contact that held acted during the whole step, so that they also undo half of the path that their change of the
    velocity makes in it: a body at rest, which its motion model lets fall in each step, stays where it is.

    bodies: velocity and angular velocity [m/s rad/s], (n, 6), changed; shifts [m rad], (n, 6), changed from 0; inverse masses (n, 10);
    sizes [m] (2, n). found: row, other row (-1 for the scene), (m,), contacts (m, CONTACT), and whether they are new, (m,). materials:
    restitution, friction, and speed from which bodies bounce [m/s], by world. dt: length of a step [s]. starts: first contact of
    each world, (n_worlds + 1,). impulses: along the normal and both tangents [N s], (m, 3), first guess and result.
    """
    moves, shifts, inverse, sizes = bodies
    row, other, contacts, is_new = found
    restitution, friction, bounce_speed = materials
    rows = np.empty((contacts.shape[0], ROW))
    pushes = np.zeros(contacts.shape[0])
    for w in range(part[0], part[1]):
        first, last = starts[w], starts[w + 1]
        material = restitution[w], friction[w], bounce_speed[w]
        for c in range(first, last):
            lasts = not is_new[c]
            prepare(c, (row[c], other[c]), lasts, contacts, (moves, inverse, sizes), material, dt, rows)
        for c in range(first, last):
            if impulses[c, 0] > 0.0:
                push_all(c, (row[c], other[c]), inverse, rows, impulses, 1.0, moves)
        for _ in range(iterations):
            change = 0.0
            for c in range(first, last):
                if rows[c, MASS] > 0.0:
                    pair = row[c], other[c]
                    change = max(change, solve_contact(c, pair, moves, inverse, rows, impulses))
            if change < SETTLED * SETTLED:
                break
        for c in range(first, last):
            if rows[c, HOLDS] > 0.0:
                push_all(c, (row[c], other[c]), inverse, rows, impulses, 0.5 * dt, shifts)
        for _ in range((iterations + 1) // 2):
            for c in range(first, last):
                if rows[c, MASS] > 0.0 and contacts[c, 9] < -rows[c, OVERLAP]:
                    pair = row[c], other[c]
                    undo_overlap(c, pair, contacts[c, 9], (moves, inverse, shifts), rows, pushes, dt)


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
            if kept > 0.0 and math.floor((kept - 1.0) / FEATURES) == partner_id:
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
