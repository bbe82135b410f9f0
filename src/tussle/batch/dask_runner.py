"""Plays a batch on the workers of a Dask cluster."""

from __future__ import annotations

import os
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, wait
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from tussle.arguments import explained
from tussle.batch.code import code_of
from tussle.batch.dask_worker import play_chunk
from tussle.batch.executors import RunQueue, even_size
from tussle.batch.stack import stack_size
from tussle.batch.tasks import BatchRun, Finished, Heartbeat, Package
from tussle.errors import BatchError, MissingExtraError, ParameterError

Client = Any
"""A class of `distributed`, which is annotated in part."""

POLL_PERIOD = 0.5
"""Time between two questions which workers there are [s]."""
ANSWER_TIMEOUT = 30.0
"""Time in which a scheduler answers, however busy it is [s]."""
DEATHS = 2
"""Workers that die over the same runs before these are taken to be the reason: machines are also taken away."""


def missing_extra(package: str) -> MissingExtraError:
    """The error where a package of the extra `cluster` is not installed."""
    return MissingExtraError(
        f"several machines need {package}, which is not installed: pip install 'tussle[cluster]'"
    )


@contextmanager
def connect(address: str, timeout: float = 10.0) -> Iterator[Client]:
    """A client of the Dask scheduler at an address, such as "tcp://node1:8786".

    Args:
        address: Of the scheduler.
        timeout: How long to wait for it [s].

    Raises:
        BatchError: No scheduler answers there.
        MissingExtraError: Dask is not installed.
    """
    try:
        import distributed
    except ImportError:
        raise missing_extra("distributed") from None
    try:
        client: Any = distributed.Client(address, timeout=timeout, set_as_default=False)  # type: ignore[no-untyped-call]
    except (OSError, ValueError, TypeError) as error:
        reason = f"within {timeout:g} s" if isinstance(error, TimeoutError | OSError) else f"({error})"
        raise BatchError(
            f"{address}: no Dask scheduler answers {reason}; `dask scheduler` starts one and prints its address"
        ) from None
    with closing(client):
        yield client


@explained
class OnDask:
    """Plays on the workers of a Dask cluster, one stack at a time on each: start them with one thread.

    The runs of a worker that is lost are played again on another one. Runs whose workers die again and again are played one by one, and
    one that still kills its workers is recorded as failed.

    Args:
        client: Of the cluster.
        stack: Worlds side by side; None chooses by the mission.
        n_workers: Workers that are expected, where they come one by one.
        patience: How long to wait while there is no worker [s]; None for ever.
        look: Called now and then while there is no worker, with the time since there was one [s]; raises where none can come.

    Raises:
        ParameterError: The client is asynchronous.
    """

    def __init__(
        self,
        client: Client,
        stack: int | None = None,
        *,
        n_workers: int = 0,
        patience: float | None = 60.0,
        look: Callable[[float], None] | None = None,
    ) -> None:
        if client.asynchronous:
            raise ParameterError("the client is asynchronous; a batch takes Client(..., asynchronous=False)")
        self.client, self.stack, self.n_workers = client, stack, n_workers
        self.patience, self.look = patience, look

    def play(self, package: Package, runs: Sequence[BatchRun]) -> Generator[Finished | Heartbeat, None, None]:
        """Yield one result per run. Closing the generator cancels running tasks.

        Raises:
            ParameterError: Runs have a time limit.
            BatchError: The scheduler or all workers are gone, or a worker cannot play this batch.
        """
        if package.run_timeout is not None:
            raise ParameterError(
                "run_timeout is for processes of this machine; on a cluster, limit the time of the jobs"
            )
        playing = _Playing(self, package, runs)
        try:
            yield from playing.results()
        finally:
            playing.stop()


@dataclass
class _Chunk:
    """Runs of one group that one worker plays side by side.

    Attributes:
        runs: The runs.
        n_deaths: Workers that have died over them.
        future: Their results.
    """

    runs: Sequence[BatchRun]
    n_deaths: int = 0
    future: Future[list[Finished]] = field(default_factory=Future)


