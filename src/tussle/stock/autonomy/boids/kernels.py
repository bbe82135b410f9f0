"""Boids: neighbour sums with agents as lanes, the law, and what the controllers are told.

One step: `neighbor_sums` (or `neighbor_sums_in_view`), with the historic means `historic_means`, then `law`, then what is wired
of `velocity`, `rates` and `desired`. Kernels over blocks take a range of blocks, so that threads can share them.
"""

from __future__ import annotations

import numpy as np

from tussle.neighbors.lanes import (
    LANES,
    bits,
    choose,
    inverse_sqrt,
    lanes_sqrt,
    load,
    load_some,
    splat,
    store,
    store_some,
)  # fmt: skip
from tussle.numeric import atan2, cos, sin, wrap
from tussle.numeric.kernel import device, kernel

TOUCHING = 1e10
"""Repulsion at or below the minimum range: stands for infinity (the existing system's number)."""

# Rows of the sums, (N_SUMS, n): offsets of team mates [m], their headings' unit vectors, how many, how many neighbours in all,
# repulsion from team mates and from others.
OFFSET, HEADING, N_TEAM, N_ALL, TEAM_PUSH, OTHER_PUSH, N_SUMS = 0, 3, 5, 6, 7, 10, 13

# Where the parameters of a block's lanes lie in its scratch, in groups of LANES.
REACH2, SPHERE2, SPHERE, TEAM_SCALE, TEAM_TOUCH2, OTHER_SCALE, OTHER_TOUCH2, PLACE, FRAME = (
    0,
    1,
    2,
    3,
    4,
    5,
    6,
    7,
    8,
)
VIEW = FRAME + 9  # cos(fov_az / 2), unlimited azimuth, cos(fov_el / 2), unlimited elevation
N_SCRATCH = VIEW + 4


@device
def squared_gap(x, y, z, box):
    """Squared distance of eight points from a box (west, east, south, north, low, high), 0 inside."""
    west, east, south, north, low, high = box
    dx = choose(x < west, west - x, choose(x > east, x - east, 0.0))
    dy = choose(y < south, south - y, choose(y > north, y - north, 0.0))
    dz = choose(z < low, low - z, choose(z > high, z - high, 0.0))
    return dx * dx + dy * dy + dz * dz


@device
def cull(sx, sy, sz, team, own_team, start, end, box, reach2, mates, n_mates, others, n_others):
    """Append the places in [start, end) within reach of the box to `mates` or to `others`; no branch on a single place."""
    for p in range(start, end, LANES):
        near = squared_gap(load(sx, p), load(sy, p), load(sz, p), box) < reach2
        hit = bits(near) & ((1 << min(LANES, end - p)) - 1)
        mine = hit & bits(load(team, p) == own_team)
        for k in range(LANES):
            mates[n_mates] = p + k
            n_mates += (mine >> k) & 1
        hit ^= mine
        if hit != 0:
            for k in range(LANES):
                others[n_others] = p + k
                n_others += (hit >> k) & 1
    return n_mates, n_others


@device
def take_lanes(q0, width, wanted, queries, order, first, points, own, lane):
    """Parameters of the lanes of team `wanted` into `lane`; the other lanes get a reach that nothing is within.

    Returns the lanes taken as bits, their bounding box, and their largest squared reach.
    """
    qx, qy, qz = points
    own_team, comms_range, sphere, team_range, nonteam_range = own
    taken = 0
    reach2 = 0.0
    west, east, south, north, low, high = np.inf, -np.inf, np.inf, -np.inf, np.inf, -np.inf
    for k in range(LANES):
        q = q0 + min(k, width - 1)
        row = order[queries[q]] - first
        active = (k < width) & (own_team[row] == wanted)
        radius = sphere[row]
        limit = comms_range[row] * comms_range[row] if active else -1.0
        lane[REACH2 * LANES + k] = limit
        lane[SPHERE2 * LANES + k] = min(limit, radius * radius)
        lane[SPHERE * LANES + k] = radius
        lane[TEAM_SCALE * LANES + k] = 1.0 / (radius - team_range[row])
        lane[TEAM_TOUCH2 * LANES + k] = team_range[row] * team_range[row]
        lane[OTHER_SCALE * LANES + k] = 1.0 / (radius - nonteam_range[row])
        lane[OTHER_TOUCH2 * LANES + k] = nonteam_range[row] * nonteam_range[row]
        lane[PLACE * LANES + k] = queries[q]
        if active:
            taken |= 1 << k
            reach2 = max(reach2, limit)
            west = min(west, qx[q])
            east = max(east, qx[q])
            south = min(south, qy[q])
            north = max(north, qy[q])
            low = min(low, qz[q])
            high = max(high, qz[q])
    return taken, (west, east, south, north, low, high), reach2


