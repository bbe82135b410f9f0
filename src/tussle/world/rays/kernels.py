"""Trees of boxes over triangles and bodies, and rays through them, eight rays at a time.

A packet of up to eight consecutive rays of one world goes down the tree together. A hit counts only within the interval in which the
ray itself is inside the leaf's box, and the first hit is the smallest pair (distance, code). Therefore the result of a ray does not
depend on the rays beside it, on the order of the visits or on the shape of the rest of the tree.
"""

import math

import numpy as np

from tussle.numeric.kernel import device, kernel
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.lanes import below, bits, choose, lanes_sqrt, load_some, splat, store_some

LEAF = 4
"""Largest number of items of a leaf."""
N_BINS = 16
"""Candidates for a split of a node."""
DEEP = 40
"""Depth from which on nodes are halved: the tree is then at most 40 + log2(items) deep."""
STACK = 128
HUGE = 1e250
"""Inverse of a component 0 of a direction: 0 * HUGE is 0, where 0 * inf would be NaN."""
SLACK = 1e-12
"""Relative widening of boxes and of intervals in them: thousands of rounding errors, far less than any size in a scene."""
TRIANGLE, BODY = 12, 16
"""Numbers of an item: corners and unit normal of a triangle; centre, radius, half lengths and axes of a body."""


@device
def area(low_x, low_y, low_z, high_x, high_y, high_z):
    """Half the surface of a box."""
    x, y, z = high_x - low_x, high_y - low_y, high_z - low_z
    return x * y + y * z + z * x


@device
def split_place(boxes, order, start, end, bins, cuts):
    """Divide order[start:end] in two by the surface area heuristic; returns the first place of the second part and the axis.

    J. D. MacDonald and K. S. Booth, Heuristics for ray tracing using space subdivision, The Visual Computer 6 (1990), in 16 bins
    along the longest side of the box of the centres. bins (N_BINS, 7): box and number of items; cuts (N_BINS,): scratch.
    """
    axis, low, width = 0, 0.0, 0.0
    for a in range(3):
        least, most = np.inf, -np.inf
        for k in range(start, end):
            middle = boxes[order[k], a] + boxes[order[k], 3 + a]
            least, most = min(least, middle), max(most, middle)
        if most - least > width:
            axis, low, width = a, least, most - least
    half = (start + end) >> 1
    if not 0.0 < width < np.inf:
        return half, axis
    scale = N_BINS * (1.0 - SLACK) / width
    for b in range(N_BINS):
        bins[b, 0:3] = np.inf
        bins[b, 3:6] = -np.inf
        bins[b, 6] = 0.0
    for k in range(start, end):
        item = order[k]
        b = int((boxes[item, axis] + boxes[item, 3 + axis] - low) * scale)
        b = min(max(b, 0), N_BINS - 1)
        for a in range(3):
            bins[b, a] = min(bins[b, a], boxes[item, a])
            bins[b, 3 + a] = max(bins[b, 3 + a], boxes[item, 3 + a])
        bins[b, 6] += 1.0
    grown = np.empty(6)
    grown[0:3], grown[3:6] = np.inf, -np.inf
    count = 0.0
    for b in range(N_BINS - 1, 0, -1):
        for a in range(3):
            grown[a], grown[3 + a] = min(grown[a], bins[b, a]), max(grown[3 + a], bins[b, 3 + a])
        count += bins[b, 6]
        cuts[b] = (
            count * area(grown[0], grown[1], grown[2], grown[3], grown[4], grown[5])
            if count > 0.0
            else np.inf
        )
    grown[0:3], grown[3:6] = np.inf, -np.inf
    count, best, cut = 0.0, np.inf, 0
    for b in range(N_BINS - 1):
        for a in range(3):
            grown[a], grown[3 + a] = min(grown[a], bins[b, a]), max(grown[3 + a], bins[b, 3 + a])
        count += bins[b, 6]
        cost = cuts[b + 1] + count * area(grown[0], grown[1], grown[2], grown[3], grown[4], grown[5])
        if count > 0.0 and cost < best:
            best, cut = cost, b + 1
    if cut == 0:
        return half, axis
    i, j = start, end - 1
    while i <= j:
        item = order[i]
        if min(max(int((boxes[item, axis] + boxes[item, 3 + axis] - low) * scale), 0), N_BINS - 1) < cut:
            i += 1
        else:
            order[i], order[j] = order[j], item
            j -= 1
    return i if start < i < end else half, axis


