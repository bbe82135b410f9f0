"""Who plays the runs of a batch: this process, or several."""

from __future__ import annotations

import os
import signal
import sys
import threading
import time
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Any, Protocol

from tussle.batch.stack import BEAT_EVERY, play, stack_size
from tussle.batch.tasks import Beat, Finished, Package, Run
from tussle.errors import BatchError, ParameterError
from tussle.mission import Mission

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess


OVERDUE = "it took longer"
"""How the error of a run begins that was given up."""


class Executor(Protocol):
    """Plays runs, in any order."""

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs, each once; closing the iterator stops all that is under way."""


class Waiting:
    """Runs that nobody plays yet, by group."""

    def __init__(self, runs: Iterable[Run]) -> None:
        self.groups: dict[int, deque[Run]] = {}
        for run in runs:
            self.groups.setdefault(run.group, deque()).append(run)
        self.alone: deque[Run] = deque()

    def __len__(self) -> int:
        return len(self.alone) + sum(map(len, self.groups.values()))

    def largest(self) -> int | None:
        """The group with most runs left; None when there are none."""
        return max(self.groups, key=lambda group: len(self.groups[group]), default=None)

    def take(self, group: int, n: int) -> list[Run]:
        """Up to n runs of a group."""
        left = self.groups.get(group, deque())
        taken = [left.popleft() for _ in range(min(n, len(left)))]
        if not left:
            self.groups.pop(group, None)
        return taken


def even_size(size: int, n_runs: int, n_processes: int) -> int:
    """A stack no larger than `size` with which all processes are busy until the end, where games take equally long."""
    rounds = max(1, -(-n_runs // (size * n_processes)))
    return max(1, -(-n_runs // (rounds * n_processes)))


def _whole(name: str, value: Any) -> Any:
    """A number of processes or worlds, or None.

    Raises:
        ParameterError: It is no whole number >= 1.
    """
    if value is not None and (isinstance(value, bool) or not isinstance(value, int) or value < 1):
        raise ParameterError(f"{name} = {value!r} is not allowed; it takes a whole number >= 1")
    return value


class InProcess:
    """Plays in this process, or in another where runs may take only so long: nobody could stop one here.

    Args:
        stack: Worlds side by side; None chooses by the mission.
        is_replaceable: Nobody has asked for this very process, so that another one may play where that is safer.
    """

    def __init__(self, stack: int | None = None, is_replaceable: bool = False) -> None:
        self.stack = _whole("stack", stack)
        self.is_replaceable = is_replaceable

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs."""
        if package.run_timeout is not None:
            yield from Processes(1, self.stack).play(package, runs)
            return
        waiting = Waiting(runs)
        while (group := waiting.largest()) is not None:
            mission = package.mission(group)
            size = even_size(self.stack or stack_size(mission), len(waiting.groups[group]), 1)
            yield from play(mission, partial(waiting.take, group), size)


