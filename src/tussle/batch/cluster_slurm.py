"""A batch as jobs of Slurm: each starts workers of one Dask cluster, whose scheduler is in this process."""

from __future__ import annotations

import dataclasses
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from tussle.batch.cluster import OnDask, connect, missing_extra
from tussle.batch.executors import Executor
from tussle.documents import size_of
from tussle.errors import BatchError, ParameterError, listed, nearest_name

ALIASES = {"queue": "partition", "mem": "memory", "time": "walltime"}
TAKES = "it takes JOBS[,NAME=VALUE...], such as 20,cores=8,walltime=8:00:00,partition=short"
ASK_EVERY = 10.0
"""Time between two questions to Slurm [s]."""
ANSWERED_WITHIN = 60.0
"""Time in which Slurm answers, however busy it is [s]."""
REPLACED_WITHIN = 30.0
"""Time without workers after which jobs are looked for [s]: Dask replaces one 15 s after it has seen its worker go."""


END_OF_LOG = 1 << 16
"""Bytes of what a job has printed that are looked at for its last line."""


@dataclass(frozen=True)
class Jobs:
    """What is asked of Slurm.

    Attributes:
        n: How many jobs.
        cores: Of each job; it plays in as many processes.
        memory: Of each core.
        walltime: After which Slurm ends a job; another takes its place.
        partition: Where they queue; "" is Slurm's default.
        account: What they are charged to; "" is Slurm's default.
        extra: Further options of sbatch, such as "--qos=low".
        prologue: Lines of the job's script before the workers start, such as "module load python".
        python: What plays; by default this Python, which the nodes must have at the same path.
        interface: Network interface over which the machines talk, such as "ib0"; "" chooses.
        logs: Folder for what jobs print.
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
        """Read "20,cores=8,walltime=8:00:00"; `extra` and `prologue` may stand several times.

        Raises:
            ParameterError: It is written otherwise.
        """
        n, *options = (part.strip() for part in text.split(","))
        values: dict[str, Any] = {"n": _count(text, "the number of jobs", n)}
        fields = {f.name: f for f in dataclasses.fields(Jobs)}
        known = [name for name in fields if name != "n"]
        for option in options:
            name, _, value = (part.strip() for part in option.partition("="))
            name = ALIASES.get(name, name)
            if not value:
                raise ParameterError(f"--slurm {text!r}: {name} has no value; {TAKES}")
            if name not in known:
                raise ParameterError(
                    f"--slurm {text!r}: there is no option {name!r}{nearest_name(name, known)}; {listed(known)}"
                )
            if name in ("extra", "prologue"):
                values[name] = (*values.get(name, ()), value)
            elif name in values:
                raise ParameterError(f"--slurm {text!r}: {name} stands twice")
            else:
                values[name] = _count(text, name, value) if name == "cores" else value
        return Jobs(**values)


def _count(text: str, name: str, value: str) -> int:
    if not value.isdigit() or int(value) < 1:
        raise ParameterError(f"--slurm {text!r}: {name} is {value!r}, but is a whole number >= 1; {TAKES}")
    return int(value)


@contextmanager
def executor_for(scheduler: str | None, slurm: str | None, stack: int | None) -> Iterator[Executor]:
    """Who plays where the command line names another place; it is left when the context ends.

    Args:
        scheduler: Address of a Dask scheduler.
        slurm: What to ask of Slurm, see `Jobs`.
        stack: Worlds side by side; None chooses by the mission.

    Raises:
        ParameterError: Neither is named, or both are.
        BatchError: Nobody answers there.
        MissingExtraError: A package is not installed.
    """
    if (scheduler is None) == (slurm is None):
        raise ParameterError("a batch is played by a scheduler or by Slurm; give one of the two")
    if slurm is not None:
        with on_slurm(Jobs.parse(slurm), stack) as executor:
            yield executor
    else:
        assert scheduler is not None
        with connect(scheduler) as client:
            yield OnDask(client, stack)


@contextmanager
def on_slurm(jobs: Jobs | str, stack: int | None = None) -> Iterator[OnDask]:
    """Who plays in jobs of Slurm; they are submitted here, and cancelled when the context ends.

    Args:
        jobs: What is asked of Slurm, or its text.
        stack: Worlds side by side; None chooses by the mission.

    Raises:
        BatchError: Slurm is not there, or refuses such jobs.
        MissingExtraError: A package is not installed.
    """
    try:
        from dask_jobqueue.slurm import SLURMCluster
    except ImportError:
        raise missing_extra("dask-jobqueue") from None
    jobs = Jobs.parse(jobs) if isinstance(jobs, str) else jobs
    if shutil.which("sbatch") is None:
        raise BatchError("there is no Slurm on this machine: sbatch is not found; submit from a login node")
    with SLURMCluster(**_options(jobs)) as cluster:
        _check(cluster.job_script())
        # Not `scale`: a job whose time is over is to be replaced.
        cluster.adapt(minimum_jobs=jobs.n, maximum_jobs=jobs.n)
        with connect(cluster.scheduler_address) as client:
            look = _Look(cluster, jobs)
            yield OnDask(client, stack, n_workers=jobs.n * jobs.cores, patience=None, look=look)


def _options(jobs: Jobs) -> dict[str, Any]:
    """What dask-jobqueue takes."""
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


def _check(script: str) -> None:
    """Ask Slurm whether it would take such a job: dask-jobqueue submits in the background and says nothing where that fails.

    Raises:
        BatchError: It would not.
    """
    asked = _slurm("sbatch", "--test-only", text=script)
    if asked.returncode:
        raise BatchError(f"Slurm refuses such jobs: {_said(asked.stderr)}")


def _slurm(*command: str, text: str = "") -> subprocess.CompletedProcess[str]:
    """What one of Slurm's own commands says."""
    try:
        return subprocess.run(  # noqa: S603
            command, input=text, capture_output=True, text=True, check=False, timeout=ANSWERED_WITHIN
        )
    except subprocess.TimeoutExpired:
        return subprocess.CompletedProcess(command, 1, "", f"it does not answer within {ANSWERED_WITHIN:g} s")


