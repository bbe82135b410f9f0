"""Sequential impulses: the contacts of a world are solved one after another, in a fixed order, several times.

E. Catto, Iterative dynamics with temporal coherence, GDC 2005: accumulated impulses are clamped, and those of the last step are the first
guess. Overlaps are undone by moves that leave the velocities alone (split impulses). A world's contacts concern only its own bodies,
so that worlds may be solved in any order and at the same time.
"""

from __future__ import annotations

import math

import numpy as np

from tussle.contacts.bodies.kernels import SLACK
from tussle.contacts.boxes.kernels import CONTACT, dot, minus, vector
from tussle.numeric.kernel import device, kernel, routine
from tussle.numeric.rigid_body import add, cross, scale, solve

SLOTS = 12
"""Contacts that a body remembers, as the smaller of two: so many spheres of one size touch another one."""
FEATURES = 64
SETTLED = 1e-10
"""Change of the velocities [m/s] below which a world is solved."""
SHARE = 0.3
"""Share of an overlap that is undone in a step: with all of it, piles tremble."""
ROW = 13
"""Numbers of a contact for the solver: tangents, effective masses, goal of the normal speed, friction, allowed overlap, whether it turns."""


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


@routine
def turned_by(inverse, row, torque):
    """Change of the angular velocity by an angular impulse."""
    return (
        inverse[row, 1] * torque[0] + inverse[row, 2] * torque[1] + inverse[row, 3] * torque[2],
        inverse[row, 4] * torque[0] + inverse[row, 5] * torque[1] + inverse[row, 6] * torque[2],
        inverse[row, 7] * torque[0] + inverse[row, 8] * torque[1] + inverse[row, 9] * torque[2],
    )


@device
def point_velocity(moves, row, arm):
    """Velocity of a point of a body; moves (n, 6): velocity and angular velocity."""
    return add(vector(moves, row, 0), cross(vector(moves, row, 3), arm))


@device
def difference(moves, a, b, arm_a, arm_b):
    """Velocity of the first body at a contact relative to the second."""
    return minus(point_velocity(moves, a, arm_a), point_velocity(moves, b, arm_b)) if b >= 0 else point_velocity(moves, a, arm_a)


@device
def push(moves, inverse, row, arm, impulse, turns):
    """Change the velocities of a body by an impulse at a point."""
    m = inverse[row, 0]
    moves[row, 0] += m * impulse[0]
    moves[row, 1] += m * impulse[1]
    moves[row, 2] += m * impulse[2]
    if turns:
        spin = turned_by(inverse, row, cross(arm, impulse))
        moves[row, 3] += spin[0]
        moves[row, 4] += spin[1]
        moves[row, 5] += spin[2]


@routine
def push_both(moves, inverse, pair, arms, impulse, turns):
    """Change the velocities of the bodies of a contact by an impulse on the first."""
    push(moves, inverse, pair[0], arms[0], impulse, turns)
    if pair[1] >= 0:
        push(moves, inverse, pair[1], arms[1], scale(-1.0, impulse), turns)


@routine
def softness(inverse, row, arm, way):
    """Change of the speed along a direction by a unit impulse along it."""
    lever = cross(arm, way)
    return inverse[row, 0] + dot(turned_by(inverse, row, lever), lever)


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


@routine
def prepare(c, row, other, contacts, bodies, material, dt, rows):
    """Write the numbers of a contact for the solver."""
    moves, inverse, sizes = bodies
    restitution, friction, bounce_speed = material
    a, b = row[c], other[c]
    normal, arm_a, arm_b = vector(contacts, c, 0), vector(contacts, c, 3), vector(contacts, c, 6)
    t1, t2 = tangents(normal)
    gap = contacts[c, 9]
    turns = inverse[a, 1] > 0.0
    for k in range(3):
        way = normal if k == 0 else t1 if k == 1 else t2
        soft = softness(inverse, a, arm_a, way)
        if b >= 0:
            soft += softness(inverse, b, arm_b, way)
            turns = turns or inverse[b, 1] > 0.0
        rows[c, 6 + k] = 1.0 / soft if soft > 0.0 else 0.0
    speed = dot(difference(moves, a, b, arm_a, arm_b), normal)
    # A bounce if they would touch in the step; else they may approach until they touch.
    bounces = speed < -bounce_speed and restitution > 0.0 and gap + speed * dt <= 0.0
    rows[c, 9] = -restitution * speed if bounces else -max(gap, 0.0) / dt
    rows[c, 0], rows[c, 1], rows[c, 2] = t1
    rows[c, 3], rows[c, 4], rows[c, 5] = t2
    rows[c, 10] = friction
    rows[c, 11] = SLACK * (min(sizes[1, a], sizes[1, b]) if b >= 0 else sizes[1, a])
    rows[c, 12] = 1.0 if turns else 0.0


