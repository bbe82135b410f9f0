"""Whether spheres touch triangles, bodies or a height field."""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel
from tussle.numeric.triangle import closest_weights
from tussle.world.rays.kernels import STACK, height_plane


@device
def square_distance(items, k, x, y, z):
    """Square of the distance from a point to a triangle [m^2]."""
    ax, ay, az = items[k, 0], items[k, 1], items[k, 2]
    bx, by, bz = items[k, 3] - ax, items[k, 4] - ay, items[k, 5] - az
    cx, cy, cz = items[k, 6] - ax, items[k, 7] - ay, items[k, 8] - az
    px, py, pz = x - ax, y - ay, z - az
    s, t = closest_weights((bx, by, bz), (cx, cy, cz), (px, py, pz))
    qx, qy, qz = px - s * bx - t * cx, py - s * by - t * cy, pz - s * bz - t * cz
    return qx * qx + qy * qy + qz * qz


@kernel("(F2 I2 I) F2 F2 F Bw")
def touch(tree, items, points, radius, touches):
    """Set where *a sphere around a point touches a triangle of the only tree.

    tree: bounds, links, roots; items (n, TRIANGLE). points [m], (3, m); radius [m], (m,). Written: touches (m,), where it was false.
    """
    bounds, links, roots = tree
    stack = np.empty(STACK, np.int64)
    for i in range(touches.shape[0]):
        if touches[i] or roots[0] < 0:
            continue
        square = radius[i] * radius[i]
        stack[0] = roots[0]
        depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            away = 0.0
            for a in range(3):
                p = points[a, i]
                out = max(bounds[node, a] - p, p - bounds[node, 3 + a], 0.0)
                away += out * out
            if not away <= square:
                continue
            if links[node, 1] < 0:
                stack[depth], stack[depth + 1] = links[node, 0], links[node, 0] + 1
                depth += 2
                continue
            for k in range(links[node, 0], links[node, 0] + links[node, 1]):
                if square_distance(items, k, points[0, i], points[1, i], points[2, i]) <= square:
                    touches[i] = True
                    depth = 0


@device
def square_distance_of_body(items, k, x, y, z):
    """Squared distance of a point to a body, 0 inside [m^2]."""
    x, y, z = x - items[k, 0], y - items[k, 1], z - items[k, 2]
    if items[k, 3] > 0.0:
        away = max(math.sqrt(x * x + y * y + z * z) - items[k, 3], 0.0)
        return away * away
    square = 0.0
    for i in range(3):
        r = 7 + 3 * i
        along = x * items[k, r] + y * items[k, r + 1] + z * items[k, r + 2]
        away = max(abs(along) - items[k, 4 + i], 0.0)
        square += away * away
    return square


@kernel("(F2 I2 I I) F2 (F2 F I I) Bw")
def touch_bodies(tree, items, around, touches):
    """Set where *a sphere around a point touches a body of its world.

    tree: bounds, links, roots, rows by place; items by place (n, BODY). around: points [m], (3, m); radius [m], world, and row of the
    body that does not count, -1 for none, (m,). Written: touches (m,), where it was false.
    """
    bounds, links, roots, row = tree
    points, radius, world, own = around
    stack = np.empty(STACK, np.int64)
    for i in range(touches.shape[0]):
        depth = 0
        if not touches[i] and roots[world[i]] >= 0:
            stack[0], depth = roots[world[i]], 1
        square = radius[i] * radius[i]
        while depth > 0:
            depth -= 1
            node = stack[depth]
            away = 0.0
            for a in range(3):
                p = points[a, i]
                out = max(bounds[node, a] - p, p - bounds[node, 3 + a], 0.0)
                away += out * out
            if not away <= square:
                continue
            if links[node, 1] < 0:
                stack[depth], stack[depth + 1] = links[node, 0], links[node, 0] + 1
                depth += 2
                continue
            for k in range(links[node, 0], links[node, 0] + links[node, 1]):
                near = square_distance_of_body(items, k, points[0, i], points[1, i], points[2, i]) <= square
                if near and row[k] != own[i]:
                    touches[i] = True
                    depth = 0


@kernel("F2 F F2 F Bw")
def touch_field(height, grid, points, radius, touches):
    """Set where *a sphere around a point touches a height field, or lies below it.

    height, grid: as for `cast_field`. points [m], (3, m); radius [m], (m,). Written: touches (m,), where it was false.
    """
    ny, nx = height.shape
    west, south, wide, deep, highest = grid[0], grid[1], grid[2], grid[3], grid[5]
    corners = np.empty((1, 9))
    for n in range(touches.shape[0]):
        x, y, z, r = points[0, n], points[1, n], points[2, n], radius[n]
        u, v, reach_u, reach_v = (x - west) / wide, (y - south) / deep, r / wide, r / deep
        is_near = (
            u + reach_u >= 0.0 and u - reach_u <= nx - 1.0 and v + reach_v >= 0.0 and v - reach_v <= ny - 1.0
        )
        if touches[n] or not (is_near and z - r <= highest):
            continue
        i0, i1 = math.floor(max(u - reach_u, 0.0)), math.floor(min(u + reach_u, nx - 2.0))
        j0, j1 = math.floor(max(v - reach_v, 0.0)), math.floor(min(v + reach_v, ny - 2.0))
        for j in range(j0, j1 + 1):
            for i in range(i0, i1 + 1):
                for k in range(2):
                    h, slope_u, slope_v = height_plane(height, i, j, k == 1)
                    a, b = u - i, v - j
                    is_over = 0.0 <= a <= 1.0 and 0.0 <= b <= 1.0 and (b >= a if k == 1 else b <= a)
                    if is_over and z <= h + slope_u * a + slope_v * b:
                        touches[n] = True
                    for c in range(3):
                        # Corner (0, 0), corner (1, 1), and (1, 0) below or (0, 1) above the diagonal.
                        e = 1 if c == 1 or (c == 2 and k == 0) else 0
                        f = 1 if c == 1 or (c == 2 and k == 1) else 0
                        corners[0, 3 * c] = west + (i + e) * wide
                        corners[0, 3 * c + 1] = south + (j + f) * deep
                        corners[0, 3 * c + 2] = height[j + f, i + e]
                    if square_distance(corners, 0, x, y, z) <= r * r:
                        touches[n] = True
                if touches[n]:
                    break
            if touches[n]:
                break
