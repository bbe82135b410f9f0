"""SingleIntegrator kernels. Rows are processed in blocks of scratch, because LLVM vectorises only loops over few arrays."""

import math

import numpy as np

from tussle.numeric import atan2, sincos
from tussle.numeric.kernel import kernel

BLOCK = 128  # rows


@kernel("F2w F2 F2 f8 i8")
def advance(x, u, p, dt, substeps):
    """Advance all rows, in place. The result is exact for a constant velocity and does not depend on the number of substeps.

    Args:
        x: x, y, z [m], vx, vy, vz [m/s], yaw, climb [rad], (8, n), world frame.
        u: velocity_x, velocity_y, velocity_z [m/s] and, where the heading is commanded, desired_heading [rad], (3 or
            4, n).
        p: max_speed [m/s], longer commands are shortened to it; negative for no limit, (1, n).
        dt: Duration [s].
        substeps: Number of steps in dt; unused.
    """
    east, north, up, vx, vy, vz, yaw, climb = x[0], x[1], x[2], x[3], x[4], x[5], x[6], x[7]
    ux, uy, uz, max_speed = u[0], u[1], u[2], p[0]
    is_headed = u.shape[0] > 3
    heading = u[u.shape[0] - 1]
    rise = np.empty(2 * BLOCK)
    run = np.empty(2 * BLOCK)
    angle = np.empty(2 * BLOCK)
    scale = np.empty(BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            i = first + l
            speed = math.sqrt(ux[i] * ux[i] + uy[i] * uy[i] + uz[i] * uz[i])
            is_free = (max_speed[i] < 0.0) | (speed <= max_speed[i])
            scale[l] = 1.0 if is_free else max_speed[i] / speed
        for l in range(m):
            i = first + l
            vx[i] = ux[i] * scale[l]
            east[i] += vx[i] * dt
        for l in range(m):
            i = first + l
            vy[i] = uy[i] * scale[l]
            north[i] += vy[i] * dt
        for l in range(m):
            i = first + l
            vz[i] = uz[i] * scale[l]
            up[i] += vz[i] * dt
        for l in range(m):
            i = first + l
            rise[l] = vy[i]
            run[l] = vx[i]
            rise[m + l] = vz[i]
            run[m + l] = math.sqrt(vx[i] * vx[i] + vy[i] * vy[i])
        for j in range(2 * m):
            angle[j] = atan2(rise[j], run[j])
        for l in range(m):
            i = first + l
            level = run[m + l]
            yaw[i] = yaw[i] if level == 0.0 else angle[l]
            climb[i] = climb[i] if (level == 0.0) & (rise[m + l] == 0.0) else angle[m + l]
        if is_headed:
            for l in range(m):
                yaw[first + l] = heading[first + l]


@kernel("F2 F2w i8")
def to_body(x, table, first_row):
    """Write position, attitude (no bank) and velocity to the body table.

    Args:
        x: State as in `advance`, (8, n).
        table: Body table: position [m], velocity [m/s], quaternion body to world, world frame, (>= 10, N); written.
        first_row: First row of the group in the table.
    """
    body = table[:, first_row : first_row + x.shape[1]]
    for k in range(6):
        for i in range(x.shape[1]):
            body[k, i] = x[k, i]
    yaw, climb = x[6], x[7]
    angle = np.empty(2 * BLOCK)
    sine = np.empty(2 * BLOCK)
    cosine = np.empty(2 * BLOCK)
    n = x.shape[1]
    for first in range(0, n, BLOCK):
        m = min(BLOCK, n - first)
        for l in range(m):
            angle[l] = 0.5 * yaw[first + l]
            angle[m + l] = -0.5 * climb[first + l]
        for j in range(2 * m):
            sine[j], cosine[j] = sincos(angle[j])
        for l in range(m):
            i = first + l
            body[6, i] = cosine[m + l] * cosine[l]
            body[7, i] = -(sine[m + l] * sine[l])
            body[8, i] = sine[m + l] * cosine[l]
            body[9, i] = cosine[m + l] * sine[l]
