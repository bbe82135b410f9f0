"""Unit quaternions (w, x, y, z) from the body frame (forward, left, up) to the world frame (east, north, up).

In compiled code every function takes and returns components: `quat_rotate(qw, qx, qy, qz, vx, vy, vz)` returns three
numbers. In Python the same functions take arrays: quaternions (4, n) or (4,), vectors (3, n) or (3,). Euler angles are
intrinsic: yaw, then pitch, then roll about the rotated axes. Pitch is about the left axis, so nose down is positive.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tussle.numeric.elementary import atan2, sincos
from tussle.numeric.functions import kernel_over_columns
from tussle.numeric.kernel import Device, device

Floats = NDArray[np.float64]


class Columnar(Device):
    """A function of components in compiled code and of component-first arrays in Python.

    Args:
        scalar: The device function.
        n_in: Number of components of each input; 0 for a scalar.
        n_out: Number of components of the result; 0 for a scalar.
    """

    def __init__(self, scalar: Device, n_in: tuple[int, ...], n_out: int) -> None:
        super().__init__(scalar.py_func)
        self._columns = kernel_over_columns(scalar, [max(1, size) for size in n_in], max(1, n_out))
        self._n_in = n_in
        self._n_out = n_out

    def __call__(self, *values: ArrayLike) -> Any:
        arrays = [np.asarray(value, dtype=np.float64) for value in values]
        if len(arrays) != len(self._n_in):
            raise TypeError(f"{self.__name__} takes {len(self._n_in)} arrays, not {len(arrays)}")
        for place, (array, size) in enumerate(zip(arrays, self._n_in, strict=True)):
            if size and (array.ndim == 0 or array.shape[0] != size):
                raise TypeError(
                    f"{self.__name__}: argument {place} has shape {array.shape}; expected ({size},) or ({size}, n)"
                )
        tails = [
            array.shape[1:] if size else array.shape for array, size in zip(arrays, self._n_in, strict=True)
        ]
        tail = tails[0] if all(each == tails[0] for each in tails) else np.broadcast_shapes(*tails)
        columns = [column_major(array, size, tail) for array, size in zip(arrays, self._n_in, strict=True)]
        out = np.empty((max(self._n_out, 1), columns[0].shape[1]))
        self._columns(*columns, out)
        shaped = out.reshape((self._n_out, *tail) if self._n_out else tail)
        return shaped if shaped.ndim else float(shaped)


def column_major(array: Floats, size: int, tail: tuple[int, ...]) -> Floats:
    """Broadcast an array to its number of components and the common shape, as (components, n)."""
    if array.shape == ((size, *tail) if size else tail):
        shaped = array  # np.broadcast_to takes longer than the kernel
    elif size:
        shaped = np.broadcast_to(
            array.reshape(size, *(1,) * (len(tail) - array.ndim + 1), *array.shape[1:]), (size, *tail)
        )
    else:
        shaped = np.broadcast_to(array, tail)
    return np.ascontiguousarray(shaped).reshape(max(size, 1), -1)


@device
def _from_euler(roll, pitch, yaw):
    """Quaternion from yaw, pitch (positive nose down) and roll [rad]."""
    sr, cr = sincos(0.5 * roll)
    sp, cp = sincos(0.5 * pitch)
    sy, cy = sincos(0.5 * yaw)
    return (
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    )


@device
def _multiply(aw, ax, ay, az, bw, bx, by, bz):
    """Hamilton product: rotation b, then rotation a."""
    return (
        aw * bw - ax * bx - ay * by - az * bz,
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
    )


@device
def _conjugate(w, x, y, z):
    """The inverse rotation."""
    return w, -x, -y, -z


@device
def _normalize(w, x, y, z):
    """Scale to length 1; a zero quaternion becomes the identity."""
    length = math.sqrt(w * w + x * x + y * y + z * z)
    zero = length == 0.0
    scale = 1.0 / (1.0 if zero else length)
    return 1.0 if zero else w * scale, x * scale, y * scale, z * scale


@device
def _rotate(w, x, y, z, vx, vy, vz):
    """Rotate a body vector to the world frame: v + 2 w (q x v) + 2 q x (q x v)."""
    tx = 2.0 * (y * vz - z * vy)
    ty = 2.0 * (z * vx - x * vz)
    tz = 2.0 * (x * vy - y * vx)
    return (
        vx + w * tx + (y * tz - z * ty),
        vy + w * ty + (z * tx - x * tz),
        vz + w * tz + (x * ty - y * tx),
    )


@device
def _rotate_inverse(w, x, y, z, vx, vy, vz):
    """Rotate a world vector to the body frame."""
    return _rotate(w, -x, -y, -z, vx, vy, vz)


@device
def _to_yaw(w, x, y, z):
    """Heading of the body's forward axis [rad], counter-clockwise from east."""
    return atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@device
def _to_pitch(w, x, y, z):
    """Pitch [rad] in [-pi/2, pi/2], positive nose down."""
    # asin would lose half of the digits near +-90 degrees and need a clamp.
    up_left = 2.0 * (w * x + y * z)
    up_up = 1.0 - 2.0 * (x * x + y * y)
    return atan2(2.0 * (w * y - x * z), math.sqrt(up_left * up_left + up_up * up_up))


@device
def _to_roll(w, x, y, z):
    """Roll about the forward axis [rad]."""
    return atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))


quat_from_euler = Columnar(_from_euler, (0, 0, 0), 4)
quat_multiply = Columnar(_multiply, (4, 4), 4)
quat_conjugate = Columnar(_conjugate, (4,), 4)
quat_normalize = Columnar(_normalize, (4,), 4)
quat_rotate = Columnar(_rotate, (4, 3), 3)
quat_rotate_inverse = Columnar(_rotate_inverse, (4, 3), 3)
quat_to_yaw = Columnar(_to_yaw, (4,), 0)
quat_to_pitch = Columnar(_to_pitch, (4,), 0)
quat_to_roll = Columnar(_to_roll, (4,), 0)
