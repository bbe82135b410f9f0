"""Plays the runs of a batch on this machine: in this process, or in several."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Protocol

from tussle.arguments import explained
from tussle.batch.stack import HEARTBEAT_PERIOD, play, stack_size
from tussle.batch.tasks import BatchRun, Finished, Heartbeat, Package
from tussle.documents import Maybe, Whole, check_argument
from tussle.errors import BatchError
from tussle.mission import Mission

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

OVERDUE = "it took longer"
"""Start of the error message of a run that took longer than `run_timeout`."""

ENVIRONMENT = {"OMP_WAIT_POLICY": "passive", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
"""Environment of worker processes: each uses one core. Numba and OpenMP read these settings when they load."""


class Executor(Protocol):
    """Plays runs, in any order."""

    def play(self, package: Package, runs: Sequence[BatchRun]) -> Generator[Finished | Heartbeat, None, None]:
        """Yield one result per run. Closing the generator cancels running work."""


class RunQueue:
    """Runs that wait to be played, by group."""

    def __init__(self, runs: Iterable[BatchRun]) -> None:
        self.groups: dict[int, deque[BatchRun]] = {}
        for run in runs:
            self.groups.setdefault(run.group, deque()).append(run)
        self.alone: deque[BatchRun] = deque()  # those over which a worker has died

    def __len__(self) -> int:
        return len(self.alone) + sum(map(len, self.groups.values()))

    def largest(self) -> int | None:
        """The group with most runs left; None when there are none."""
        return max(self.groups, key=lambda group: len(self.groups[group]), default=None)

    def take(self, group: int, n: int) -> list[BatchRun]:
        """Remove and return up to n runs of a group."""
        left = self.groups.get(group, deque())
        taken = [left.popleft() for _ in range(min(n, len(left)))]
        if not left:
            self.groups.pop(group, None)
        return taken


def even_size(size: int, n_runs: int, n_workers: int) -> int:
    """A stack no larger than `size` with which all workers are busy until the end, where games take equally long."""
    rounds = max(1, -(-n_runs // (size * n_workers)))
    return max(1, -(-n_runs // (rounds * n_workers)))


@explained
class InProcess:
    """Plays in this process; in another one where runs have a time limit, or where the process that played a batch before was killed.

    Args:
        stack: Worlds side by side; None chooses by the mission.
    """

    def __init__(self, stack: int | None = None) -> None:
        check_argument("stack", stack, Maybe(Whole(1)))
        self.stack = stack

    def play(self, package: Package, runs: Sequence[BatchRun]) -> Generator[Finished | Heartbeat, None, None]:
        """Yield one result per run."""
        if package.run_timeout is not None:
            yield from Processes(1, self.stack).play(package, runs)
            return
        queue = RunQueue(runs)
        while (group := queue.largest()) is not None:
            mission = package.mission(group)
            size = even_size(self.stack or stack_size(mission), len(queue.groups[group]), 1)
            yield from play(mission, partial(queue.take, group), size, package.watcher())


@explained
class Processes:
    """Plays in several processes of this machine.

    Where a process dies, its runs are played again, each alone; a run whose process dies again is recorded as failed. A process is killed
    where a run takes longer than it may.

    Args:
        n: How many; None is one per core.
        stack: Worlds side by side in each; None chooses by the mission.
    """

    def __init__(self, n: int | None = None, stack: int | None = None) -> None:
        check_argument("processes", n, Maybe(Whole(1)))
        check_argument("stack", stack, Maybe(Whole(1)))
        self.n, self.stack = n or n_cores(), stack

    def play(self, package: Package, runs: Sequence[BatchRun]) -> Generator[Finished | Heartbeat, None, None]:
        """Yield one result per run. Closing the generator ends the processes.

        Raises:
            BatchError: A process cannot play: it ends as it starts, or cannot load the mission.
        """
        from multiprocessing import connection

        queue, workers = RunQueue(runs), list[_Worker]()
        try:
            workers.extend(_Worker(package, self.stack, self.n) for _ in range(min(self.n, len(runs))))
            while workers:
                ready = connection.wait([w.pipe for w in workers], HEARTBEAT_PERIOD)
                for worker in list(workers):
                    worker.kill_if_overdue()
                    if worker.pipe not in ready:
                        continue
                    try:
                        yield from worker.receive(queue)
                    except (EOFError, OSError):
                        yield from worker.handle_death(queue)
                        if queue:
                            workers.append(_Worker(package, self.stack, self.n))
                    if worker.is_done:
                        workers.remove(worker)
                        worker.stop()
                yield Heartbeat(sum(w.part for w in workers))
        finally:
            for worker in workers:
                worker.stop()


def n_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class _Worker:
    """One process, as its parent sees it.

    The process asks for runs through a pipe, and sends results, heartbeats, and a text where it cannot play. There is one pipe for each
    process, as a process that is killed may leave a shared queue locked.
    """

    def __init__(self, package: Package, stack: int | None, n_processes: int) -> None:
        from multiprocessing import get_context

        context = get_context("spawn")
        self.package = package
        self.pipe, theirs = context.Pipe()
        self.under_way: dict[int, BatchRun] = {}
        self.began: dict[int, float] = {}  # by run, once its mission is loaded
        self.part = self.heard_at = 0.0
        self.n_worlds = 0  # most runs side by side since there was none
        self.is_alone = self.is_overdue = self.is_done = False
        self.process = context.Process(
            target=_work, args=(theirs, package, stack, n_processes), daemon=True, name="tussle-batch"
        )
        try:
            with _inherited():
                self.process.start()
        except OSError as error:
            raise BatchError(f"a process that was to play cannot be started: {error}") from error
        theirs.close()

    def receive(self, queue: RunQueue) -> Iterator[Finished]:
        """Handle one message of the process.

        Raises:
            BatchError: The process cannot play.
            EOFError, OSError: The process has died.
        """
        message = self.pipe.recv()
        self.heard_at = time.monotonic()
        if isinstance(message, Finished):
            del self.under_way[message.number]
            self.began.pop(message.number, None)
            yield message
        elif isinstance(message, Heartbeat):
            self.part = message.under_way
            for number in self.under_way:
                self.began.setdefault(number, self.heard_at)
        elif isinstance(message, str):
            raise BatchError(message)
        else:
            self._hand_out(queue, *message)

    def _hand_out(self, queue: RunQueue, group: int | None, n: int) -> None:
        """Send up to n runs of a group, or the first run of a new stack with the number of runs that its group has left."""
        runs, n_left = [], 1
        if group is not None:
            runs = [] if self.is_alone else queue.take(group, n)
        else:
            self.n_worlds, self.is_alone = 0, bool(queue.alone)
            if self.is_alone:
                runs = [queue.alone.popleft()]
            elif (largest := queue.largest()) is not None:
                n_left = len(queue.groups[largest])
                runs = queue.take(largest, 1)
            self.is_done = not runs
        self.under_way |= {run.number: run for run in runs}
        self.n_worlds = max(self.n_worlds, len(self.under_way))
        self.pipe.send((runs, n_left))

    def kill_if_overdue(self) -> None:
        """Kill the process where a run takes too long. The worlds of a stack share its time; no step may take longer than a run may."""
        limit, now = self.package.run_timeout, time.monotonic()
        if limit is None or not self.began or self.is_overdue:
            return
        longest = now - min(self.began.values())
        if now - self.heard_at > limit or longest > limit * self.n_worlds:
            self.is_overdue = True
            self.process.kill()

    def handle_death(self, queue: RunQueue) -> Iterator[Finished]:
        """Queue the runs of the process again, each alone; a run that was alone has failed.

        Raises:
            BatchError: The process has never played.
        """
        self.process.join(5.0)
        self.is_done = True
        code = self.process.exitcode
        why = f"exit code {code}"
        if code is not None and code < 0:
            why = f"signal {-code}, {signal.strsignal(-code)}"
        if not self.heard_at:
            raise BatchError(f"a process that was to play ended as it started ({why})")
        error = f"the process that played it died: {why}"
        if self.is_overdue:
            error = f"{OVERDUE} than the {self.package.run_timeout} s that a run may"
        for run in self.under_way.values():
            if self.is_alone or (self.is_overdue and self.n_worlds == 1):
                yield Finished.failed(run, error, self.package.mission(run.group).teams)
            else:
                queue.alone.append(run)

    def stop(self) -> None:
        """End the process, whatever it does."""
        self.pipe.close()
        if not self.is_done:
            self.process.terminate()
        self.process.join(5.0)
        if self.process.is_alive():
            self.process.kill()
            self.process.join()


@contextmanager
def _inherited() -> Iterator[None]:
    """Context in which started processes get `ENVIRONMENT`, do not import the caller's script, and leave Ctrl-C to their parent."""
    from multiprocessing import resource_tracker

    script, before = sys.modules["__main__"], {name: os.environ.get(name) for name in ENVIRONMENT}
    can_block = hasattr(signal, "pthread_sigmask")  # not on Windows: there `_work` ignores it
    if can_block:
        resource_tracker.ensure_running()  # as it starts it unblocks signals
        mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    sys.modules["__main__"] = ModuleType("__main__")
    os.environ.update(ENVIRONMENT)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
        sys.modules["__main__"] = script
        if can_block:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)


