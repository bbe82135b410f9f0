"""Tasks of a Dask worker. A worker outlives batches and may have several threads: nothing here relies on a new process."""

from __future__ import annotations

import threading
import time
from collections.abc import Mapping, Sequence
from contextlib import closing

from tussle.batch.code import SOURCE, code_here
from tussle.batch.stack import play
from tussle.batch.tasks import BatchRun, Finished, Package
from tussle.errors import BatchError

REPORT_PERIOD = 1.0  # [s]; hundreds of workers report to one scheduler

_playing = threading.Lock()
"""One chunk at a time in a process: plugins need not be safe between threads, and the CPU time of a run is that of its process."""


def play_chunk(
    package: Package, runs: Sequence[BatchRun], topic: str, code: Mapping[str, str]
) -> list[Finished]:
    """Play runs of one group side by side.

    Args:
        package: The package of their group only.
        runs: The runs.
        topic: Dask topic under which the worker reports its address and the number of runs that are played, with parts.
        code: `code_of` their mission in the process that asks.

    Returns:
        The results, in the order in which the runs ended; only some where the task was cancelled.

    Raises:
        BatchError: The worker has other code.
    """
    from distributed import get_worker

    worker = get_worker()
    key, waiting, finished = worker.get_current_task(), list(runs), list[Finished]()
    check_same_code(code, str(worker.address))

    def take(n: int) -> list[BatchRun]:
        taken, waiting[:] = waiting[:n], waiting[n:]
        return taken

    with _playing:
        report_at = time.monotonic() + REPORT_PERIOD
        with closing(play(package.mission(0), take, len(runs), package.watcher())) as messages:  # type: ignore[type-var]
            for message in messages:
                task = worker.state.tasks.get(key)
                if task is None or task.state == "cancelled":  # a thread cannot be ended from outside
                    break
                if isinstance(message, Finished):
                    finished.append(message)
                elif time.monotonic() >= report_at:
                    report_at = time.monotonic() + REPORT_PERIOD
                    worker.log_event(topic, [worker.address, len(finished) + message.under_way])
    return finished


def check_same_code(wanted: Mapping[str, str], worker: str) -> None:
    """Compare the code of this process, which is a worker, with that of the process that runs the batch.

    Args:
        wanted: `code_of` there.
        worker: Address of this worker.

    Raises:
        BatchError: They differ.
        ImportError: A package is missing here.
    """
    own = code_here(name.removeprefix(SOURCE) for name in wanted if name.startswith(SOURCE))
    differing = [name for name in wanted if own.get(name) != wanted[name]]
    if differing:
        there, here = (", ".join(f"{name} {v[name]}" for name in differing) for v in (own, wanted))
        raise BatchError(
            f"worker {worker} has {there}; the batch has {here}; equal results need the same code on both"
        )