class Processes:
    """Plays in several processes of this machine.

    A process that dies takes nothing with it: its runs are played again, each alone, and one that kills its process again is recorded as
    failed. One that is overdue is killed.

    Args:
        n: How many; None is one per core.
        stack: Worlds side by side in each; None chooses by the mission.
    """

    def __init__(self, n: int | None = None, stack: int | None = None) -> None:
        self.n: int = _whole("processes", n) or n_cores()
        self.stack = _whole("stack", stack)

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs.

        Raises:
            BatchError: A process cannot play: it ends as it starts, or cannot load what is played.
        """
        from multiprocessing import connection

        waiting = Waiting(runs)
        players: list[_Player] = []
        try:
            players.extend(_Player(package, self.stack, self.n) for _ in range(min(self.n, len(runs))))
            while players:
                # Not for ever: who watches may want to stop while a plugin takes its time.
                ready = connection.wait([p.pipe for p in players], BEAT_EVERY)
                if not ready:
                    yield Beat(sum(p.under_way_part for p in players))
                for player in players:
                    if player.pipe not in ready and player.is_overdue():
                        player.process.kill()  # its pipe ends, which is dealt with in the next round
                for player in [p for p in players if p.pipe in ready]:
                    try:
                        for message in player.answer(waiting):
                            is_beat = isinstance(message, Beat)
                            yield Beat(sum(p.under_way_part for p in players)) if is_beat else message
                    except (EOFError, OSError):
                        yield from player.bury(waiting)
                        if waiting:
                            players.append(_Player(package, self.stack, self.n))
                    if player.is_done:
                        players.remove(player)
                        player.stop()
        finally:
            for player in players:
                player.stop()


def n_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


@dataclass(frozen=True)
class _Loaded:
    """What a process says before it begins with a stack: from now on the time of its runs counts."""


@dataclass(frozen=True)
class _Unplayable:
    """What a process says that cannot load a mission."""

    why: str


class _Player:
    """One process, as its parent sees it."""

    def __init__(self, package: Package, stack: int | None, n_processes: int) -> None:
        from multiprocessing import get_context

        context = get_context("spawn")
        self.package = package
        self.pipe, theirs = context.Pipe()
        self.under_way: dict[int, Run] = {}
        self.under_way_part = 0.0
        self.began: dict[int, float] = {}  # when runs did, by number, once their mission is loaded
        self.heard_at = 0.0
        self.n_worlds = 0  # most runs side by side since there was none
        self.was_overdue = False
        self.is_done = self.has_asked = False
        self.process: SpawnProcess = context.Process(
            target=_work, args=(theirs, package, stack, n_processes), daemon=True, name="tussle-batch"
        )
        try:
            with _quiet_threads(), _deaf_to_interrupts(), _without_script(package):
                self.process.start()
        except OSError as error:
            raise BatchError(f"a process that was to play cannot be started: {error}") from error
        theirs.close()

    def answer(self, waiting: Waiting) -> Iterator[Finished | Beat]:
        """Deal with one message of the process: a result to pass on, or a wish for runs.

        Raises:
            BatchError: The process cannot play.
        """
        message = self.pipe.recv()
        self.heard_at = time.monotonic()
        if isinstance(message, Finished):
            self.under_way.pop(message.number)
            self.began.pop(message.number)
            yield message
            return
        if isinstance(message, _Loaded):
            self.began = dict.fromkeys(self.under_way, self.heard_at)
            self.n_worlds = len(self.began)
            return
        if isinstance(message, Beat):
            self.under_way_part = message.under_way
            yield message
            return
        if isinstance(message, _Unplayable):
            raise BatchError(message.why)
        self.has_asked = True
        group, n = message
        runs: list[Run] = []
        n_left = 0
        if group is not None:
            runs = waiting.take(group, n)
        elif waiting.alone:
            runs = [waiting.alone.popleft()]
        elif (largest := waiting.largest()) is not None:
            n_left = len(waiting.groups[largest])
            runs = waiting.take(largest, 1)
        elif not self.under_way:
            self.is_done = True
        self.under_way |= {run.number: run for run in runs}
        if group is not None:  # else it has yet to load what these play
            self.began |= {run.number: self.heard_at for run in runs}
            self.n_worlds = max(self.n_worlds, len(self.began))
        self.pipe.send((runs, n_left))

    def is_overdue(self) -> bool:
        """Whether a run has taken longer than it may, the time of a stack shared by its worlds, or a step longer than a run may."""
        limit, now = self.package.run_timeout, time.monotonic()
        if limit is not None and self.began and not self.was_overdue:
            longest = now - min(self.began.values())
            self.was_overdue = now - self.heard_at > limit or longest > limit * self.n_worlds
        return self.was_overdue

    def bury(self, waiting: Waiting) -> Iterator[Finished]:
        """The process has died: what it was at is played again, each run alone; one that was alone has failed.

        Raises:
            BatchError: It never came to play.
        """
        self.process.join(5.0)
        self.is_done = True
        code = self.process.exitcode
        is_killed = code is not None and code < 0
        why = (
            f"signal {-code}, {signal.strsignal(-code)}"
            if code is not None and is_killed
            else f"exit code {code}"
        )
        if not self.has_asked:
            hint = (
                ""
                if is_killed
                else '; a script that plays a batch needs `if __name__ == "__main__":` around what it does'
            )
            raise BatchError(f"a process that was to play ended as it started ({why}){hint}")
        error = f"the process that played it died: {why}"
        if self.was_overdue:
            error = f"{OVERDUE} than the {self.package.run_timeout} s that a run may"
        for run in self.under_way.values():
            if run.is_alone or (self.was_overdue and self.n_worlds == 1):
                yield Finished.failed(run, error, self.package.mission(run.group).teams)
            else:
                waiting.alone.append(Run(run.number, run.group, run.seed, run.params, is_alone=True))

    def stop(self) -> None:
        """End the process, whatever it is at."""
        self.pipe.close()
        if not self.is_done:
            self.process.terminate()
        self.process.join(5.0)
        if self.process.is_alive():  # it heeds neither
            self.process.kill()
            self.process.join()


@contextmanager
def _quiet_threads() -> Iterator[None]:
    """While open, processes that are started spin on no core and share none: Numba and OpenMP read these settings when they load."""
    settings = {"OMP_WAIT_POLICY": "passive", "NUMBA_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
    before = {name: os.environ.get(name) for name in settings}
    os.environ.update(settings)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


@contextmanager
def _deaf_to_interrupts() -> Iterator[None]:
    """While open, processes that are started do not hear Ctrl-C, which reaches all of a terminal; their parent ends them."""
    from multiprocessing import resource_tracker

    if not hasattr(signal, "pthread_sigmask"):  # Windows: `_work` ignores it
        yield
        return
    resource_tracker.ensure_running()  # as it starts it makes this thread hear again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


@contextmanager
def _without_script(package: Package) -> Iterator[None]:
    """While open, processes that are started do not run the caller's script again, unless a plugin of the package is defined there."""
    script = sys.modules["__main__"]
    if not any(b"__main__" in mission for mission in package.missions):
        sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = script


