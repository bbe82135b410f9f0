"""Kernels that step a range of rows of a motion model in place."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.numeric.kernel import Kernel

RANGE_STEP = "F2w F2 F2 F I i8 i8 f8 i8"
"""Codes of such a kernel: (x, u, p, numbers, wholes, begin, end, dt, substeps)."""


@dataclass(frozen=True)
class RangeKernel:
    """A kernel that steps the rows [begin, end), so that threads and blocks of rows need no copies of the state.

    Attributes:
        kernel: Kernel with the signature `RANGE_STEP`: state (m, n), inputs (k, n), parameters (q, n), the constants below, a range
            of rows, the time to advance [s], the number of substeps in it.
        numbers: Constants, (a,).
        wholes: Constants, (b,), whole numbers.
        rows_per_thread: Minimum number of rows per thread.
    """

    kernel: Kernel
    numbers: np.ndarray
    wholes: np.ndarray
    rows_per_thread: int

    def advance(self, x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int) -> None:
        """Advance all rows by dt [s] in equal substeps."""
        self.part(x, u, p, dt, substeps, 0, x.shape[1])

    def part(
        self, x: np.ndarray, u: np.ndarray, p: np.ndarray, dt: float, substeps: int, begin: int, end: int
    ) -> None:
        """Advance the rows [begin, end)."""
        self.kernel(x, u, p, self.numbers, self.wholes, begin, end, dt, substeps)

    def arrays(self, x: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[Any, ...]:
        """Return the arguments for a kernel of another signature: the address of this one, and its arrays."""
        return self.kernel.address, x, u, p, self.numbers, self.wholes