@kernel("F2 I Iw (F2w I2w Iw) -> i8")
def build_tree(boxes, world_start, order, tree):
    """Build one tree for each world; returns the number of nodes.

    boxes: lower and upper corner of each item, (n, 6). world_start (n_worlds + 1,): the items of world w are order[world_start[w]] to
    order[world_start[w + 1] - 1]; they are rearranged within it. Written: bounds (2 n, 6); links (2 n, 2): first of two adjacent
    children and -1 - axis, or the first place and the number of the items of a leaf; roots (n_worlds,), -1 for a world without items.
    """
    bounds, links, roots = tree
    bins, cuts = np.empty((N_BINS, 7)), np.empty(N_BINS)
    stack = np.empty((STACK, 4), np.int64)
    n_nodes = 0
    for w in range(roots.shape[0]):
        if world_start[w + 1] == world_start[w]:
            roots[w] = -1
            continue
        roots[w] = n_nodes
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = n_nodes, world_start[w], world_start[w + 1], 0
        n_nodes += 1
        depth = 1
        while depth > 0:
            depth -= 1
            node, start, end, level = stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3]
            for a in range(3):
                low, high = np.inf, -np.inf
                for k in range(start, end):
                    low, high = min(low, boxes[order[k], a]), max(high, boxes[order[k], 3 + a])
                margin = SLACK * max(abs(low), abs(high)) + 1e-300
                bounds[node, a], bounds[node, 3 + a] = low - margin, high + margin
            if end - start <= LEAF:
                links[node, 0], links[node, 1] = start, end - start
                continue
            middle, axis = (start + end) >> 1, 0
            if level < DEEP:
                middle, axis = split_place(boxes, order, start, end, bins, cuts)
            links[node, 0], links[node, 1] = n_nodes, -1 - axis
            stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = (
                n_nodes,
                start,
                middle,
                level + 1,
            )
            depth += 1
            stack[depth, 0], stack[depth, 1], stack[depth, 2], stack[depth, 3] = (
                n_nodes + 1,
                middle,
                end,
                level + 1,
            )
            depth += 1
            n_nodes += 2
    return n_nodes


@device
def lesser(a, b):
    """The smaller of two numbers per lane."""
    return choose(a < b, a, b)


@device
def greater(a, b):
    """The larger of two numbers per lane."""
    return choose(a < b, b, a)


@device
def interval(low_x, low_y, low_z, high_x, high_y, high_z, ray):
    """Distances [m] at which rays enter and leave a box along the axes; a ray misses it where the second is smaller."""
    x, y, z, inverse_x, inverse_y, inverse_z = ray
    a, b = (low_x - x) * inverse_x, (high_x - x) * inverse_x
    near, far = lesser(a, b), greater(a, b)
    a, b = (low_y - y) * inverse_y, (high_y - y) * inverse_y
    near, far = greater(near, lesser(a, b)), lesser(far, greater(a, b))
    a, b = (low_z - z) * inverse_z, (high_z - z) * inverse_z
    return greater(near, lesser(a, b)), lesser(far, greater(a, b))


@device
def inverse(direction):
    """1 / direction per lane, or HUGE."""
    return choose(direction == 0.0, splat(HUGE), 1.0 / choose(direction == 0.0, splat(1.0), direction))


@device
def through_triangle(items, k, ray, way):
    """Distance [m] to a triangle's plane, NaN where it is parallel, and whether the ray passes through the triangle, from either side.

    The sides of the ray on which the edges lie decide: for the common edge of two triangles, the two numbers are exactly opposite, so that
    no ray slips through between them. S. Woop, C. Benthin and I. Wald, Watertight ray/triangle intersection, JCGT 2 (2013), section 2.
    """
    x, y, z, _, _, _ = ray
    dx, dy, dz = way
    ax, ay, az = items[k, 0] - x, items[k, 1] - y, items[k, 2] - z
    bx, by, bz = items[k, 3] - x, items[k, 4] - y, items[k, 5] - z
    cx, cy, cz = items[k, 6] - x, items[k, 7] - y, items[k, 8] - z
    u = dx * (by * cz - bz * cy) + dy * (bz * cx - bx * cz) + dz * (bx * cy - by * cx)
    v = dx * (cy * az - cz * ay) + dy * (cz * ax - cx * az) + dz * (cx * ay - cy * ax)
    w = dx * (ay * bz - az * by) + dy * (az * bx - ax * bz) + dz * (ax * by - ay * bx)
    inside = ((u >= 0.0) & (v >= 0.0) & (w >= 0.0)) | ((u <= 0.0) & (v <= 0.0) & (w <= 0.0))
    nx, ny, nz = items[k, 9], items[k, 10], items[k, 11]
    return (nx * ax + ny * ay + nz * az) / (nx * dx + ny * dy + nz * dz), inside


