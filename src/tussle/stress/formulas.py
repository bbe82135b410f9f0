"""Formulas of signal temporal logic over sampled signals, and their robustness.

The semantics is the quantitative one of Donzé and Maler (2010, "Robust satisfaction of temporal logic over real-valued signals", definition
3) over samples: a formula is a number for each sample, positive where it holds and negative where it does not, in the unit of what is
compared. Windows end with the signal: `always` of no samples is +inf, `eventually` -inf.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

Traces = Mapping[str, np.ndarray]
"""Values of each term, (n_samples,); a quantity that is known at the end only is the same in all samples."""

MAX_DELAY = 2**62
"""Delay of what is known at the end of the game only [samples]."""


def windowed(values: np.ndarray, first: int, last: int | None, of: np.ufunc, empty: float) -> np.ndarray:
    """Minimum or maximum over the samples k + first to k + last, for each sample k, (n,).

    By van Herk (1992): running extremes from both ends of blocks as long as the window.

    Args:
        values: The samples, (n,).
        first: Where the window begins, from the sample on.
        last: Where it ends, included; None for the end of the signal.
        of: `numpy.minimum` or `numpy.maximum`.
        empty: The value of a window without samples.
    """
    n = len(values)
    out = np.full(n, empty)
    if first >= n:
        return out
    shifted = values[first:]
    m = len(shifted)
    if last is None or last - first >= m - 1:
        out[:m] = of.accumulate(shifted[::-1])[::-1]
        return out
    width = last - first + 1
    padded = np.full(-(-(m + width) // width) * width, empty)
    padded[:m] = shifted
    blocks = padded.reshape(-1, width)
    forward = of.accumulate(blocks, axis=1).ravel()
    backward = of.accumulate(blocks[:, ::-1], axis=1)[:, ::-1].ravel()
    out[:m] = of(backward[:m], forward[width - 1 : width - 1 + m])
    return out


class Formula:
    """A formula; `robustness` is its value at the first sample."""

    @property
    def delay(self) -> int:
        """Samples after which its value at the first sample is known."""
        raise AssertionError

    def over(self, traces: Traces) -> np.ndarray:
        """Robustness at each sample, (n,)."""
        raise AssertionError

    def robustness(self, traces: Traces) -> float:
        """Robustness of the whole signal."""
        return float(self.over(traces)[0])

    def known(self, traces: Traces) -> np.ndarray:
        """What the robustness is at most, as known at each sample, (n,); the last is the robustness.

        It never rises: by `always`, the least so far; of what is not decided yet, +inf. This is the upper end of robust satisfaction
        intervals (Deshmukh et al. 2017, "Robust online monitoring of signal temporal logic"), but for operators inside `always`, of which
        only the decided values count.
        """
        values = self.over(traces)
        out = np.full(len(values), np.inf)
        out[min(self.delay, len(values) - 1) :] = values[0]
        return out

    def present(self, traces: Traces) -> np.ndarray:
        """Robustness of each sample alone, (n,): under `always`, that of what must hold then. NaN where that is not known at once."""
        values = self.over(traces)
        return values if self.delay == 0 else np.full(len(values), np.nan)


@dataclass(frozen=True)
class Above(Formula):
    """A term is positive. Comparisons are differences."""

    term: str
    is_late: bool = False

    @property
    def delay(self) -> int:
        return MAX_DELAY if self.is_late else 0

    def over(self, traces: Traces) -> np.ndarray:
        return traces[self.term]


@dataclass(frozen=True)
class Not(Formula):
    """The other does not hold."""

    inner: Formula

    @property
    def delay(self) -> int:
        return self.inner.delay

    def over(self, traces: Traces) -> np.ndarray:
        return -self.inner.over(traces)


@dataclass(frozen=True)
class Every(Formula):
    """All of some formulas hold (`and`), or at least one (`or`)."""

    parts: tuple[Formula, ...]
    is_any: bool = False

    @property
    def delay(self) -> int:
        return max(part.delay for part in self.parts)

    def over(self, traces: Traces) -> np.ndarray:
        return self._of([part.over(traces) for part in self.parts])

    def known(self, traces: Traces) -> np.ndarray:
        return self._of([part.known(traces) for part in self.parts])

    def present(self, traces: Traces) -> np.ndarray:
        if self.is_any:
            return super().present(traces)
        return np.asarray(np.fmin.reduce(np.stack([part.present(traces) for part in self.parts])))

    def _of(self, values: Sequence[np.ndarray]) -> np.ndarray:
        of = np.maximum if self.is_any else np.minimum
        return np.asarray(of.reduce(np.stack(np.broadcast_arrays(*values))))


@dataclass(frozen=True)
class Window(Formula):
    """A formula holds at all samples of a window (`always`), or at one (`eventually`).

    Attributes:
        inner: The formula.
        first: Where the window begins [samples].
        last: Where it ends, included; None for the end of the game.
        is_any: `eventually`.
    """

    inner: Formula
    first: int = 0
    last: int | None = None
    is_any: bool = False

    @property
    def delay(self) -> int:
        return MAX_DELAY if self.last is None else min(MAX_DELAY, self.inner.delay + self.last)

    def over(self, traces: Traces) -> np.ndarray:
        of, empty = (np.maximum, -np.inf) if self.is_any else (np.minimum, np.inf)
        return windowed(self.inner.over(traces), self.first, self.last, of, empty)

    def known(self, traces: Traces) -> np.ndarray:
        if self.is_any:
            return super().known(traces)
        values = self.inner.over(traces)
        n = len(values)
        out = np.full(n, np.inf)
        seen = values[self.first : n if self.last is None else self.last + 1]
        begin = self.first + min(self.inner.delay, n)
        if begin < n:
            least = np.minimum.accumulate(seen[: n - begin]) if len(seen) else np.full(1, np.inf)
            out[begin : begin + len(least)] = least
            out[begin + len(least) :] = least[-1]
        out[-1] = np.min(seen, initial=np.inf)  # windows inside end with the game
        return out

    def present(self, traces: Traces) -> np.ndarray:
        if self.is_any:
            return super().present(traces)
        values = self.inner.present(traces)
        last = len(values) if self.last is None else self.last
        out = np.full(len(values), np.nan)
        out[self.first : last + 1] = values[self.first : last + 1]
        return out


@dataclass(frozen=True)
class UntilHolds(Formula):
    """`right` holds at a sample of a window, and `left` at all samples before it."""

    left: Formula
    right: Formula
    first: int = 0
    last: int | None = None

    @property
    def delay(self) -> int:
        inner = max(self.left.delay, self.right.delay)
        return MAX_DELAY if self.last is None else min(MAX_DELAY, inner + self.last)

    def over(self, traces: Traces) -> np.ndarray:
        left, right = np.broadcast_arrays(self.left.over(traces), self.right.over(traces))
        n, width = len(left), 1
        last = n - 1 if self.last is None else min(self.last, n - 1)
        if last < self.first:
            return np.full(n, -np.inf)

        def later(by: int) -> np.ndarray:  # what is found from a later sample on, if `left` holds until then
            held = windowed(left, 0, by - 1, np.minimum, np.inf)
            return np.asarray(np.minimum(held, np.concatenate([found[by:], np.full(min(by, n), -np.inf)])))

        found = right  # of a window from the sample on, so many samples wide
        while width <= last - self.first:
            by = min(width, last - self.first + 1 - width)
            found, width = np.maximum(found, later(by)), width + by
        return later(self.first) if self.first else found


def records(known: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Samples at which the least robustness so far falls, and what it falls to: where a game comes nearer to failure, and how near."""
    is_lower = np.empty(len(known), bool)
    is_lower[:1] = known[:1] < np.inf
    np.less(known[1:], known[:-1], out=is_lower[1:])
    (falls,) = is_lower.nonzero()
    return falls, known[falls]


def guided(known: np.ndarray, guide: np.ndarray) -> np.ndarray:
    """One score of a game for splitting, (n,), which never rises: first by a guide until that is broken, and then by the specification.

    It is negative where the specification is broken, from 0 to 1 where only the guide is, and 1 or more before.

    Args:
        known: What the robustness of the specification is at most, (n,).
        guide: What that of the guide is at most, (n,).
    """
    far = np.maximum(known, 0.0)
    nearer = np.where(guide < 0.0, 1.0 - 1.0 / (1.0 + far), 1.0 + guide)
    return np.where(known < 0.0, known, nearer)
