"""Many runs take no more memory than a thousand."""

from __future__ import annotations

import multiprocessing
import os
from pathlib import Path

import pytest
from gambles import game

from tussle.batch import Batch, InProcess, Processes

MAX_GROWTH = 5.0  # [MB]; a leak of half a kilobyte a run would show


def resident(process="self"):
    """Resident memory of a process [MB]."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def grown(executor, directory, n_runs, first=1):
    """How much memory of this process, and of those that play, grows from the first thousands of runs to the last [MB]."""
    seen = []

    def watch(progress):
        if progress.n_done % 1000 == 0 and progress.n_done > 0:
            children = [resident(c.pid) for c in multiprocessing.active_children()]
            seen.append((resident(), max(children, default=0.0)))

    Batch(game(), runs=n_runs).play(directory, executor, on_progress=watch)
    return [last - before for before, last in zip(seen[first - 1], seen[-1], strict=True)]


@pytest.mark.slow
def test_ten_thousand_runs(tmp_path):
    ours, theirs = grown(Processes(2), tmp_path / "out", 10_000)
    assert ours < MAX_GROWTH
    assert theirs < MAX_GROWTH


@pytest.mark.slow
def test_ten_thousand_runs_in_memory_take_two_kilobytes_each():
    # The second thousand is played in a larger stack, which takes 25 MB once.
    assert grown(InProcess(), None, 10_000, first=2)[0] < 8 * 2.0 + MAX_GROWTH
