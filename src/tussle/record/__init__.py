"""What a run leaves behind: the run directory, its loading, the state hash, and first states for another run.

All that needs Arrow is loaded when it is first asked for, so that playing without recording does not wait for it.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

from tussle.record.happenings import Happenings
from tussle.record.state_hash import hash_columns

if TYPE_CHECKING:
    from tussle.record.first_states import FirstStates, read_table
    from tussle.record.recorder import Recorder
    from tussle.record.run import Run, load_run

__all__ = ["FirstStates", "Happenings", "Recorder", "Run", "hash_columns", "load_run", "read_table"]

_LAZY = {
    "FirstStates": "first_states",
    "Recorder": "recorder",
    "Run": "run",
    "load_run": "run",
    "read_table": "first_states",
}


def __getattr__(name: str) -> Any:
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_LAZY[name]}"), name)
