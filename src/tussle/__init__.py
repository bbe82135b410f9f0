"""tussle: fast, deterministic simulation of thousands of robots in one 3D world."""

from typing import TYPE_CHECKING, Any

from tussle import former_names
from tussle.engine.result import WorldResult
from tussle.engine.simulation import Simulation
from tussle.errors import TussleError, nearest_name
from tussle.mission import Block, Mission, read_mission
from tussle.world.scene import Scene

if TYPE_CHECKING:
    from tussle.record import Recorder, load_run, read_table

    __version__: str

__all__ = [
    "Block",
    "Mission",
    "Recorder",
    "Scene",
    "Simulation",
    "TussleError",
    "WorldResult",
    "__version__",
    "load_run",
    "read_mission",
    "read_table",
]

former_names.install()


def __getattr__(name: str) -> Any:
    # Recording needs Arrow, which takes as long to import as the rest of tussle: it is imported on first use.
    if name in ("Recorder", "load_run", "read_table"):
        from tussle import record

        return getattr(record, name)
    # That of the installation: its lookup searches folders, which most runs do not need.
    if name == "__version__":
        from importlib import metadata

        try:
            return metadata.version("tussle")
        except metadata.PackageNotFoundError:
            return "0.0.0"
    hint = "" if name.startswith("_") else nearest_name(name, __all__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted(__all__)
