"""A batch as jobs of Slurm: each starts workers of one Dask cluster, whose scheduler is in this process."""

from __future__ import annotations

import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from tussle.arguments import checked, explained
from tussle.batch.dask_runner import OnDask, connect, missing_extra
from tussle.batch.executors import Executor
from tussle.documents import is_count
from tussle.errors import BatchError, ParameterError, listed, nearest_name

ALIASES = {"queue": "partition", "mem": "memory", "time": "walltime"}
TAKES = "it takes JOBS[,NAME=VALUE...], such as 20,cores=8,walltime=8:00:00,partition=short"
QUERY_PERIOD = 10.0
"""Time between two questions to Slurm [s]."""
ANSWER_TIMEOUT = 60.0
"""Time in which Slurm answers, however busy it is [s]."""
REPLACED_WITHIN = 30.0
"""Time without workers after which jobs are looked for [s]: Dask replaces a lost one within 15 s."""


@dataclass(frozen=True)
class Jobs:
    """The jobs that Slurm is asked for.

    Attributes:
        n: Number of jobs.
        cores: Of each job, which starts as many workers.
        memory: Of each core.
        walltime: Time after which Slurm ends a job; another one replaces it.
        partition: Slurm partition; "" for the default.
        account: Slurm account; "" for the default.
        extra: Further options of sbatch, such as "--qos=low".
        prologue: Lines of the job's script before the workers start, such as "module load python".
        python: Python interpreter of the workers; by default this one, which the nodes must have at the same path.
        interface: Network interface between the machines, such as "ib0"; "" chooses.
        logs: Folder for the output of jobs.
    """

    n: int
    cores: int = 1
    memory: str = "2GB"
    walltime: str = "1:00:00"
    partition: str = ""
    account: str = ""
    extra: tuple[str, ...] = ()
    prologue: tuple[str, ...] = ()
    python: str = field(default_factory=lambda: sys.executable)
    interface: str = ""
    logs: str = "slurm-logs"

    @staticmethod
    def parse(text: str) -> Jobs:
        """Read "20,cores=8,walltime=8:00:00"; `extra` and `prologue` may be there several times.

        Raises:
            ParameterError: The text is malformed.
        """
        n, *options = (part.strip() for part in text.split(","))
        values: dict[str, Any] = {"n": _count(text, "the number of jobs", n)}
        known = [f.name for f in fields(Jobs) if f.name != "n"]
        for option in options:
            name, _, value = (part.strip() for part in option.partition("="))
            name = ALIASES.get(name, name)
            if name not in known:
                wrong = f"there is no option {name!r}{nearest_name(name, known)}; {listed(known)}"
            elif not value:
                wrong = f"{name} has no value; {TAKES}"
            elif name in ("extra", "prologue"):
                values[name] = (*values.get(name, ()), value)
                continue
            elif name in values:
                wrong = f"{name} is there twice"
            else:
                values[name] = _count(text, name, value) if name == "cores" else value
                continue
            raise ParameterError(f"--slurm {text!r}: {wrong}")
        return Jobs(**values)


def _count(text: str, name: str, value: str) -> int:
    if not is_count(value) or int(value) < 1:
        raise ParameterError(f"--slurm {text!r}: {name} is {value!r}, but is a whole number >= 1; {TAKES}")
    return int(value)


@contextmanager
def executor_for(scheduler: str | None, slurm: str | None, stack: int | None) -> Iterator[Executor]:
    """The executor of `--scheduler` or `--slurm`, until the context ends.

    Args:
        scheduler: Address of a Dask scheduler.
        slurm: Text of `Jobs`.
        stack: Worlds side by side; None chooses by the mission.

    Raises:
        ParameterError: Neither is given, or both are.
        BatchError: The scheduler or Slurm does not answer.
        MissingExtraError: A package is not installed.
    """
    if (scheduler is None) == (slurm is None):
        raise ParameterError("a batch is played by a scheduler or by Slurm; give one of the two")
    if slurm is not None:
        with on_slurm(slurm, stack) as executor:
            yield executor
    elif scheduler is not None:
        with connect(scheduler) as client:
            yield OnDask(client, stack)


