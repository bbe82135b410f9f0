"""Batches in jobs of a real Slurm: one node, this machine, started for the tests in a temporary folder.

It takes Debian's packages slurmctld, slurmd, slurm-client and munge, and root, so it runs only where it is asked for.
"""

import os
import shutil
import socket
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tussle.batch import Batch, InProcess
from tussle.batch.slurm import on_slurm
from tussle.batch.tasks import Finished
from tussle.errors import BatchError

pytestmark = [
    pytest.mark.skipif(
        os.environ.get("TUSSLE_TEST_SLURM") != "1",
        reason="needs root, TUSSLE_TEST_SLURM=1, and Slurm: apt-get install slurmctld slurmd slurm-client munge",
    ),
    pytest.mark.slow,
]

DAEMONS = ("munged", "slurmctld", "slurmd")
CONFIG = """
ClusterName=tussle
SlurmctldHost={name}(127.0.0.1)
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/slurmd.pid
SlurmctldPort={ports[0]}
SlurmdPort={ports[1]}
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SwitchType=switch/none
JobAcctGatherType=jobacct_gather/none
MpiDefault=none
KillWait=2
NodeName={name} NodeAddr=127.0.0.1 CPUs={cores} RealMemory={memory}
PartitionName=all Nodes={name} Default=YES MaxTime=60 State=UP
"""
HERE = "interface=lo,memory=1GB"


def free_ports(n):
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(n)]
    try:
        return [s.getsockname()[1] for s in sockets]
    finally:
        for s in sockets:
            s.close()


def config(folder):
    """Describe this machine as a cluster of one node."""
    for name in ("state", "spool"):
        (folder / name).mkdir()
    (folder / "key").write_bytes(os.urandom(1024))
    (folder / "key").chmod(0o400)
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2**20
    path = folder / "slurm.conf"
    path.write_text(
        CONFIG.format(
            name=socket.gethostname(),
            folder=folder,
            ports=free_ports(2),
            cores=os.cpu_count(),
            memory=memory * 9 // 10,
        )
    )
    return path


@pytest.fixture(scope="module")
def slurm(tmp_path_factory):
    """A Slurm that takes jobs; gives its folder."""
    missing = [name for name in DAEMONS if shutil.which(name, path=f"{os.environ['PATH']}:/usr/sbin") is None]
    assert not missing, f"{missing} are not installed"
    folder = tmp_path_factory.mktemp("slurm")
    path = config(folder)
    munge = ["--foreground", "--force", f"--key-file={folder}/key", f"--socket={folder}/munge.socket"]
    munge += [f"--pid-file={folder}/munge.pid", f"--seed-file={folder}/munge.seed"]
    with pytest.MonkeyPatch.context() as patch, (folder / "log").open("w") as log:
        patch.setenv("PATH", f"{os.environ['PATH']}:/usr/sbin")
        patch.setenv("SLURM_CONF", str(path))
        patch.chdir(folder)
        commands = [["munged", *munge], ["slurmctld", "-D", "-f", path], ["slurmd", "-D", "-f", path]]
        daemons = [subprocess.Popen(command, stdout=log, stderr=log) for command in commands]
        try:
            end = time.monotonic() + 300.0
            while said("sinfo", "--noheader", "--format=%T") != "idle":
                assert time.monotonic() < end, (folder / "log").read_text()
                time.sleep(0.2)
            yield folder
        finally:
            for daemon in reversed(daemons):
                daemon.terminate()
                daemon.wait()


def said(*command):
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.strip()


def jobs():
    """Numbers of the jobs that wait or run."""
    return said("squeue", "--noheader", "--format=%i", "--states=PENDING,RUNNING").split()


def batch(runs=20, **settings):
    settings = {"end": "10", "prey": "10"} | settings
    return Batch(
        "predator_prey", runs=runs, settings=settings, vary=["prey=5,10", "prey.Boids.max_speed=20,30"]
    )


def rows(results):
    return [*results.table.drop_columns(["cpu_s", "host"]).to_pylist(), *results.alive.to_pylist()]


@pytest.mark.parametrize("spec", ["2", "1,cores=2"])
def test_rows_are_those_of_one_process_and_no_job_is_left(slurm, spec):
    with on_slurm(f"{spec},{HERE}") as executor:
        results = batch().play(None, executor)
        assert jobs()
    assert rows(results) == rows(batch().play(None, InProcess()))
    end = time.monotonic() + 300.0
    while jobs() and time.monotonic() < end:
        time.sleep(0.5)
    assert not jobs()


def test_a_job_that_is_ended_is_replaced_and_its_runs_are_played_again(slurm):
    long = batch(runs=30, end="100", prey="30")
    numbers, cancelled = [], []
    with on_slurm(f"1,{HERE}", stack=10) as executor:
        for message in executor.play(long.package, [long.run(i) for i in range(120)]):
            if isinstance(message, Finished):
                numbers.append(message.number)
                if not cancelled:
                    cancelled = jobs()
                    assert cancelled
                    subprocess.run(["scancel", *cancelled], check=True)
    assert sorted(numbers) == list(range(120))


def test_what_slurm_refuses_is_told_in_one_line(slurm):
    match = "^Slurm refuses such jobs: invalid partition specified: nowhere; .*$"
    with pytest.raises(BatchError, match=match), on_slurm(f"1,partition=nowhere,{HERE}"):
        pass


def test_jobs_that_end_at_once_are_told_with_what_they_said(slurm):
    spec = f"1,python=/no/such/python,{HERE}"
    match = r"^jobs \d+ of Slurm have ended, and there is no worker; slurm-logs/tussle-\d+.err ends with: .*No such file"
    with on_slurm(spec) as executor, pytest.raises(BatchError, match=match):
        batch(1).play(None, executor)


def test_the_command_line_plays_in_slurm(slurm, tmp_path):
    command = [sys.executable, "-m", "tussle.cli", "batch", "predator_prey", "end=10", "prey=10", "-n", "20"]
    run = subprocess.run(
        [*command, "--slurm", f"2,{HERE}", "--out", tmp_path / "b"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    assert (tmp_path / "b" / "results.parquet").exists()
    assert "Traceback" not in run.stderr
    assert Path("slurm-logs").is_dir()