@device
def through_sphere(items, k, ray, way):
    """Distance [m] to a sphere from outside or inside, and whether the ray meets it."""
    x, y, z, _, _, _ = ray
    dx, dy, dz = way
    cx, cy, cz, radius = items[k, 0] - x, items[k, 1] - y, items[k, 2] - z, items[k, 3]
    along = cx * dx + cy * dy + cz * dz
    # Of the closest point; the discriminant of the quadratic formula would cancel for a far, small sphere.
    px, py, pz = cx - along * dx, cy - along * dy, cz - along * dz
    square = radius * radius - (px * px + py * py + pz * pz)
    half = lanes_sqrt(choose(square > 0.0, square, splat(0.0)))
    return choose(along - half >= 0.0, along - half, along + half), square >= 0.0


@device
def through_box(items, k, ray, way):
    """Distance [m] to a rotated box from outside or inside, and whether the ray meets it."""
    x, y, z, _, _, _ = ray
    dx, dy, dz = way
    x, y, z = x - items[k, 0], y - items[k, 1], z - items[k, 2]
    r = 7
    ox = x * items[k, r] + y * items[k, r + 1] + z * items[k, r + 2]
    oy = x * items[k, r + 3] + y * items[k, r + 4] + z * items[k, r + 5]
    oz = x * items[k, r + 6] + y * items[k, r + 7] + z * items[k, r + 8]
    ix = inverse(dx * items[k, r] + dy * items[k, r + 1] + dz * items[k, r + 2])
    iy = inverse(dx * items[k, r + 3] + dy * items[k, r + 4] + dz * items[k, r + 5])
    iz = inverse(dx * items[k, r + 6] + dy * items[k, r + 7] + dz * items[k, r + 8])
    a, b, c = items[k, 4], items[k, 5], items[k, 6]
    near, far = interval(-a, -b, -c, a, b, c, (ox, oy, oz, ix, iy, iz))
    return choose(near >= 0.0, near, far), near <= far


@kernel("(F2 I2 I I) F2 (F2 F2 I F) (Fw Fw f8) (i8 i8)")
def cast(tree, items, rays, found, part):
    """Find the first item that each ray meets, if it is nearer than what has been found.

    tree: bounds, links, roots, and item code of each place. items: numbers of each place, (n, TRIANGLE) or (n, BODY). rays: origins [m] and
    unit directions, (3, m), world (m,), and code of the item that a ray does not meet, (m,). Read and written: distance [m] and code of
    the hit, (m,); codes are counted from `base`, and of two hits at the same distance the lower code counts. part: first and last ray.
    """
    bounds, links, roots, codes = tree
    origin, direction, world, own = rays
    distance, hit, base = found
    first, last = part
    stack = np.empty(STACK, np.int64)
    is_mesh = items.shape[1] == TRIANGLE
    i = first
    while i < last:
        count = 1
        while count < LANES and i + count < last and world[i + count] == world[i]:
            count += 1
        node = roots[world[i] if roots.shape[0] > 1 else 0]
        x, y, z = (
            load_some(origin[0], i, count),
            load_some(origin[1], i, count),
            load_some(origin[2], i, count),
        )
        dx, dy, dz = (
            load_some(direction[0], i, count),
            load_some(direction[1], i, count),
            load_some(direction[2], i, count),
        )
        mine = load_some(own, i, count) + base
        ray, way = (x, y, z, inverse(dx), inverse(dy), inverse(dz)), (dx, dy, dz)
        best = choose(below(count), load_some(distance, i, count), splat(-1.0))
        best_code = load_some(hit, i, count)
        depth = 0
        if node >= 0:
            stack[0] = node
            depth = 1
        while depth > 0:
            depth -= 1
            node = stack[depth]
            near, far = interval(
                bounds[node, 0],
                bounds[node, 1],
                bounds[node, 2],
                bounds[node, 3],
                bounds[node, 4],
                bounds[node, 5],
                ray,
            )
            near, far = greater(near * (1.0 - SLACK), splat(0.0)), far * (1.0 + SLACK)
            inside = (near <= far) & (near <= best)
            if bits(inside) == 0:
                continue
            if links[node, 1] < 0:
                axis = -1 - links[node, 1]
                backward = 1 if direction[axis, i] < 0.0 else 0
                stack[depth] = links[node, 0] + 1 - backward
                stack[depth + 1] = links[node, 0] + backward
                depth += 2
                continue
            for k in range(links[node, 0], links[node, 0] + links[node, 1]):
                code = base + codes[k]
                if is_mesh:
                    t, meets = through_triangle(items, k, ray, way)
                elif items[k, 3] > 0.0:
                    t, meets = through_sphere(items, k, ray, way)
                else:
                    t, meets = through_box(items, k, ray, way)
                meets = meets & inside & (t >= near) & (t <= far) & (mine != code)
                meets = meets & ((t < best) | ((t == best) & (best_code > code)))
                best, best_code = choose(meets, t, best), choose(meets, splat(code), best_code)
        store_some(distance, i, count, best)
        store_some(hit, i, count, best_code)
        i += count