class _Playing:
    """Runs on their way through a cluster.

    Each chunk is given to one worker, not to the cluster at large: so it is known which runs a worker has died over, and a worker with
    several threads does not hold chunks that others could play.
    """

    def __init__(self, executor: OnDask, package: Package, runs: Sequence[BatchRun]) -> None:
        self.executor, self.client, self.package = executor, executor.client, package
        self.queue, self.again = RunQueue(runs), deque[_Chunk]()
        self.under_way: dict[str, _Chunk] = {}  # by worker
        self.finished: list[Finished] = []
        self.workers: dict[str, int] = {}  # with their threads
        self.sizes: dict[tuple[int, int], int] = {}  # by group and number of workers
        self.address = str(self.client.scheduler.address)
        self.topic = f"tussle-batch-{os.urandom(4).hex()}"
        self.parts: dict[str, float] = {}
        self.is_warned = False
        self.poll_at = self.last_worker_at = time.monotonic()
        parts = self.parts  # the client keeps what it calls, which is not to keep the batch
        self.client.subscribe_topic(self.topic, lambda event: parts.update([event[1]]))

    def results(self) -> Generator[Finished | Heartbeat, None, None]:
        """Yield one result per run.

        Raises:
            BatchError: The scheduler or all workers are gone, or a worker cannot play.
        """
        while self.queue or self.again or self.under_way:
            try:
                self._poll_workers()
                self._collect()
                self._assign_chunks()  # before the results are used, for which no worker needs to wait
            except BatchError:
                yield from self.finished
                raise
            finished, self.finished = self.finished, []
            yield from finished
            yield Heartbeat(sum(self.parts.get(worker, 0.0) for worker in self.under_way))
            if not self.under_way:
                time.sleep(POLL_PERIOD)
            wait([chunk.future for chunk in self.under_way.values()], POLL_PERIOD, FIRST_COMPLETED)

    def stop(self) -> None:
        """Cancel what is under way; workers notice at their next step."""
        with suppress(OSError, TimeoutError, RuntimeError, CancelledError):  # the scheduler may be gone
            self.client.unsubscribe_topic(self.topic)
            for chunk in self.under_way.values():
                chunk.future.cancel()

    # -- workers ----------------------------------------------------------------------------------------------------------

    def _poll_workers(self) -> None:
        """Update the list of workers, at most once per `POLL_PERIOD`."""
        now = time.monotonic()
        if now < self.poll_at:
            return
        self.poll_at = now + POLL_PERIOD
        self.workers = self._connected()
        if self.workers:
            self.last_worker_at = now
        else:
            self._check_patience(now - self.last_worker_at)
        n_idle = sum(self.workers.values()) - len(self.workers)
        if n_idle and not self.is_warned:
            self.is_warned = True
            warnings.warn(
                f"a worker plays one stack at a time: {n_idle} threads are idle; start more workers of one thread each: "
                f"`dask worker {self.address} --nworkers N --nthreads 1`, or Client(threads_per_worker=1)",
                RuntimeWarning,
                stacklevel=2,
            )

    def _connected(self) -> dict[str, int]:
        with suppress(OSError, TimeoutError):
            if self.client.status == "running":
                threads: dict[str, int] = self.client.nthreads(callback_timeout=ANSWER_TIMEOUT)
                return threads
        raise BatchError(f"{self.address}: the Dask scheduler is gone; finished runs are kept")

    def _check_patience(self, waited: float) -> None:
        """Report the time without a worker [s], and stop the batch when the patience is over.

        Raises:
            BatchError: It is over.
        """
        look, patience = self.executor.look, self.executor.patience
        if look is not None:
            look(waited)
        if patience is not None and waited > patience:
            raise BatchError(
                f"{self.address}: the Dask scheduler has had no worker for {patience:g} s; "
                f"`dask worker {self.address} --nthreads 1` starts one; finished runs are kept"
            )

    # -- chunks -----------------------------------------------------------------------------------------------------------

    def _assign_chunks(self) -> None:
        """Assign a chunk to each idle worker."""
        for worker in [w for w in self.workers if w not in self.under_way]:
            chunk = self._next()
            if chunk is None:
                return
            group = chunk.runs[0].group
            own = Package(
                (self.package.missions[group],), self.package.plugin_files, watch=self.package.watch
            )
            code = code_of(self.package.mission(group))
            there = self.client.get_executor(workers=[worker], pure=False)
            chunk.future = there.submit(play_chunk, own, chunk.runs, self.topic, code)
            self.under_way[worker], self.parts[worker] = chunk, 0.0

    def _next(self) -> _Chunk | None:
        if self.again:
            return self.again.popleft()
        if self.queue.alone:
            return _Chunk([self.queue.alone.popleft()])
        group = self.queue.largest()
        return None if group is None else _Chunk(self.queue.take(group, self._size(group)))

    def _size(self, group: int) -> int:
        """Runs of a chunk. Groups share the workers by their numbers of runs."""
        n_workers = max(len(self.workers), self.executor.n_workers)
        if (group, n_workers) not in self.sizes:
            full = self.executor.stack or stack_size(self.package.mission(group))
            n_runs, n_all = len(self.queue.groups[group]), len(self.queue)
            self.sizes[group, n_workers] = even_size(full, n_runs, -(-n_workers * n_runs // n_all))
        return self.sizes[group, n_workers]

    def _collect(self) -> None:
        """Take the results of chunks that are over, and queue those of lost workers again."""
        from distributed import KilledWorker

        for worker, chunk in list(self.under_way.items()):
            if not chunk.future.done() and worker in self.workers:
                continue
            del self.under_way[worker]
            try:
                self.finished += chunk.future.result(timeout=0.0)
            except (KilledWorker, CancelledError, OSError):  # a TimeoutError is one
                chunk.future.cancel()
                self.workers = self._connected()
                self.workers.pop(worker, None)  # it may not have been missed yet
                self._handle_death(chunk)
            except BatchError:
                raise  # it names the worker
            except Exception as error:
                raise BatchError(
                    f"worker {worker} cannot play: {type(error).__name__}: {error}; tussle, and what plugins import, must be "
                    "installed there as here"
                ) from error

    def _handle_death(self, chunk: _Chunk) -> None:
        """Queue the runs again, at last each alone; a run that was alone has failed."""
        chunk.n_deaths += 1
        if chunk.n_deaths < DEATHS:
            self.again.append(chunk)
        elif len(chunk.runs) > 1:
            self.queue.alone.extend(chunk.runs)
        else:
            run, error = chunk.runs[0], f"the workers that played it died, {DEATHS} of {DEATHS}"
            self.finished.append(Finished.failed(run, error, self.package.mission(run.group).teams))