# -- in the process that plays ----------------------------------------------------------------------------------------------


def _work(pipe: Connection, package: Package, stack: int | None, n_processes: int) -> None:
    """Play runs until there are no more; end at once where the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()
    try:
        _play_all(pipe, package, stack, n_processes)
    except (EOFError, OSError):
        os._exit(1)


def _play_all(pipe: Connection, package: Package, stack: int | None, n_processes: int) -> None:
    def ask(group: int | None, n: int) -> tuple[list[BatchRun], int]:
        pipe.send((group, n))
        answer: tuple[list[BatchRun], int] = pipe.recv()
        return answer

    missions: dict[int, Mission] = {}  # the last one only
    while True:
        first, n_left = ask(None, 1)
        if not first:
            return
        group = first[0].group
        if group not in missions:
            try:
                missions = {group: package.mission(group)}
            except Exception as error:  # noqa: BLE001 - unpickling raises whatever modules and classes raise
                pipe.send(
                    f"a process that was to play cannot load the mission: {type(error).__name__}: {error}; its plugins must be in "
                    "a module that can be imported, in a plugin file, or in the script itself"
                )
                return
        pipe.send(Heartbeat(0.0))  # from now on the time of the run counts

        def take(n: int, held: list[BatchRun] = first, group: int = group) -> list[BatchRun]:
            own = [held.pop()] if held and n else []
            return own + ask(group, n - len(own))[0] if n > len(own) else own

        size = even_size(stack or stack_size(missions[group]), n_left, n_processes)
        for message in play(missions[group], take, size, package.watcher()):
            pipe.send(message)


def _end_with_parent() -> None:
    """Wait for the end of the parent, and end too, whatever a plugin does."""
    from multiprocessing import connection, parent_process

    parent = parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)