@kernel("(F2 F2 F) (I F2) (F2w F2w)")
def place_bodies(bodies, boxed, out):
    """Set the items and their boxes of all bodies.

    bodies: positions [m] (3, n), attitudes (4, n), radii [m] (n,). boxed: block of each body (n,), and lengths of the boxes of each
    block [m], (n_blocks, 3), 0 for spheres. Written: items (n, BODY) and boxes (n, 6).
    """
    pos, quat, radius = bodies
    block, lengths = boxed
    items, boxes = out
    for row in range(block.shape[0]):
        b = min(max(block[row], 0), lengths.shape[0] - 1)
        is_box = lengths[b, 0] > 0.0
        items[row, 3] = 0.0 if is_box else radius[row]
        w, x, y, z = quat[0, row], quat[1, row], quat[2, row], quat[3, row]
        items[row, 7], items[row, 8], items[row, 9] = (
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y + w * z),
            2.0 * (x * z - w * y),
        )
        items[row, 10], items[row, 11], items[row, 12] = (
            2.0 * (x * y - w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z + w * x),
        )
        items[row, 13], items[row, 14], items[row, 15] = (
            2.0 * (x * z + w * y),
            2.0 * (y * z - w * x),
            1.0 - 2.0 * (x * x + y * y),
        )
        for a in range(3):
            items[row, a] = pos[a, row]
            items[row, 4 + a] = 0.5 * lengths[b, a]
        for a in range(3):
            half = radius[row]
            if is_box:
                half = 0.0
                for c in range(3):
                    half += abs(items[row, 7 + 3 * c + a]) * items[row, 4 + c]
            boxes[row, a], boxes[row, 3 + a] = pos[a, row] - half, pos[a, row] + half


@device
def clipped(start, end, place, rate, low, high):
    """The part [start, end] of a line on which low <= place + t * rate <= high."""
    if rate == 0.0:
        return start, end if low <= place <= high else -1.0
    a, b = (low - place) / rate, (high - place) / rate
    return max(start, min(a, b)), min(end, max(a, b))


@device
def height_plane(height, i, j, is_above):
    """Height at corner (i, j) [m], and its change along columns and rows, in the triangle above or below the diagonal."""
    h, far = height[j, i], height[j + 1, i + 1]
    if is_above:
        return h, far - height[j + 1, i], height[j + 1, i] - h
    return h, height[j, i + 1] - h, far - height[j, i + 1]


