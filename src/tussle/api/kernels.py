"""Kernels behind the views: attitude, who is where, checks."""

from __future__ import annotations

import math

from tussle.numeric import atan2
from tussle.numeric.kernel import kernel


@kernel("F F F F Fw")
def yaw(qw, qx, qy, qz, out):
    """Heading of the body x axis, counter-clockwise from East [rad], (n,), of unit or other quaternions."""
    for i in range(out.shape[0]):
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        out[i] = atan2(2.0 * (w * z + x * y), w * w + x * x - y * y - z * z)


@kernel("F F F F Fw")
def climb(qw, qx, qy, qz, out):
    """Elevation of the body x axis, nose up positive [rad], (n,)."""
    for i in range(out.shape[0]):
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        east = w * w + x * x - y * y - z * z
        north = 2.0 * (w * z + x * y)
        out[i] = atan2(2.0 * (x * z - w * y), math.sqrt(east * east + north * north))


@kernel("F F F F Fw")
def roll(qw, qx, qy, qz, out):
    """Bank about the body x axis, right wing down positive [rad], (n,)."""
    for i in range(out.shape[0]):
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        out[i] = atan2(2.0 * (w * x + y * z), w * w - x * x - y * y + z * z)


@kernel("F F F F Fw Fw Fw")
def forward(qw, qx, qy, qz, east, north, up):
    """Unit vector along the body x axis, world frame, (n,) each."""
    for i in range(east.shape[0]):
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        scale = 1.0 / (w * w + x * x + y * y + z * z)
        east[i] = (w * w + x * x - y * y - z * z) * scale
        north[i] = 2.0 * (w * z + x * y) * scale
        up[i] = 2.0 * (x * z - w * y) * scale


@kernel("F F F F Fw Fw")
def level_forward(qw, qx, qy, qz, east, north):
    """Horizontal unit vector of the heading, (n,) each; zero for a nose that points straight up or down."""
    for i in range(east.shape[0]):
        w, x, y, z = qw[i], qx[i], qy[i], qz[i]
        dx = w * w + x * x - y * y - z * z
        dy = 2.0 * (w * z + x * y)
        length = math.sqrt(dx * dx + dy * dy)
        scale = 1.0 / length if length > 0.0 else 0.0
        east[i] = dx * scale
        north[i] = dy * scale


@kernel("I I Iw")
def count_ids(world, ids, id_start):
    """id_start[w] becomes the place of world w's id 0 in a table of all ids; the last item its length."""
    for i in range(world.shape[0]):
        w = world[i] + 1
        id_start[w] = max(id_start[w], ids[i] + 1)
    for w in range(1, id_start.shape[0]):
        id_start[w] += id_start[w - 1]


@kernel("I I I Iw Iw Iw")
def lay_out(world, ids, id_start, id_row, members, world_start):
    """Fill the row of each id (id_row comes in as -1) and the rows by (world, id)."""
    for i in range(world.shape[0]):
        id_row[id_start[world[i]] + ids[i]] = i
    n = 0
    for w in range(id_start.shape[0] - 1):
        world_start[w] = n
        for k in range(id_start[w], id_start[w + 1]):
            if id_row[k] >= 0:
                members[n] = id_row[k]
                n += 1
    world_start[id_start.shape[0] - 1] = n


@kernel("I I I I Iw")
def find_rows(world, ids, id_row, id_start, rows):
    """rows[i] is the row of (world[i], ids[i]); -1 for id 0 and for those that are gone."""
    for i in range(world.shape[0]):
        w = world[i]
        rows[i] = -1
        if ids[i] > 0 and ids[i] < id_start[w + 1] - id_start[w]:
            rows[i] = id_row[id_start[w] + ids[i]]


@kernel("F I Fw")
def longest_reach(radius, world, reach):
    """reach[w] = largest radius of its rows [m]; comes in as 0."""
    for i in range(radius.shape[0]):
        w = world[i]
        reach[w] = max(reach[w], radius[i])


@kernel("F F F F F F F F Bw -> i8")
def check(x, y, z, qw, qx, qy, qz, health, faulty):
    """Number of rows that are not sound; faulty marks rows whose position or attitude is not finite. Rows without health count too.

    A sum of the seven numbers minus itself is 0 only where all are finite, so one test a row does, and it vectorises.
    """
    count = 0
    for i in range(x.shape[0]):
        total = x[i] + y[i] + z[i] + qw[i] + qx[i] + qy[i] + qz[i]
        bad = not (total - total == 0.0)
        faulty[i] = bad
        count += 1 if bad or not (health[i] > 0.0) else 0
    return count


@kernel("F2 I F2w")
def gather_floats(source, index, out):
    """Columns index of source (k, n) into out (k, m); index -1 leaves out as it is."""
    for r in range(source.shape[0]):
        for j in range(index.shape[0]):
            if index[j] >= 0:
                out[r, j] = source[r, index[j]]


@kernel("I2 I I2w")
def gather_ints(source, index, out):
    """Columns index of source (k, n) into out (k, m); index -1 leaves out as it is."""
    for r in range(source.shape[0]):
        for j in range(index.shape[0]):
            if index[j] >= 0:
                out[r, j] = source[r, index[j]]