@device
def solve_contact(c, pair, contacts, moves, inverse, rows, impulses):
    """Change the velocities at one contact towards its goal; returns the square of the change of the velocity [m^2/s^2]."""
    arms = vector(contacts, c, 3), vector(contacts, c, 6)
    normal, turns = vector(contacts, c, 0), rows[c, 12] > 0.0
    change = 0.0
    limit = rows[c, 10] * impulses[c, 0]
    if limit > 0.0 or impulses[c, 1] != 0.0 or impulses[c, 2] != 0.0:
        t1, t2 = vector(rows, c, 0), vector(rows, c, 3)
        slip = difference(moves, pair[0], pair[1], arms[0], arms[1])
        p1 = impulses[c, 1] - rows[c, 7] * dot(slip, t1)
        p2 = impulses[c, 2] - rows[c, 8] * dot(slip, t2)
        length = math.sqrt(p1 * p1 + p2 * p2)
        if length > limit:  # Coulomb's cone
            p1, p2 = p1 * limit / length, p2 * limit / length
        d1, d2 = p1 - impulses[c, 1], p2 - impulses[c, 2]
        impulses[c, 1], impulses[c, 2] = p1, p2
        push_both(moves, inverse, pair, arms, add(scale(d1, t1), scale(d2, t2)), turns)
        change = d1 * d1 + d2 * d2
    speed = dot(difference(moves, pair[0], pair[1], arms[0], arms[1]), normal)
    p = max(0.0, impulses[c, 0] + rows[c, 6] * (rows[c, 9] - speed))
    d = p - impulses[c, 0]
    if d != 0.0:
        impulses[c, 0] = p
        push_both(moves, inverse, pair, arms, scale(d, normal), turns)
    soft = 1.0 / rows[c, 6]
    return (change + d * d) * soft * soft


@routine
def undo_overlap(c, pair, contacts, bodies, rows, pushes, dt):
    """Move the bodies of a contact apart, if their velocities do not do it in the next step."""
    moves, inverse, shifts = bodies
    arms = vector(contacts, c, 3), vector(contacts, c, 6)
    normal = vector(contacts, c, 0)
    # -- what is left after the next step is undone in part
    speed = dot(difference(moves, pair[0], pair[1], arms[0], arms[1]), normal)
    deep = SHARE * max(0.0, -contacts[c, 9] - rows[c, 11] - max(0.0, speed) * dt)
    done = dot(difference(shifts, pair[0], pair[1], arms[0], arms[1]), normal)
    p = max(0.0, pushes[c] + rows[c, 6] * (deep - done))
    d = p - pushes[c]
    if d != 0.0:
        pushes[c] = p
        push_both(shifts, inverse, pair, arms, scale(d, normal), rows[c, 12] > 0.0)


@kernel("(F2w F2w F2 F2) (I I F2) (F F F) f8 i8 I F2w (i8 i8)")
def solve_worlds(bodies, found, materials, dt, iterations, starts, impulses, part):
    """Solve the contacts of worlds part[0] to part[1] - 1.

    bodies: velocity and angular velocity [m/s rad/s], (n, 6), changed; shifts [m rad], (n, 6), changed from 0; inverse masses (n, 10);
    sizes [m] (2, n). found: row, other row (-1 for the scene), (m,), and contacts (m, CONTACT). materials: restitution, friction, and
    speed from which bodies bounce [m/s], by world. dt: time until the next call [s]. starts: first contact of each world,
    (n_worlds + 1,). impulses: along the normal and both tangents [N s], (m, 3), first guess and result.
    """
    moves, shifts, inverse, sizes = bodies
    row, other, contacts = found
    restitution, friction, bounce_speed = materials
    rows = np.empty((starts[part[1]] - starts[part[0]], ROW))
    pushes = np.zeros(rows.shape[0])
    base = starts[part[0]]
    own, own_row, own_other = contacts[base:], row[base:], other[base:]
    guess = impulses[base:]
    for w in range(part[0], part[1]):
        first, last = starts[w] - base, starts[w + 1] - base
        material = restitution[w], friction[w], bounce_speed[w]
        for c in range(first, last):
            prepare(c, own_row, own_other, own, (moves, inverse, sizes), material, dt, rows)
        for c in range(first, last):
            if guess[c, 0] > 0.0 and rows[c, 6] > 0.0:
                ways = vector(own, c, 0), vector(rows, c, 0), vector(rows, c, 3)
                start = add(
                    add(scale(guess[c, 0], ways[0]), scale(guess[c, 1], ways[1])), scale(guess[c, 2], ways[2])
                )
                arms = vector(own, c, 3), vector(own, c, 6)
                push_both(moves, inverse, (own_row[c], own_other[c]), arms, start, rows[c, 12] > 0.0)
        for _ in range(iterations):
            change = 0.0
            for c in range(first, last):
                if rows[c, 6] > 0.0:
                    pair = own_row[c], own_other[c]
                    change = max(change, solve_contact(c, pair, own, moves, inverse, rows, guess))
            if change < SETTLED * SETTLED:
                break
        for _ in range((iterations + 1) // 2):
            for c in range(first, last):
                if rows[c, 6] > 0.0 and own[c, 9] < -rows[c, 11]:
                    undo_overlap(
                        c, (own_row[c], own_other[c]), own, (moves, inverse, shifts), rows, pushes, dt
                    )


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
                if kept == key:
                    p = (
                        sign * memory[SLOTS + k, own], sign * memory[2 * SLOTS + k, own],
                        sign * memory[3 * SLOTS + k, own],
                    )  # fmt: skip
                    normal = vector(contacts, c, 0)
                    t1, t2 = tangents(normal)
                    if dot(p, normal) > 0.0:
                        impulses[c, 0], impulses[c, 1], impulses[c, 2] = dot(p, normal), dot(p, t1), dot(p, t2)


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
        k = used[own]
        if not touches[c] or k >= SLOTS:
            continue
        used[own] = k + 1
        normal = vector(contacts, c, 0)
        t1, t2 = tangents(normal)
        p = add(add(scale(impulses[c, 0], normal), scale(impulses[c, 1], t1)), scale(impulses[c, 2], t2))
        memory[k, own] = 1.0 + (float(ids[partner]) if partner >= 0 else 0.0) * FEATURES + contacts[c, 10]
        memory[SLOTS + k, own], memory[2 * SLOTS + k, own] = sign * p[0], sign * p[1]
        memory[3 * SLOTS + k, own] = sign * p[2]