@kernel("F2 F (F2 F2) (Fw Fw f8) (i8 i8)")
def cast_field(height, grid, rays, found, part):
    """Find where each ray first meets a height field, from above or below, if that is nearer than what has been found.

    The ray walks over the cells of the grid (J. Amanatides and A. Woo, A fast voxel traversal algorithm, Eurographics 1987), each of which
    has two triangles. It meets the surface where its height above it changes sign from one end of a triangle to the next.
    height [m], (ny, nx). grid: west, south, width and depth of a cell, least and greatest height [m]. rays, part: as for `cast`.
    Read and written: distance [m], code, which becomes `code` of the field.
    """
    origin, direction = rays
    distance, hit, code = found
    first, last = part
    ny, nx = height.shape
    west, south, wide, deep, lowest, highest = grid[0], grid[1], grid[2], grid[3], grid[4], grid[5]
    for n in range(first, last):
        # In cells: u from west to east, v from south to north.
        u, v, z = (origin[0, n] - west) / wide, (origin[1, n] - south) / deep, origin[2, n]
        du, dv, dz = direction[0, n] / wide, direction[1, n] / deep, direction[2, n]
        start, end = clipped(0.0, distance[n], u, du, 0.0, nx - 1.0)
        start, end = clipped(start, end, v, dv, 0.0, ny - 1.0)
        margin = SLACK * (abs(lowest) + abs(highest)) + 1e-9
        start, end = clipped(start, end, z, dz, lowest - margin, highest + margin)
        if not start <= end or not (du != 0.0 or dv != 0.0 or dz != 0.0):
            continue
        i = min(max(math.floor(u + start * du), 0), nx - 2)
        j = min(max(math.floor(v + start * dv), 0), ny - 2)
        above_start = np.nan
        while True:
            leave_u = ((i + (1.0 if du > 0.0 else 0.0)) - u) / du if du != 0.0 else np.inf
            leave_v = ((j + (1.0 if dv > 0.0 else 0.0)) - v) / dv if dv != 0.0 else np.inf
            stop = min(max(min(leave_u, leave_v), start), end)
            least = min(height[j, i], height[j, i + 1], height[j + 1, i], height[j + 1, i + 1])
            most = max(height[j, i], height[j, i + 1], height[j + 1, i], height[j + 1, i + 1])
            z_start, z_stop = z + start * dz, z + stop * dz
            is_over, is_under = min(z_start, z_stop) > most, max(z_start, z_stop) < least
            # The diagonal is where u - i = v - j; of the two triangles, the first is the one in which the interval begins.
            across = du - dv
            offset = (u - i) - (v - j)
            middle = -offset / across if across != 0.0 else -1.0
            parts = 2 if start < middle < stop else 1
            if is_over or is_under:  # of the whole cell
                parts, start, above_start = 0, stop, 1.0 if is_over else -1.0
            for k in range(parts):
                to = middle if parts == 2 and k == 0 else stop
                half = 0.5 * (start + to) if to < np.inf else start
                h, slope_u, slope_v = height_plane(height, i, j, offset + half * across < 0.0)
                above = z - (h + slope_u * (u - i) + slope_v * (v - j))
                rate = dz - (slope_u * du + slope_v * dv)
                begin = above + start * rate if math.isnan(above_start) else above_start
                above_start = above + to * rate
                if begin == 0.0 or (begin > 0.0) != (above_start > 0.0):
                    t = -above / rate if rate != 0.0 else start
                    t = min(max(t, start), to)
                    if t < distance[n] or (t == distance[n] and code < hit[n]):
                        distance[n], hit[n] = t, code
                    start = np.inf
                    break
                start = to
            if not stop < end or start == np.inf:
                break
            if leave_u <= leave_v:
                i += 1 if du > 0.0 else -1
            if leave_v <= leave_u:
                j += 1 if dv > 0.0 else -1
            if i < 0 or j < 0 or i > nx - 2 or j > ny - 2:
                break


@kernel("F2 F2 F2 F2w F2w (i8 i8)")
def aim(quat, origin, pattern, origins, directions, part):
    """Turn a pattern of rays by the attitude of each sensor.

    quat (4, n) and origin (3, n) [m] of the sensors, world frame; pattern (3, k): unit directions, sensor frame. Written: origins and
    directions of the rays, (3, n k), sensor after sensor. part: first and last sensor.
    """
    k = pattern.shape[1]
    first, last = part
    for i in range(first, last):
        w, x, y, z = quat[0, i], quat[1, i], quat[2, i], quat[3, i]
        xx, xy, xz = 1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        yx, yy, yz = 2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)
        zx, zy, zz = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)
        for j in range(k):
            a, b, c = pattern[0, j], pattern[1, j], pattern[2, j]
            directions[0, i * k + j] = xx * a + xy * b + xz * c
            directions[1, i * k + j] = yx * a + yy * b + yz * c
            directions[2, i * k + j] = zx * a + zy * b + zz * c
            origins[0, i * k + j], origins[1, i * k + j], origins[2, i * k + j] = (
                origin[0, i],
                origin[1, i],
                origin[2, i],
            )
