"""Recording of runs: the run directory, its loading, the state hash, and first states for another run.

Modules that need Arrow are imported on first use, so that a simulation without recording does not load it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tussle.record.events import Events
from tussle.record.state_hash import hash_columns

if TYPE_CHECKING:
    from tussle.record.first_states import FirstStates, read_table
    from tussle.record.input_table import load_inputs
    from tussle.record.inputs import ExternalInput, given_by
    from tussle.record.recorder import Recorder
    from tussle.record.run import Run, load_run

__all__ = [
    "Events",
    "ExternalInput",
    "FirstStates",
    "Recorder",
    "Run",
    "given_by",
    "hash_columns",
    "load_inputs",
    "load_run",
    "read_table",
]

_LAZY = {
    "FirstStates": "first_states",
    "ExternalInput": "inputs",
    "Recorder": "recorder",
    "Run": "run",
    "given_by": "inputs",
    "load_inputs": "input_table",
    "load_run": "run",
    "read_table": "first_states",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)


def __dir__() -> list[str]:
    return sorted(__all__)
