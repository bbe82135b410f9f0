"""Aircraft of JSBSim in several processes."""

from __future__ import annotations

import itertools
import os
import pickle
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Any, BinaryIO, cast

import numpy as np

from tussle.plugins.stock.motion.jsbsim_model.fleet import NOWHERE, Fleet, Flown
from tussle.plugins.stock.motion.jsbsim_model.flight import Aircraft, SavedFlight
from tussle.world.geodesy import Origin

LOST = "the process that flew it has ended; a reset, or the restoration of a snapshot, starts another one"


def n_cores() -> int:
    """Number of cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


class FleetProcesses:
    """Aircraft by number, as in `Fleet`, in processes: JSBSim keeps the interpreter's lock, so that threads would not help.

    Each process gets one message a step, with the commands of all its aircraft, and answers with their states. It ends where its input
    ends, so that none outlives this process. If a process dies, its aircraft fail; after an exception in a call, such as Ctrl-C, all do.

    Args:
        n: The largest number of processes; each starts when it gets its first aircraft.
    """

    def __init__(self, n: int) -> None:
        self.n = n
        self.numbers = itertools.count()
        self.processes: list[FleetProcess] = []
        self.process_of: dict[int, FleetProcess] = {}

    def open(self, number: int, aircraft: Aircraft, dt: float) -> None:
        """Load an aircraft that makes steps of dt [s]; errors are in the results of the next call."""
        self._send_new(number, "open", aircraft, dt)

    def load(self, number: int, saved: SavedFlight) -> None:
        """Repeat a flight; errors are in the results of the next call."""
        self._send_new(number, "load", saved)

    def close(self, number: int) -> None:
        """Release an aircraft."""
        process = self.process_of.pop(number, None)
        if process is not None:
            with self._ended_on_error():
                process.n_flights -= 1
                process.send("close", number)

    def save(self, number: int) -> SavedFlight | tuple[()]:
        """Return the record of an aircraft's flight; empty if it has failed or its process has ended."""
        process = self.process_of.get(number)
        if process is None:
            return ()
        with self._ended_on_error():
            process.send("save", number)
            try:
                return cast(SavedFlight, process.receive())
            except (EOFError, OSError):
                self._forget(process)
                return ()

    def place(self, numbers: Sequence[int], places: np.ndarray, origin: Origin) -> Flown:
        """Set the states of some aircraft; places are as in `JSBSimFlight.place`, (m, 17)."""
        return self._call("place", numbers, places, origin)

    def fly(self, numbers: Sequence[int], commands: np.ndarray, n_steps: int) -> Flown:
        """Make some steps of some aircraft with these commands, (m, k)."""
        return self._call("fly", numbers, commands, n_steps)

    def end(self) -> None:
        """End the processes, before the simulation ends or after an exception."""
        self.process_of.clear()
        while self.processes:
            self.processes.pop().end()

    def _send_new(self, number: int, call: str, *values: Any) -> None:
        with self._ended_on_error():
            if len(self.processes) < self.n:
                self.processes.append(FleetProcess())
            process = min(self.processes, key=lambda each: each.n_flights)
            self.process_of[number] = process
            process.n_flights += 1
            process.send(call, number, *values)

    def _call(self, call: str, numbers: Sequence[int], values: np.ndarray, *more: Any) -> Flown:
        parts: dict[FleetProcess, list[int]] = {}
        lost: list[int] = []
        for k, number in enumerate(numbers):
            process = self.process_of.get(number)
            (lost if process is None else parts.setdefault(process, [])).append(k)
        read, errors = np.empty((len(numbers), len(NOWHERE))), dict[int, str]()
        with self._ended_on_error():
            for process, mine in parts.items():
                process.send(call, [numbers[k] for k in mine], values[mine], *more)
            for process, mine in parts.items():
                try:
                    read[mine], failed = process.receive()
                    errors |= failed
                except (EOFError, OSError):
                    self._forget(process)
                    lost += mine
        read[lost] = NOWHERE
        return read, errors | {numbers[k]: LOST for k in lost}

    def _forget(self, process: FleetProcess) -> None:
        """Drop a process that has died."""
        self.processes.remove(process)
        self.process_of = {number: each for number, each in self.process_of.items() if each is not process}
        process.end()

    @contextmanager
    def _ended_on_error(self) -> Iterator[None]:
        """End all processes on an exception; otherwise a pending answer would be taken for the answer to the next call."""
        try:
            yield
        except BaseException:
            self.end()
            raise


class FleetProcess:
    """A process with a `Fleet`. It imports nothing of the caller's script, and Ctrl-C does not reach it."""

    def __init__(self) -> None:
        code = f"from {__name__} import serve; serve()"
        self.n_flights = 0
        self.process = subprocess.Popen(  # noqa: S603 - the command is this Python and the text above
            [sys.executable, "-P", "-c", code],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | {"PYTHONPATH": os.pathsep.join(path for path in sys.path if path)},
            start_new_session=True,
            creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
        )
        assert self.process.stdin is not None
        assert self.process.stdout is not None
        self.input, self.output = self.process.stdin, self.process.stdout

    def send(self, call: str, *values: Any) -> None:
        """Send the name of a method of `Fleet` and its arguments."""
        with suppress(OSError):  # the process has died; `receive` raises
            pickle.dump((call, values), self.input, pickle.HIGHEST_PROTOCOL)
            self.input.flush()

    def receive(self) -> Any:
        """Return the result of a method.

        Raises:
            EOFError, OSError: The process has died.
        """
        try:
            return pickle.load(self.output)  # noqa: S301 - written by `serve`
        except pickle.UnpicklingError:
            raise EOFError from None  # it died while it wrote

    def end(self) -> None:
        """End the process."""
        with suppress(OSError):
            self.input.close()
        self.process.kill()
        self.process.wait()
        self.output.close()


def serve() -> None:
    """Main function of a fleet's process: call methods of a fleet until the input ends."""
    # Output that JSBSim or a library prints must not mix with the results.
    results: BinaryIO = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    fleet = Fleet()
    with suppress(EOFError, BrokenPipeError):  # the simulation has ended
        while True:
            call, values = pickle.load(sys.stdin.buffer)  # noqa: S301 - written by `FleetProcess.send`
            result = getattr(fleet, call)(*values)
            if result is not None:
                pickle.dump(result, results, pickle.HIGHEST_PROTOCOL)
                results.flush()
