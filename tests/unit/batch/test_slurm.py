"""What is asked of Slurm, as far as that needs none; tests/cluster asks a real one."""

import sys
from importlib.util import find_spec

import pytest

from tussle.batch.slurm import Jobs, executor_for, on_slurm
from tussle.errors import BatchError, MissingExtraError, ParameterError

needs_jobqueue = pytest.mark.skipif(
    find_spec("dask_jobqueue") is None, reason="dask-jobqueue is not installed: pip install 'tussle[cluster]'"
)


def test_a_number_alone_asks_for_jobs_of_one_core():
    assert Jobs.parse("20") == Jobs(20)
    assert (Jobs(20).cores, Jobs(20).python) == (1, sys.executable)


def test_every_option_can_be_given_and_slurms_own_names_are_known():
    text = (
        "3, cores=8, mem=4GB, time=8:00:00, queue=short, account=me, extra=--qos=low, extra=--nice, "
        "prologue=module load python, python=python3, interface=ib0, logs=there"
    )
    assert Jobs.parse(text) == Jobs(
        3, 8, "4GB", "8:00:00", "short", "me", ("--qos=low", "--nice"), ("module load python",), "python3", "ib0", "there",
    )  # fmt: skip


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "the number of jobs"), ("0", "the number of jobs"), ("2,cores=two", "cores is 'two'"), ("2,cores", "cores has no value"),
        ("2,core=8", "did you mean 'cores'"), ("2,n=8", "there is no option 'n'"), ("2,memory=1GB,mem=2GB", "memory is there twice"),
    ],
)  # fmt: skip
def test_malformed_texts_are_refused(text, words):
    with pytest.raises(ParameterError) as error:
        Jobs.parse(text)
    assert str(error.value).startswith(f"--slurm {text!r}: ")
    assert words in str(error.value)


@needs_jobqueue
def test_without_slurm_it_says_so_in_one_line(monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BatchError, match="there is no Slurm"), executor_for(None, "2", None):
        pass


@needs_jobqueue
def test_an_impossible_memory_is_refused(monkeypatch, tmp_path):
    (tmp_path / "sbatch").touch(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ParameterError, match="memory = 'much'"), on_slurm("1,memory=much"):
        pass


def test_without_dask_jobqueue_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "dask_jobqueue.slurm", None)
    with pytest.raises(MissingExtraError, match="dask-jobqueue"), on_slurm("1"):
        pass