@device
def sum_mates(mates, n_mates, sx, sy, sz, heading_x, heading_y, x, y, z, lane, near):
    """Offsets, headings and number of team mates in reach; those near enough to repel any lane go to `near`."""
    reach2 = load(lane, REACH2 * LANES)
    sphere2 = load(lane, SPHERE2 * LANES)
    me = load(lane, PLACE * LANES)
    ax, ay, az, hx, hy, n = splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    n_near = 0
    for c in range(n_mates):
        p = mates[c]
        dx = sx[p] - x
        dy = sy[p] - y
        dz = sz[p] - z
        square = dx * dx + dy * dy + dz * dz
        inside = (square < reach2) & (me != float(p))
        ax = choose(inside, ax + dx, ax)
        ay = choose(inside, ay + dy, ay)
        az = choose(inside, az + dz, az)
        hx = choose(inside, hx + heading_x[p], hx)
        hy = choose(inside, hy + heading_y[p], hy)
        n = choose(inside, n + 1.0, n)
        near[n_near] = p
        n_near += bits(square < sphere2) != 0
    return n_near, (ax, ay, az), (hx, hy), n


@device
def push(square, sphere2, sphere, scale, touch2):
    """Repulsion over distance, by squared distance: (S - r) / (S - m) / r for m < r <= S, TOUCHING / r for r <= m, else 0."""
    inverse = inverse_sqrt(square)
    amount = choose(square <= touch2, TOUCHING * inverse, scale * (sphere * inverse - 1.0))
    return choose(square < sphere2, amount, 0.0)


@device
def sum_pushes(near, n_near, sx, sy, sz, x, y, z, lane, scale_at, touch2_at):
    """Repulsion from the listed places. Oneself is at distance 0 and pushes nowhere."""
    sphere2 = load(lane, SPHERE2 * LANES)
    sphere = load(lane, SPHERE * LANES)
    scale = load(lane, scale_at * LANES)
    touch2 = load(lane, touch2_at * LANES)
    rx, ry, rz = splat(0.0), splat(0.0), splat(0.0)
    for c in range(n_near):
        p = near[c]
        dx = sx[p] - x
        dy = sy[p] - y
        dz = sz[p] - z
        amount = push(dx * dx + dy * dy + dz * dz, sphere2, sphere, scale, touch2)
        rx -= amount * dx
        ry -= amount * dy
        rz -= amount * dz
    return rx, ry, rz


@device
def count_inside(places, n_places, sx, sy, sz, x, y, z, lane):
    """How many of the places are within each lane's reach."""
    reach2 = load(lane, REACH2 * LANES)
    n = splat(0.0)
    for c in range(n_places):
        p = places[c]
        dx = sx[p] - x
        dy = sy[p] - y
        dz = sz[p] - z
        n += choose(dx * dx + dy * dy + dz * dz < reach2, 1.0, 0.0)
    return n


@device
def find_near(b, k, blocks, points, by_place, own, first, lane, mates, others):
    """Lanes of block b of the team of its k-th query, into `lane`, and the places that may be near them.

    Returns the lanes as bits, the number of mates and the number of others.
    """
    queries, block_first, span_first, span_start, span_end, order = blocks
    sx, sy, sz, team = by_place
    q0 = block_first[b]
    wanted = own[0][order[queries[q0 + k]] - first]
    taken, box, reach2 = take_lanes(
        q0, block_first[b + 1] - q0, wanted, queries, order, first, points, own, lane
    )
    n_mates, n_others = 0, 0
    for s in range(span_first[b], span_first[b + 1]):
        n_mates, n_others = cull(
            sx,
            sy,
            sz,
            team,
            float(wanted),
            span_start[s],
            span_end[s],
            box,
            reach2,
            mates,
            n_mates,
            others,
            n_others,
        )
    return taken, n_mates, n_others


