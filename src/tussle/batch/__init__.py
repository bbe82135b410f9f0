"""Many games of a mission: played on one machine or many, and what can be learnt from them."""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tussle.batch.batch import Batch
    from tussle.batch.dask_runner import OnDask
    from tussle.batch.executors import InProcess, Processes
    from tussle.batch.reload import load_batch
    from tussle.batch.results import Results
    from tussle.batch.search.optimization import optimize
    from tussle.batch.search.study import Study
    from tussle.batch.search.study_store import load_study
    from tussle.batch.slurm import on_slurm
    from tussle.batch.variables import Choice, Range

__all__ = [
    "Batch",
    "Choice",
    "InProcess",
    "OnDask",
    "Processes",
    "Range",
    "Results",
    "Study",
    "load_batch",
    "load_study",
    "on_slurm",
    "optimize",
]

_LAZY = {
    "Batch": "batch",
    "Choice": "variables",
    "InProcess": "executors",
    "OnDask": "dask_runner",
    "Processes": "executors",
    "Range": "variables",
    "Results": "results",
    "Study": "search.study",
    "load_batch": "reload",
    "load_study": "search.study_store",
    "on_slurm": "slurm",
    "optimize": "search.optimization",
}


def __getattr__(name: str) -> Any:
    # Analysing a batch does not wait for the engine, nor playing one for statistics.
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
