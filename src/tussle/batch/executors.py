"""Who plays the runs of a batch: this process, or several."""

from __future__ import annotations

import os
import platform
import signal
from collections import deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing import connection, get_context
from typing import TYPE_CHECKING, Any, Protocol

from tussle.batch.stack import play, stack_size
from tussle.batch.tasks import Beat, Finished, Package, Run
from tussle.errors import BatchError, ParameterError

if TYPE_CHECKING:
    from multiprocessing.connection import Connection
    from multiprocessing.context import SpawnProcess

FEW = 4
"""Runs that are worth a process: fewer are played sooner than it has started."""


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
    """Plays in this process.

    Args:
        stack: Worlds side by side; None chooses by the mission.
    """

    def __init__(self, stack: int | None = None) -> None:
        self.stack = _whole("stack", stack)

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs."""
        waiting = Waiting(runs)
        while (group := waiting.largest()) is not None:
            mission = package.mission(group)
            size = even_size(self.stack or stack_size(mission), len(waiting.groups[group]), 1)
            yield from play(mission, partial(waiting.take, group), size)


class Processes:
    """Plays in several processes of this machine.

    A process that dies takes nothing with it: its runs are played again, each alone, and one that kills its process again is recorded as
    failed.

    Args:
        n: How many; None is one per core.
        stack: Worlds side by side in each; None chooses by the mission.
    """

    def __init__(self, n: int | None = None, stack: int | None = None) -> None:
        self.n: int = _whole("processes", n) or len(os.sched_getaffinity(0))
        self.stack = _whole("stack", stack)

    def play(self, package: Package, runs: Sequence[Run]) -> Generator[Finished | Beat, None, None]:
        """What comes of the runs."""
        waiting = Waiting(runs)
        n = min(self.n, len(runs))
        players = [_Player(package, self.stack, self.n) for _ in range(n)]
        try:
            while players:
                ready = connection.wait([p.pipe for p in players])
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


class _Player:
    """One process, as its parent sees it."""

    def __init__(self, package: Package, stack: int | None, n_processes: int) -> None:
        context = get_context("spawn")
        self.pipe, theirs = context.Pipe()
        self.under_way: dict[int, Run] = {}
        self.under_way_part = 0.0
        self.is_done = self.has_asked = False
        self.process: SpawnProcess = context.Process(
            target=_work, args=(theirs, package, stack, n_processes), daemon=True, name="tussle-batch"
        )
        with _quiet_threads():
            self.process.start()
        theirs.close()

    def answer(self, waiting: Waiting) -> Iterator[Finished | Beat]:
        """Deal with one message of the process: a result to pass on, or a wish for runs."""
        message = self.pipe.recv()
        if isinstance(message, Finished):
            self.under_way.pop(message.number)
            yield message
            return
        if isinstance(message, Beat):
            self.under_way_part = message.under_way
            yield message
            return
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
        self.pipe.send((runs, n_left))

    def bury(self, waiting: Waiting) -> Iterator[Finished]:
        """The process has died: what it was at is played again, each run alone; one that was alone has failed.

        Raises:
            BatchError: It never came to play.
        """
        self.process.join(5.0)
        self.is_done = True
        code = self.process.exitcode
        why = (
            f"signal {-code}, {signal.strsignal(-code)}"
            if code is not None and code < 0
            else f"exit code {code}"
        )
        if not self.has_asked:
            raise BatchError(
                f"a process that was to play ended as it started ({why}); a script that plays a batch needs "
                f'`if __name__ == "__main__":` around what it does'
            )
        for run in self.under_way.values():
            if run.is_alone:
                error = f"the process that played it died: {why}"
                yield Finished(
                    run.number,
                    "error",
                    0.0,
                    0,
                    None,
                    "",
                    error,
                    0.0,
                    platform.node(),
                    [(None, "alive", float("nan"))],
                    [],
                )
            else:
                waiting.alone.append(Run(run.number, run.group, run.seed, run.params, is_alone=True))

    def stop(self) -> None:
        """End the process, whatever it is at."""
        self.pipe.close()
        if not self.is_done:
            self.process.terminate()
        self.process.join(5.0)


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


def _work(pipe: Connection, package: Package, stack: int | None, n_processes: int) -> None:
    """The life of a process that plays."""
    signal.signal(
        signal.SIGINT, signal.SIG_IGN
    )  # Ctrl-C reaches all processes of a terminal; the parent ends this one

    def ask(group: int | None, n: int) -> tuple[list[Run], int]:
        pipe.send((group, n))
        answer: tuple[list[Run], int] = pipe.recv()
        return answer

    missions: dict[int, Any] = {}
    with suppress(EOFError, BrokenPipeError, ConnectionResetError):  # the parent has gone
        while True:
            first, n_left = ask(None, 1)
            if not first:
                return
            group, is_alone = first[0].group, first[0].is_alone
            if group not in missions:
                missions = {group: package.mission(group)}
            size = 1 if is_alone else even_size(stack or stack_size(missions[group]), n_left, n_processes)

            def take(
                n: int, held: list[Run] = first, group: int = group, is_alone: bool = is_alone
            ) -> list[Run]:
                own = [held.pop()] if held and n else []
                more = [] if is_alone or n == len(own) else ask(group, n - len(own))[0]
                return own + more

            for message in play(missions[group], take, size):
                pipe.send(message)