# -- in the process that plays ----------------------------------------------------------------------------------------------


def _work(pipe: Connection, package: Package, stack: int | None, n_processes: int) -> None:
    """The life of a process that plays."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with_parent, daemon=True).start()

    def ask(group: int | None, n: int) -> tuple[list[Run], int]:
        _say(pipe, (group, n))
        try:
            answer: tuple[list[Run], int] = pipe.recv()
        except (EOFError, OSError):
            os._exit(1)
        return answer

    missions: dict[int, Any] = {}
    while True:
        first, n_left = ask(None, 1)
        if not first:
            return
        group, is_alone = first[0].group, first[0].is_alone
        if group not in missions:
            missions = {group: _loaded(package, group, pipe)}
        _say(pipe, _Loaded())
        size = 1 if is_alone else even_size(stack or stack_size(missions[group]), n_left, n_processes)

        def take(n: int, held: list[Run] = first, group: int = group, is_alone: bool = is_alone) -> list[Run]:
            own = [held.pop()] if held and n else []
            more = [] if is_alone or n == len(own) else ask(group, n - len(own))[0]
            return own + more

        for message in play(missions[group], take, size):
            _say(pipe, message)


def _say(pipe: Connection, message: Any) -> None:
    """Tell the parent; where it has gone there is nothing left to do."""
    try:
        pipe.send(message)
    except OSError:
        os._exit(1)


def _loaded(package: Package, group: int, pipe: Connection) -> Mission:
    """The mission of a group; what keeps it from being loaded keeps all processes from it, and is told."""
    try:
        return package.mission(group)
    except Exception as error:  # noqa: BLE001 - it is unpickled: whatever its modules and classes raise
        _say(
            pipe,
            _Unplayable(
                f"a process that was to play cannot load the mission: {type(error).__name__}: {error}; what its plugins are made of "
                "must be in a module that can be imported, or in a plugin file"
            ),
        )
        os._exit(1)


def _end_with_parent() -> None:
    """Wait for the parent's end, which may come without a word, and follow it whatever a plugin is at."""
    from multiprocessing import connection, parent_process

    parent = parent_process()
    assert parent is not None
    connection.wait([parent.sentinel])
    os._exit(1)
