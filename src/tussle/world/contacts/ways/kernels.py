"""Ways of bodies that do not lead into others."""

from tussle.numeric.kernel import kernel
from tussle.world.contacts.boxes.kernels import dot, vector

ROUNDING = 1e-6
"""Part of the allowed overlap below which a way is not changed again, since it has been changed by that much too little."""


@kernel("(I I F2 F) F i8 F2w Bw")
def shorten(contacts, share, passes, ways, is_blocked):
    """Change ways so that no body enters another one by more than is allowed, along the normals of contacts: what is left slides.

    Args:
        contacts: Row of the first body and of the second, -1 for the scene, (m,); numbers, (m, CONTACT), from the begin of the
            ways; overlap that is allowed [m], (m,).
        share: Part of each body in a change, 0 for one whose way is kept, (n,).
        passes: Passes over all contacts.
        ways: Ways [m], (n, 3), written.
        is_blocked: Set for bodies of contacts whose ways were not free, (n,).
    """
    row, other, numbers, allowed = contacts
    for _ in range(passes):
        for k in range(row.shape[0]):
            a, b = row[k], other[k]
            normal = vector(numbers, k, 0)
            along, second = dot(normal, vector(ways, a, 0)), 0.0
            if b >= 0:
                along -= dot(normal, vector(ways, b, 0))
                second = share[b]
            total = share[a] + second
            lack = min(0.0, -(numbers[k, 9] + allowed[k])) - along
            if not (lack > ROUNDING * allowed[k] and total > 0.0):
                continue
            is_blocked[a] = True
            for i in range(3):
                ways[a, i] += normal[i] * lack * share[a] / total
                if b >= 0:
                    ways[b, i] -= normal[i] * lack * second / total
