"""Sorting of nearly sorted int64 keys: few entities change cells from one step to the next."""

from __future__ import annotations

from typing import Any

from tussle.numeric.kernel import device

MOVES_PER_KEY = 6
"""Insertion sort stops after this many moves per key, about the cost of the merge sort."""

RUN = 16
"""Length of the initial runs of the merge sort."""


@device
def insertion_sort(keys: Any, start: int, end: int, budget: int) -> bool:
    """Sort keys[start:end] in place. Returns False after more than `budget` moves; the keys are then a permutation."""
    for i in range(start + 1, end):
        key = keys[i]
        j = i
        while j > start and keys[j - 1] > key:
            keys[j] = keys[j - 1]
            j -= 1
        keys[j] = key
        budget -= i - j
        if budget < 0:
            return False
    return True


@device
def merge(source: Any, target: Any, start: int, middle: int, end: int) -> None:
    """Merge the sorted runs source[start:middle] and source[middle:end] into target[start:end]."""
    left = start
    right = middle
    for i in range(start, end):
        if right >= end or (left < middle and source[left] <= source[right]):
            target[i] = source[left]
            left += 1
        else:
            target[i] = source[right]
            right += 1


@device
def merge_sort(keys: Any, scratch: Any, start: int, end: int) -> None:
    """Sort keys[start:end]; `scratch` is as long as `keys`."""
    for run in range(start, end, RUN):
        last = min(run + RUN, end)
        insertion_sort(keys, run, last, RUN * RUN)
    width = RUN
    while width < end - start:
        for run in range(start, end, 2 * width):
            middle = min(run + width, end)
            last = min(run + 2 * width, end)
            merge(keys, scratch, run, middle, last)
        for i in range(start, end):
            keys[i] = scratch[i]
        width *= 2


@device
def sort_keys(keys: Any, scratch: Any, start: int, end: int) -> None:
    """Sort keys[start:end] in place, in linear time when they are nearly sorted. Keys are distinct, so the order is unique."""
    if not insertion_sort(keys, start, end, MOVES_PER_KEY * (end - start) + 64):
        merge_sort(keys, scratch, start, end)