def _said(text: str) -> str:
    """What a command has said, in one line."""
    lines = (line.removeprefix("sbatch: ").removeprefix("error: ") for line in text.splitlines())
    return "; ".join(line for line in lines if line) or "it does not say why"


class _Look:
    """Sees, while there is no worker, whether one can still come.

    Args:
        cluster: Whose jobs are meant.
        jobs: What was asked for.
    """

    def __init__(self, cluster: Any, jobs: Jobs) -> None:
        self.cluster, self.jobs = cluster, jobs
        self.asked_at = 0.0

    def __call__(self, waited: float) -> None:
        """Look.

        Args:
            waited: How long there has been no worker [s].

        Raises:
            BatchError: No job is waiting or running any more.
        """
        now = time.monotonic()
        if waited < REPLACED_WITHIN or now - self.asked_at < ASK_EVERY:
            return
        self.asked_at = now
        numbers = [job.job_id for job in self.cluster.workers.values() if job.job_id]
        if not numbers:
            raise BatchError("Slurm has taken no job; its limits of jobs per user may be why")
        listing = _slurm("squeue", "--noheader", "--format=%T", f"--jobs={','.join(numbers)}")
        is_silent = (
            listing.returncode and "Invalid job id" not in listing.stderr
        )  # Slurm itself does not answer
        if listing.stdout.strip() or is_silent:
            return
        raise BatchError(
            f"jobs {', '.join(numbers)} of Slurm have ended, and there is no worker; {self._log(numbers[-1])}"
        )

    def _log(self, number: str) -> str:
        """The last that a job has said."""
        path = Path(self.jobs.logs) / f"tussle-{number}.err"
        try:
            size = size_of(path)
            with path.open("rb") as file:
                file.seek(max(0, size - END_OF_LOG))
                lines = file.read(END_OF_LOG).decode(errors="replace").splitlines()
        except OSError:
            return f"{path} is not there"
        last = [line.strip() for line in lines if line.strip()][-1:]
        return f"{path} ends with: {last[0]}" if last else f"{path} is empty"
