"""The course of a batch through a Dask cluster: which worker plays what, and what is done where one is lost."""

from __future__ import annotations

import os
import queue
import time
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

from tussle.batch.cluster_script import travelling
from tussle.batch.cluster_worker import SOURCE, TOPIC, about, keep, packages_of, play_chunk
from tussle.batch.executors import Waiting, even_size
from tussle.batch.stack import stack_size
from tussle.batch.tasks import Beat, Finished, Package, Run
from tussle.errors import BatchError

Future = Any
"""That of `distributed`, which annotates a part of itself."""

BEAT, MET, OVER = "beat", "met", "over"
"""Kinds of news: a worker tells how far it is, has said what it is, or is done with a chunk."""

LOOK_EVERY = 0.5
"""Time between two looks at which workers there are [s]."""
ANSWERED_WITHIN = 30.0
"""Time in which a scheduler answers, however busy it is [s]."""
FETCHED_WITHIN = 2.0
"""Time after which a result that does not come is looked after [s]."""
DEATHS = 2
"""Workers that die over the same runs before these are taken to be why: machines are taken away for no fault of what they play."""


@dataclass
class _Chunk:
    """Runs of one group that one worker plays side by side.

    Attributes:
        group: The group.
        runs: The runs.
        n_deaths: Workers that have died over them.
        worker: Who plays them.
        future: What becomes of them.
        part: How much of them has been played, in runs.
    """

    group: int
    runs: Sequence[Run]
    n_deaths: int = 0
    worker: str = ""
    future: Future | None = None
    part: float = 0.0


