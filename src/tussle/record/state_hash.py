"""The state hash: BLAKE2b over ordered columns."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable

import numpy as np


def hash_columns(columns: Iterable[tuple[str, np.ndarray | bytes]]) -> str:
    """Hash named columns in the given order to 32 hexadecimal digits; every bit counts, the sign of zero included.

    Only the sign and payload of NaN do not: IEEE 754 leaves them open, and compilers use that.

    Args:
        columns: (name, array or bytes).
    """
    digest = hashlib.blake2b(digest_size=16)
    for name, values in columns:
        data = values if isinstance(values, bytes) else _bits(values)
        digest.update(f"{name}:{len(data)};".encode())
        digest.update(data)
    return digest.hexdigest()


def _bits(values: np.ndarray) -> bytes:
    same = np.where(np.isnan(values), np.nan, values) if values.dtype.kind == "f" else values
    return np.ascontiguousarray(same).tobytes()
