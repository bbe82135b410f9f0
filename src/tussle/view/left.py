"""The entities of a team over time, from recorded states and from the births and deaths between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from tussle.view.recording import Recording


def numbers_left(
    run: Recording, frame_times: np.ndarray, n: np.ndarray, born: Sequence[float], died: Sequence[float]
) -> tuple[np.ndarray, np.ndarray]:
    """Entities over time: in frames, and after each birth and death between frames that lie apart.

    Args:
        run: The recording.
        frame_times: Times of frames [s], ascending, (k,).
        n: Entities in each of them, (k,).
        born: Times of births [s].
        died: Times of deaths [s].

    Returns:
        Times [s], ascending, and how many there are from then on.
    """

    def steps_of(times: Sequence[float] | np.ndarray) -> np.ndarray:
        steps: np.ndarray = np.rint((np.asarray(times, float) - run.start) / run.dt).astype(np.int64)
        return steps

    steps = steps_of(frame_times)
    come, gone = np.sort(steps_of(born)), np.sort(steps_of(died) + 1)  # who dies is there until the step ends
    between = np.setdiff1d(np.append(come, gone), steps)
    between = between[(between > steps[0]) & (between < steps[-1])]
    frame = np.searchsorted(steps, between) - 1

    def change(at: np.ndarray) -> np.ndarray:
        return np.searchsorted(come, at, "right") - np.searchsorted(gone, at, "right")

    t = np.append(frame_times, run.start + between * run.dt)
    order = np.argsort(t, kind="stable")
    return t[order], np.append(n, n[frame] + change(between) - change(steps[frame]))[order]