class Course:
    """One batch on its way through the cluster.

    Each chunk is given to one worker, not to the cluster at large: so it is known over what a worker has died, a worker with several
    threads does not take chunks that others could play, and only as many chunks as there are workers are under way.
    """

    def __init__(
        self,
        package: Package,
        runs: Sequence[Run],
        client: Any,
        stack: int | None,
        n_workers: int,
        patience: float | None,
        look: Callable[[float], None] | None,
    ) -> None:
        self.package, self.client, self.stack = package, client, stack
        self.n_workers, self.patience, self.look = n_workers, patience, look
        self.sent = travelling(package)
        self.address = str(self.client.scheduler.address)
        self.plugin_packages = packages_of(package)
        self.waiting = Waiting(runs)
        self.again: deque[_Chunk] = deque()
        self.under_way: dict[str, _Chunk] = {}  # by key of the task
        self.finished: list[Finished] = []
        self.packages: dict[int, Future] = {}  # by group
        self.sizes: dict[int, int] = {}  # by group
        self.sized_for = 0  # workers
        self.known: dict[str, int] = {}  # threads of all workers
        self.asked: dict[str, Future] = {}  # workers that have yet to say what they are
        self.idle: dict[str, None] = {}  # workers
        self.inbox: queue.SimpleQueue[tuple[str, Sequence[Any]]] = queue.SimpleQueue()
        self.token = os.urandom(4).hex()
        self.n_submitted = 0
        self.is_warned = False
        self.look_at = self.deserted_at = time.monotonic()

    def play(self) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs."""
        deal_with: dict[str, Callable[..., None]] = {BEAT: self._beat, MET: self._meet, OVER: self._over}
        inbox = self.inbox  # the client keeps what it calls, and shall not keep the batch
        self.client.subscribe_topic(TOPIC, lambda event: inbox.put((BEAT, event[1])))
        while self.waiting or self.again or self.under_way:
            try:
                self._look()
                self._hand_out()
                for kind, news in self._news():
                    deal_with[kind](*news)
                self._hand_out()  # before the results are dealt with, for which no worker needs to wait
            except BatchError:
                yield from self.finished  # what came before the trouble
                raise
            finished, self.finished = self.finished, []
            yield from finished
            yield Beat(sum(chunk.part for chunk in self.under_way.values()))

    def stop(self) -> None:
        """End what is under way; workers notice at their next step."""
        chunks = [chunk.future for chunk in self.under_way.values()]
        futures = [*chunks, *self.asked.values(), *self.packages.values()]
        with suppress(OSError, TimeoutError, RuntimeError, CancelledError):  # the scheduler may be gone
            self.client.unsubscribe_topic(TOPIC)
            self.client.cancel(futures)

    def _news(self) -> Iterator[tuple[str, Sequence[Any]]]:
        """What has happened since, or does within the time to the next look."""
        with suppress(queue.Empty):
            yield self.inbox.get(timeout=max(0.0, self.look_at - time.monotonic()))
            while True:
                yield self.inbox.get_nowait()

    def _submit(self, kind: str, worker: str, function: Callable[..., Any], *args: Any, key: str) -> Future:
        """Have one worker do something; that it is over becomes news of a kind, with key and worker."""
        inbox = self.inbox
        future = self.client.submit(function, *args, key=key, workers=[worker], pure=False)
        future.add_done_callback(lambda f: inbox.put((kind, (f.key, worker))))
        return future

    def _key(self, what: str) -> str:
        self.n_submitted += 1
        return f"tussle-{what}-{self.token}-{self.n_submitted}"

    # -- workers --------------------------------------------------------------------------------------------------------

    def _look(self) -> None:
        """Which workers have come, and which are gone."""
        if time.monotonic() < self.look_at:
            return
        self.look_at = time.monotonic() + LOOK_EVERY
        there = self._workers()
        for key in [key for key, chunk in self.under_way.items() if chunk.worker not in there]:
            self._died(key)
        for worker in [w for w in self.known if w not in there]:
            self._forget(worker)
        for worker in [w for w in there if w not in self.known]:
            self.known[worker] = there[worker]
            self.asked[worker] = self._submit(
                MET, worker, about, self.plugin_packages, key=self._key("about")
            )
        self._check_threads()
        self._check_any()

    def _workers(self) -> dict[str, int]:
        """Workers by address, with their threads.

        Raises:
            BatchError: The scheduler does not say.
        """
        with suppress(OSError, TimeoutError):
            if self.client.status == "running":
                threads: dict[str, int] = self.client.nthreads(callback_timeout=ANSWERED_WITHIN)
                return threads
        raise BatchError(f"{self.address}: the Dask scheduler is gone; finished runs are kept")

    def _forget(self, worker: str) -> None:
        for table in (self.known, self.idle, self.asked):
            table.pop(worker, None)

    def _check_threads(self) -> None:
        """Say once that threads are of no use."""
        n_idle = sum(self.known.values()) - len(self.known)
        if n_idle and not self.is_warned:
            self.is_warned = True
            warnings.warn(
                f"workers play one stack at a time, whatever their threads: {n_idle} threads are idle; start more workers of one "
                f"thread each: `dask worker {self.address} --nworkers N --nthreads 1`, or Client(threads_per_worker=1)",
                RuntimeWarning,
                stacklevel=2,
            )

    def _check_any(self) -> None:
        """Wait for workers as long as that makes sense.

        Raises:
            BatchError: There is none, and has been none for long.
        """
        if self.known:
            self.deserted_at = time.monotonic()
            return
        patience, waited = self.patience, time.monotonic() - self.deserted_at
        if self.look is not None:
            self.look(waited)
        if patience is not None and waited > patience:
            raise BatchError(
                f"{self.address}: the Dask scheduler has had no worker for {patience:g} s; "
                f"`dask worker {self.address} --nthreads 1` starts one; finished runs are kept"
            )

    def _meet(self, _: str, worker: str) -> None:
        """A worker has said what it is.

        Raises:
            BatchError: It is not what is here.
        """
        future = self.asked.pop(worker, None)
        if future is None:
            return
        theirs = self._result(future, worker)
        if theirs is None:
            self._forget(worker)  # it is met again if it is still there
            return
        check_same(theirs, about(self.plugin_packages), worker)
        self.idle[worker] = None

    # -- chunks ---------------------------------------------------------------------------------------------------------

    def _hand_out(self) -> None:
        """Give each worker that has nothing to do a chunk."""
        while self.idle and (chunk := self._next()) is not None:
            worker, _ = self.idle.popitem()
            key = self._key("chunk")
            package = self._package(chunk.group)
            future = self._submit(OVER, worker, play_chunk, package, chunk.runs, key, key=key)
            self.under_way[key] = replace(chunk, worker=worker, future=future, part=0.0)

    def _next(self) -> _Chunk | None:
        """What is to be played next."""
        if self.again:
            return self.again.popleft()
        if self.waiting.alone:
            run = self.waiting.alone.popleft()
            return _Chunk(run.group, [run])
        group = self.waiting.largest()
        return None if group is None else _Chunk(group, self.waiting.take(group, self._size(group)))

    def _size(self, group: int) -> int:
        """Runs of a chunk: a stack, but so that workers are busy to the end. Groups share the workers by their numbers of runs."""
        n_workers = max(len(self.known), self.n_workers)
        if self.sized_for != n_workers:
            self.sized_for, self.sizes = n_workers, {}
        if group not in self.sizes:
            full = self.stack or stack_size(self.package.mission(group))
            n_runs, n_all = len(self.waiting.groups[group]), len(self.waiting)
            self.sizes[group] = even_size(full, n_runs, -(-n_workers * n_runs // n_all))
        return self.sizes[group]

    def _package(self, group: int) -> Future:
        """What a group plays, which goes to each worker once. Those of groups that nobody plays any more are dropped."""
        if group not in self.packages:
            alive = {
                *self.waiting.groups,
                *(chunk.group for chunk in [*self.again, *self.under_way.values()]),
            }
            for other in self.packages.keys() - alive:
                del self.packages[other]
            own = Package((self.sent.missions[group],), self.sent.plugin_files)
            self.packages[group] = self.client.submit(keep, own, key=self._key("package"), pure=False)
        return self.packages[group]

    # -- what comes of them ---------------------------------------------------------------------------------------------

    def _beat(self, key: str, part: float) -> None:
        if key in self.under_way:
            self.under_way[key].part = part

    def _over(self, key: str, worker: str) -> None:
        """A chunk is over."""
        if key not in self.under_way:  # its worker was held to be lost
            return
        future = self.under_way[key].future
        assert future is not None
        results = self._result(future, worker)
        if results is None:
            self._died(key)
        else:
            del self.under_way[key]
            self.finished += results
        if worker in self.known:
            self.idle[worker] = None

    def _result(self, future: Future, worker: str) -> Any:
        """What a task has given; None where its worker was lost.

        Raises:
            BatchError: It failed, or the scheduler is gone.
        """
        from distributed import KilledWorker

        while True:
            try:
                return future.result(timeout=FETCHED_WITHIN)
            except (
                TimeoutError
            ):  # it is over, but what it gave went with its worker before it could be fetched
                if worker not in self._workers():
                    return None
            except (KilledWorker, CancelledError, OSError):
                self._workers()
                return None
            except Exception as error:
                raise BatchError(
                    f"worker {worker} cannot play: {type(error).__name__}: {error}; tussle, and what plugins import, must be "
                    f"installed there as here"
                ) from error

    def _died(self, key: str) -> None:
        """A worker has died over a chunk: it is played again, at last each run alone; one that was alone has failed."""
        chunk = self.under_way.pop(key)
        assert chunk.future is not None
        chunk.future.cancel()
        self.packages.pop(chunk.group, None)  # it may have been lost with the worker
        n_deaths = chunk.n_deaths + 1
        if n_deaths < DEATHS:
            self.again.append(replace(chunk, n_deaths=n_deaths))
        elif len(chunk.runs) > 1:
            self.waiting.alone.extend(replace(run, is_alone=True) for run in chunk.runs)
        else:
            teams = self.package.mission(chunk.group).teams
            self.finished.append(
                Finished.failed(
                    chunk.runs[0], f"the workers that played it died, {DEATHS} of {DEATHS}", teams
                )
            )


def check_same(theirs: Mapping[str, str], ours: Mapping[str, str], worker: str) -> None:
    """See that a worker gives the results that this process would.

    Raises:
        BatchError: Something is there in another version.
    """
    differing = [name for name in ours if theirs.get(name) != ours[name]]
    versions = [name for name in differing if not name.startswith(SOURCE)]
    if versions:
        there, here = (", ".join(f"{name} {v.get(name)}" for name in versions) for v in (theirs, ours))
        raise BatchError(
            f"worker {worker} has {there}; here is {here}; results are the same only with the same versions on both"
        )
    if differing:
        names = " and ".join(
            f"{name.removeprefix(SOURCE)} {ours.get(name.removeprefix(SOURCE), '')}".strip()
            for name in differing
        )
        raise BatchError(
            f"worker {worker} has {names} with another source than here; install the same one on both"
        )