@device
def put(lane, taken, q0, queries, order, first, sums, offset, heading, n_team, n_all, team_push, other_push):
    """Write the sums of the lanes taken to their rows."""
    for at, values in ((OFFSET, offset), (TEAM_PUSH, team_push), (OTHER_PUSH, other_push)):
        store(lane, at * LANES, values[0])
        store(lane, (at + 1) * LANES, values[1])
        store(lane, (at + 2) * LANES, values[2])
    store(lane, HEADING * LANES, heading[0])
    store(lane, (HEADING + 1) * LANES, heading[1])
    store(lane, N_TEAM * LANES, n_team)
    store(lane, N_ALL * LANES, n_all)
    for k in range(LANES):
        if (taken >> k) & 1:
            row = order[queries[q0 + k]] - first
            for at in range(N_SUMS):
                sums[at, row] = lane[at * LANES + k]


@kernel("I I I I I I F F F F F F F F F I F F F F F2w i8 i8 i8 i8")
def neighbor_sums(
    queries, block_first, span_first, span_start, span_end, order, qx, qy, qz, sx, sy, sz, heading_x, heading_y, team,
    own_team, comms_range, sphere, team_range, nonteam_range, sums, first, begin, stop, most,
):  # fmt: skip
    """The sums over everyone in reach, for the queries of blocks begin ... stop - 1.

    queries to order: of the index, its blocks and their queries' positions qx, qy, qz [m]. By place (N,): sx, sy, sz positions
    [m];
    heading_x, heading_y what is averaged over team mates; team as a number. By row of the group (n,): own_team, comms_range [m],
    sphere of influence [m], minimum ranges [m]. sums (N_SUMS, n). first: row of the table that is row 0 of the group. most:
    largest number of candidates of a block. A block of several teams is walked once for each.
    """
    mates = np.empty(most + LANES, np.int64)
    near = np.empty(most + LANES, np.int64)
    others = np.empty(most + LANES, np.int64)
    lane = np.empty(N_SCRATCH * LANES)
    blocks = (queries, block_first, span_first, span_start, span_end, order)
    own = (own_team, comms_range, sphere, team_range, nonteam_range)
    for b in range(begin, stop):
        q0 = block_first[b]
        done = 0
        x, y, z = load(qx, q0), load(qy, q0), load(qz, q0)
        for k in range(block_first[b + 1] - q0):
            if (done >> k) & 1:
                continue
            taken, n_mates, n_others = find_near(
                b, k, blocks, (qx, qy, qz), (sx, sy, sz, team), own, first, lane, mates, others
            )
            done |= taken
            n_near, offset, heading, n = sum_mates(
                mates, n_mates, sx, sy, sz, heading_x, heading_y, x, y, z, lane, near
            )
            team_push = sum_pushes(near, n_near, sx, sy, sz, x, y, z, lane, TEAM_SCALE, TEAM_TOUCH2)
            n_all = n + count_inside(others, n_others, sx, sy, sz, x, y, z, lane)
            other_push = sum_pushes(others, n_others, sx, sy, sz, x, y, z, lane, OTHER_SCALE, OTHER_TOUCH2)
            put(
                lane, taken, q0, queries, order, first, sums, offset, heading, n, n_all, team_push, other_push
            )


