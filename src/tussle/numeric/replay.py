"""Calls of kernels that a piece of Python makes, recorded with their arguments and made again by one call of machine code."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache, partial
from typing import Any

import numpy as np

from tussle.numeric.address import caller
from tussle.numeric.bound import RESULTS, Bound
from tussle.numeric.fingerprint import package
from tussle.numeric.kernel import Kernel, kernel, ready, stats

_is_recording = threading.Lock()


class KernelCalls:
    """Calls of kernels of one thread, in order.

    Args:
        locked: Arrays that only kernels may change meanwhile.

    Attributes:
        calls: Kernels with their arguments.
        is_whole: Whether these are all calls, and each returned nothing or True. Then they can be made again, up to one that does not
            return True.
    """

    def __init__(self, locked: Sequence[np.ndarray] = ()) -> None:
        self.calls: list[tuple[Any, ...]] = []
        self.is_whole = True
        self._thread = threading.get_ident()
        self._spans = [span_of(array) for array in locked]

    def listener(self, each: Kernel) -> Callable[..., Any]:
        """Return a function that calls a kernel and records the call."""
        run: Callable[..., Any] = each.machine_code
        if self._spans:
            run = partial(self.unlocked, run)

        def call(*arguments: Any, **named: Any) -> Any:
            found = run(*arguments, **named)
            if threading.get_ident() == self._thread:
                self.calls.append((each, *arguments))
                self.is_whole &= (found is None or found is True) and not named
            return found

        return call

    def unlocked(self, run: Callable[..., Any], *arguments: Any, **named: Any) -> Any:
        """Call a function that may change what is locked of its arguments."""
        given = (*arguments, *named.values())
        flat = [each for one in given for each in (one if isinstance(one, tuple) else (one,))]
        locked = [
            each
            for each in flat
            if isinstance(each, np.ndarray) and not each.flags.writeable and self._has_locked(each)
        ]
        try:
            for each in locked:
                each.flags.writeable = True
            return run(*arguments, **named)
        finally:
            for each in locked:
                each.flags.writeable = False

    def _has_locked(self, array: np.ndarray) -> bool:
        first, last = span_of(array)
        return threading.get_ident() == self._thread and any(a <= first and last <= b for a, b in self._spans)


@contextmanager
def recording(locked: Sequence[np.ndarray] = ()) -> Iterator[KernelCalls]:
    """Record the calls of kernels in this thread. Where another thread records, nothing is recorded, and the calls are not whole.

    Args:
        locked: Arrays that are read-only meanwhile, but for kernels.
    """
    locked = [array for array in locked if array.flags.writeable]
    recorded, slow_call = KernelCalls(locked), Kernel.__call__

    def first_call(each: Kernel, *arguments: Any, **named: Any) -> Any:
        found = recorded.unlocked(slow_call, each, *arguments, **named)
        if each in ready:
            each.call_by(recorded.listener(each))
        return found

    if not _is_recording.acquire(blocking=False):
        recorded.is_whole = False
        yield recorded
        return
    before = stats.ready, stats.interpreted
    try:
        if locked:
            Kernel.__call__ = first_call  # type: ignore[method-assign, assignment]
        for each in list(ready):
            each.call_by(recorded.listener(each))
        for array in locked:
            array.flags.writeable = False
        yield recorded
    finally:
        for array in locked:
            array.flags.writeable = True
        if locked:
            Kernel.__call__ = slow_call  # type: ignore[method-assign]
        for each in list(ready):
            each.call_by(None)
        # New kernels, and those that ran as Python, have not been listened to.
        recorded.is_whole &= before == (stats.ready, stats.interpreted)
        _is_recording.release()


@cache
def kernel_of_replays() -> Kernel:
    """The kernel (entries, addresses, truths, words, at -> number) that calls bound kernels until one does not return True.

    entries, addresses: of the bound kernels and of their words. truths: place of what each returns in `words`, -1 if it is nothing.
    at: number of the kernel that is called, (1,), for errors.
    """
    call_bound = caller("i8")

    def run(entries, addresses, truths, words, at):  # type: ignore[no-untyped-def]
        for k in range(entries.shape[0]):
            at[0] = k
            call_bound(entries[k], addresses[k])
            if truths[k] >= 0 and words[truths[k]] == 0:
                return k
        return entries.shape[0]

    return kernel("I I I I Iw -> i8")(run)


def may_be_repeated(calls: Sequence[tuple[Any, ...]], moves: bool) -> bool:
    """Whether Python may make calls again up to any that returns False: no kernel of a user up to there writes, and nothing `moves`."""
    stops = [k for k, (each, *_) in enumerate(calls, 1) if each.results]
    first = calls[: max(stops, default=0)]
    return not (moves and stops) and all(
        package(each.py_func) == "tussle" or "w" not in each.signature for each, *_ in first
    )


def are_same(before: Sequence[tuple[Any, ...]], now: Sequence[tuple[Any, ...]]) -> bool:
    """Whether two steps make the same calls: kernels, numbers, and the memory of arrays, but for arrays that kernels of the step write."""
    if [each for each, *_ in before] != [each for each, *_ in now]:
        return False
    written: list[tuple[int, int]] = []
    for (each, *old), (_, *new) in zip(before, now, strict=True):
        for code, a, b in zip(each.arguments, old, new, strict=True):
            parts = [(code, a, b)] if isinstance(code, str) else zip(code, a, b, strict=True)
            for letter, one, other in parts:
                if not isinstance(other, np.ndarray):
                    if one != other:
                        return False
                elif letter.endswith("w"):
                    written.append((address_of(other), address_of(other) + other.nbytes))
                elif address_of(one) != (at := address_of(other)):
                    if not any(start <= at < end for start, end in written):
                        return False
    return True


def span_of(array: np.ndarray) -> tuple[int, int]:
    """Addresses of the first byte of an array, and of the first behind it, if it is contiguous or a part of the columns of a table."""
    first, last = np.lib.array_utils.byte_bounds(array)
    return int(first), int(last)


def address_of(array: np.ndarray) -> int:
    """Address of the first number of an array."""
    return int(array.__array_interface__["data"][0])


class Replay:
    """Makes recorded calls again.

    Args:
        calls: Kernels with their arguments; the memory of arrays is read at each call.

    Attributes:
        at: Number of the last kernel that was called, (1,).
    """

    def __init__(self, calls: Sequence[tuple[Any, ...]]) -> None:
        self._bound = [Bound(*call, is_checked=True) for call in calls]
        starts = np.cumsum([0, *(len(each.words) for each in self._bound)])[:-1]
        words = np.concatenate([each.words for each in self._bound])
        entries = np.array([each.entry for each in self._bound])
        returns = np.array([bool(call[0].results) for call in calls])
        truths = np.where(returns, starts + RESULTS, -1)
        self.at = np.zeros(1, np.int64)
        self._call = entries, words.ctypes.data + 8 * starts, truths, words, self.at
        self._run = kernel_of_replays()

    def run(self) -> int:
        """Make the calls. Returns the number of those before the first that did not return True, or of all. Kernels may raise errors."""
        return int(self._run(*self._call))