@explained
@checked("jobs")
@contextmanager
def on_slurm(jobs: Jobs | str, stack: int | None = None) -> Iterator[OnDask]:
    """An executor on jobs of Slurm. They are submitted here, and cancelled when the context ends.

    Args:
        jobs: The jobs, or their text.
        stack: Worlds side by side; None chooses by the mission.

    Raises:
        BatchError: Slurm is not there, or refuses such jobs.
        MissingExtraError: A package is not installed.
    """
    interrupt = signal.getsignal(signal.SIGINT)
    try:
        from dask_jobqueue.slurm import SLURMCluster
    except ImportError:
        raise missing_extra("dask-jobqueue") from None
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, interrupt)  # its import sets a handler that exits
    jobs = Jobs.parse(jobs) if isinstance(jobs, str) else jobs
    if shutil.which("sbatch") is None:
        raise BatchError("there is no Slurm on this machine: sbatch is not found; submit from a login node")
    with SLURMCluster(**_options(jobs)) as cluster:
        # dask-jobqueue submits in the background and does not report a refusal.
        asked = _slurm("sbatch", "--test-only", text=cluster.job_script())
        if asked.returncode:
            lines = (
                line.removeprefix("sbatch: ").removeprefix("error: ") for line in asked.stderr.splitlines()
            )
            raise BatchError(
                f"Slurm refuses such jobs: {'; '.join(filter(None, lines)) or 'it gives no reason'}"
            )
        # Not `scale`, which does not replace a job whose time is over.
        cluster.adapt(minimum_jobs=jobs.n, maximum_jobs=jobs.n)
        with connect(cluster.scheduler_address) as client:
            look = _job_watch(cluster, jobs)
            yield OnDask(client, stack, n_workers=jobs.n * jobs.cores, patience=None, look=look)


def _options(jobs: Jobs) -> dict[str, Any]:
    """Arguments of dask-jobqueue."""
    from dask.utils import parse_bytes

    try:
        memory = parse_bytes(jobs.memory)
    except ValueError:
        raise ParameterError(
            f"memory = {jobs.memory!r} is not allowed; it takes a size such as 2GB"
        ) from None
    return {
        "cores": jobs.cores,
        "processes": jobs.cores,
        "memory": f"{memory * jobs.cores}B",
        "walltime": jobs.walltime,
        "queue": jobs.partition or None,
        "account": jobs.account or None,
        "job_extra_directives": list(jobs.extra),
        "job_script_prologue": list(jobs.prologue),
        "python": jobs.python,
        "interface": jobs.interface or None,
        "log_directory": jobs.logs,
        "job_name": "tussle",
        "scheduler_options": {"dashboard": False, "dashboard_address": ":0"},
    }


def _slurm(*command: str, text: str = "") -> subprocess.CompletedProcess[str]:
    """The answer to one of Slurm's commands."""
    try:
        return subprocess.run(  # noqa: S603
            command, input=text, capture_output=True, text=True, check=False, timeout=ANSWER_TIMEOUT
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"it does not answer within {ANSWER_TIMEOUT:g} s")


def _job_watch(cluster: Any, jobs: Jobs) -> Callable[[float], None]:
    """A function that is called while there is no worker, with the time since there was one [s].

    It raises `BatchError` where no job waits or runs any more.
    """
    asked_at = 0.0

    def look(waited: float) -> None:
        nonlocal asked_at
        now = time.monotonic()
        if waited < REPLACED_WITHIN or now - asked_at < QUERY_PERIOD:
            return
        asked_at = now
        numbers = [job.job_id for job in cluster.workers.values() if job.job_id]
        if not numbers:
            raise BatchError("Slurm has taken no job; its limits of jobs per user may be the reason")
        listing = _slurm("squeue", "--noheader", "--format=%T", f"--jobs={','.join(numbers)}")
        is_silent = listing.returncode and "Invalid job id" not in listing.stderr
        if not listing.stdout.strip() and not is_silent:
            raise BatchError(
                f"jobs {', '.join(numbers)} of Slurm have ended, and there is no worker; {_last_line(jobs, numbers[-1])}"
            )

    return look


def _last_line(jobs: Jobs, number: str) -> str:
    """The last line of a job's output, in words."""
    path = Path(jobs.logs) / f"tussle-{number}.err"
    try:
        lines = path.read_text(errors="replace").split("\n")
    except OSError:
        return f"{path} is not there"
    last = [line.strip() for line in lines if line.strip()][-1:]
    return f"{path} ends with: {last[0]}" if last else f"{path} is empty"