@device
def take_views(q0, width, queries, order, first, quat, fov_azimuth, fov_elevation, lane):
    """Body axes (a rotation matrix by columns) and the cosines of half the fields of view of the lanes, into `lane`."""
    for k in range(LANES):
        row = order[queries[q0 + min(k, width - 1)]] - first
        w, x, y, z = quat[0, row], quat[1, row], quat[2, row], quat[3, row]
        base = FRAME * LANES + k
        lane[base] = 1.0 - 2.0 * (y * y + z * z)
        lane[base + LANES] = 2.0 * (x * y + w * z)
        lane[base + 2 * LANES] = 2.0 * (x * z - w * y)
        lane[base + 3 * LANES] = 2.0 * (x * y - w * z)
        lane[base + 4 * LANES] = 1.0 - 2.0 * (x * x + z * z)
        lane[base + 5 * LANES] = 2.0 * (y * z + w * x)
        lane[base + 6 * LANES] = 2.0 * (x * z + w * y)
        lane[base + 7 * LANES] = 2.0 * (y * z - w * x)
        lane[base + 8 * LANES] = 1.0 - 2.0 * (x * x + y * y)
        base = VIEW * LANES + k
        lane[base] = cos(0.5 * min(fov_azimuth[row], 2.0 * np.pi))
        lane[base + LANES] = 1.0 if fov_azimuth[row] >= 2.0 * np.pi else 0.0
        lane[base + 2 * LANES] = cos(0.5 * min(fov_elevation[row], np.pi))
        lane[base + 3 * LANES] = 1.0 if fov_elevation[row] > np.pi else 0.0


@device
def in_view(dx, dy, dz, square, lane):
    """Whether azimuth and elevation of the offset in body axes are inside the fields of view, by their cosines.

    |angle| < half is cos(angle) > cos(half) up to pi, and a full circle has no edge: someone exactly astern is seen.
    """
    f = FRAME * LANES
    bx = load(lane, f) * dx + load(lane, f + LANES) * dy + load(lane, f + 2 * LANES) * dz
    by = load(lane, f + 3 * LANES) * dx + load(lane, f + 4 * LANES) * dy + load(lane, f + 5 * LANES) * dz
    level = lanes_sqrt(bx * bx + by * by)
    v = VIEW * LANES
    azimuth = (bx > load(lane, v) * level) | (load(lane, v + LANES) > 0.0) | (level == 0.0)
    elevation = (level > load(lane, v + 2 * LANES) * lanes_sqrt(square)) | (load(lane, v + 3 * LANES) > 0.0)
    return (azimuth & elevation) | (square == 0.0)


@device
def sum_in_view(places, n_places, sx, sy, sz, heading_x, heading_y, x, y, z, lane, scale_at, touch2_at):
    """Offsets, headings, number and repulsion of the listed places that each lane reaches and sees."""
    reach2 = load(lane, REACH2 * LANES)
    sphere2 = load(lane, SPHERE2 * LANES)
    sphere = load(lane, SPHERE * LANES)
    scale = load(lane, scale_at * LANES)
    touch2 = load(lane, touch2_at * LANES)
    me = load(lane, PLACE * LANES)
    ax, ay, az, hx, hy, n = splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0), splat(0.0)
    rx, ry, rz = splat(0.0), splat(0.0), splat(0.0)
    for c in range(n_places):
        p = places[c]
        dx = sx[p] - x
        dy = sy[p] - y
        dz = sz[p] - z
        square = dx * dx + dy * dy + dz * dz
        inside = (square < reach2) & (me != float(p)) & in_view(dx, dy, dz, square, lane)
        ax = choose(inside, ax + dx, ax)
        ay = choose(inside, ay + dy, ay)
        az = choose(inside, az + dz, az)
        hx = choose(inside, hx + heading_x[p], hx)
        hy = choose(inside, hy + heading_y[p], hy)
        n = choose(inside, n + 1.0, n)
        amount = choose(inside, push(square, sphere2, sphere, scale, touch2), 0.0)
        rx -= amount * dx
        ry -= amount * dy
        rz -= amount * dz
    return (ax, ay, az), (hx, hy), n, (rx, ry, rz)


@kernel("I I I I I I F F F F F F F F F I F F F F F2 F F F2w i8 i8 i8 i8")
def neighbor_sums_in_view(
    queries, block_first, span_first, span_start, span_end, order, qx, qy, qz, sx, sy, sz, heading_x, heading_y, team,
    own_team, comms_range, sphere, team_range, nonteam_range, quat, fov_azimuth, fov_elevation, sums, first, begin, stop, most,
):  # fmt: skip
    """As neighbor_sums, over those alone that are inside the fields of view [rad], (n,), of rows with attitude quat (4, n)."""
    mates = np.empty(most + LANES, np.int64)
    others = np.empty(most + LANES, np.int64)
    lane = np.empty(N_SCRATCH * LANES)
    blocks = (queries, block_first, span_first, span_start, span_end, order)
    own = (own_team, comms_range, sphere, team_range, nonteam_range)
    for b in range(begin, stop):
        q0 = block_first[b]
        width = block_first[b + 1] - q0
        done = 0
        x, y, z = load(qx, q0), load(qy, q0), load(qz, q0)
        for k in range(width):
            if (done >> k) & 1:
                continue
            taken, n_mates, n_others = find_near(
                b, k, blocks, (qx, qy, qz), (sx, sy, sz, team), own, first, lane, mates, others
            )
            done |= taken
            take_views(q0, width, queries, order, first, quat, fov_azimuth, fov_elevation, lane)
            offset, heading, n, team_push = sum_in_view(
                mates, n_mates, sx, sy, sz, heading_x, heading_y, x, y, z, lane, TEAM_SCALE, TEAM_TOUCH2
            )
            _, _, more, other_push = sum_in_view(
                others, n_others, sx, sy, sz, heading_x, heading_y, x, y, z, lane, OTHER_SCALE, OTHER_TOUCH2
            )
            put(
                lane,
                taken,
                q0,
                queries,
                order,
                first,
                sums,
                offset,
                heading,
                n,
                n + more,
                team_push,
                other_push,
            )


@kernel("F F F F2w")
def historic_means(x, y, z, sums):
    """Turn offsets and headings into what the existing system takes for centroid and heading, in place.

    It divides by the number of all neighbours, others included, so the centroid is drawn to the world's origin and the heading
    to East; and it averages yaw as a plain number (sum `HEADING` is then that of yaw [rad]). x, y, z (n,) own positions [m].
    """
    for i in range(x.shape[0]):
        count = max(sums[N_ALL, i], 1.0)
        share = sums[N_TEAM, i] / count - 1.0
        sums[OFFSET, i] = sums[OFFSET, i] / count + share * x[i]
        sums[OFFSET + 1, i] = sums[OFFSET + 1, i] / count + share * y[i]
        sums[OFFSET + 2, i] = sums[OFFSET + 2, i] / count + share * z[i]
        mean = sums[HEADING, i] / count
        sums[HEADING, i] = cos(mean)
        sums[HEADING + 1, i] = sin(mean)


@device
def shortened(x, y, z):
    """Unit vector of (x, y, z), or zero of zero."""
    inverse = inverse_sqrt(x * x + y * y + z * z)
    return x * inverse, y * inverse, z * inverse


@device
def length(x, y, z):
    """Length of (x, y, z)."""
    square = x * x + y * y + z * z
    return square * inverse_sqrt(square)


@kernel("F F F F2 F2 F F F F F F F2w")
def law(
    x,
    y,
    z,
    goal,
    sums,
    max_speed,
    goal_weight,
    team_weight,
    nonteam_weight,
    centroid_weight,
    align_weight,
    wanted,
):
    """Velocity wanted [m/s], (3, n), from the sums and the goal (3, n) [m].

    The weighted sum of the five unit or repulsion vectors over the sum of their lengths, times max_speed. The heading's length
    enters that sum without its weight, as in the existing system. Without neighbours it is the goal's direction at 1 m/s.
    """
    for i in range(0, x.shape[0], LANES):
        m = min(LANES, x.shape[0] - i)
        gx, gy, gz = shortened(
            load_some(goal[0], i, m) - load_some(x, i, m),
            load_some(goal[1], i, m) - load_some(y, i, m),
            load_some(goal[2], i, m) - load_some(z, i, m),
        )
        cx, cy, cz = shortened(
            load_some(sums[OFFSET], i, m),
            load_some(sums[OFFSET + 1], i, m),
            load_some(sums[OFFSET + 2], i, m),
        )
        hx, hy, hz = shortened(load_some(sums[HEADING], i, m), load_some(sums[HEADING + 1], i, m), splat(0.0))
        tx, ty, tz = (
            load_some(sums[TEAM_PUSH], i, m), load_some(sums[TEAM_PUSH + 1], i, m), load_some(sums[TEAM_PUSH + 2], i, m)
        )  # fmt: skip
        ox, oy, oz = (
            load_some(sums[OTHER_PUSH], i, m), load_some(sums[OTHER_PUSH + 1], i, m), load_some(sums[OTHER_PUSH + 2], i, m)
        )  # fmt: skip
        wg, wt, wo = (
            load_some(goal_weight, i, m),
            load_some(team_weight, i, m),
            load_some(nonteam_weight, i, m),
        )
        wc, wa = load_some(centroid_weight, i, m), load_some(align_weight, i, m)
        total = (
            magnitude(wg) * length(gx, gy, gz) + magnitude(wt) * length(tx, ty, tz) + magnitude(wo) * length(ox, oy, oz)
            + magnitude(wc) * length(cx, cy, cz) + length(hx, hy, hz)
        )  # fmt: skip
        gain = load_some(max_speed, i, m) / choose(total > 0.0, total, 1.0)
        alone = load_some(sums[N_ALL], i, m) == 0.0
        store_some(
            wanted[0], i, m, choose(alone, gx, gain * (wg * gx + wt * tx + wo * ox + wc * cx + wa * hx))
        )
        store_some(
            wanted[1], i, m, choose(alone, gy, gain * (wg * gy + wt * ty + wo * oy + wc * cy + wa * hy))
        )
        store_some(
            wanted[2], i, m, choose(alone, gz, gain * (wg * gz + wt * tz + wo * oz + wc * cz + wa * hz))
        )


@device
def magnitude(value):
    """Absolute value per lane."""
    return choose(value < 0.0, 0.0 - value, value)


@kernel("F2 F F2w")
def velocity(wanted, max_speed, out):
    """Velocity command [m/s], (3, n): what is wanted, at most half of max_speed (n,) once that is above 1 m/s."""
    for i in range(0, max_speed.shape[0], LANES):
        m = min(LANES, max_speed.shape[0] - i)
        vx, vy, vz = load_some(wanted[0], i, m), load_some(wanted[1], i, m), load_some(wanted[2], i, m)
        speed = length(vx, vy, vz)
        factor = 0.5 * load_some(max_speed, i, m) / choose(speed > 1.0, speed, 1.0)
        factor = choose(factor < 1.0, factor, 1.0)
        store_some(out[0], i, m, vx * factor)
        store_some(out[1], i, m, vy * factor)
        store_some(out[2], i, m, vz * factor)


@kernel("F2 F F F Fw Fw Fw")
def rates(wanted, yaw, climb, max_speed, speed, turn_rate, pitch_rate):
    """Speed [m/s] and the rates [rad/s] that turn the body x axis (yaw, climb [rad], nose up positive) to the wanted velocity."""
    vx, vy, vz = wanted[0], wanted[1], wanted[2]
    for i in range(speed.shape[0]):
        turn_rate[i] = wrap(atan2(vy[i], vx[i]) - yaw[i])
    for i in range(speed.shape[0]):
        pitch_rate[i] = wrap(atan2(vz[i], np.sqrt(vx[i] * vx[i] + vy[i] * vy[i])) - climb[i])
    for i in range(speed.shape[0]):
        speed[i] = max_speed[i]


@kernel("F2 F F Fw Fw Fw")
def desired(wanted, z, max_speed, heading, speed, altitude):
    """Heading of the wanted velocity [rad], max_speed [m/s], and the altitude [m] one second ahead at the wanted climb."""
    for i in range(z.shape[0]):
        heading[i] = atan2(wanted[1, i], wanted[0, i])
    for i in range(z.shape[0]):
        speed[i] = max_speed[i]
        altitude[i] = z[i] + wanted[2, i]
