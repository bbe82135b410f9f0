"""What a Dask worker does for a batch. A worker outlives batches, and may have several threads: nothing here relies on a fresh process."""

from __future__ import annotations

import hashlib
import platform
import threading
import time
from collections.abc import Sequence
from contextlib import closing
from functools import cache
from importlib import import_module
from pathlib import Path

from tussle.batch.stack import play
from tussle.batch.tasks import Finished, Package, Run
from tussle.mission.plugin_files import PREFIX
from tussle.record.run_file import versions

TOPIC = "tussle-batch"
"""Under which workers tell how far they are."""
SOURCE = "source of "
"""Begins the names of hashes in `about`."""
BEAT_EVERY = 1.0  # [s]; hundreds of workers tell it to one scheduler

_playing = threading.Lock()
"""One stack at a time in a process: plugins need not be safe between threads, and the CPU time of a run is that of its process."""


def about(packages: tuple[str, ...] = ()) -> dict[str, str]:
    """What results depend on, of this process: versions, and hashes of the source of tussle and of packages that bring plugins.

    Args:
        packages: Their names.
    """
    found = versions()
    found["python"] = ".".join(platform.python_version_tuple()[:2])
    told = {name: found[name] for name in ("tussle", "numpy", "numba", "python")}
    return told | {f"{SOURCE}{name}": _source(name) for name in ("tussle", *packages)}


def packages_of(package: Package) -> tuple[str, ...]:
    """Packages besides tussle that bring plugins of these missions; those of plugin files travel with it."""
    missions = [package.mission(group) for group in range(len(package.missions))]
    plugins = [
        p for m in missions for p in (*m.world_plugins, *(p for block in m.blocks for p in block.plugins))
    ]
    modules = {type(plugin).__module__ for plugin in plugins}
    found = {module.split(".")[0] for module in modules} - {"tussle", "__main__"}
    return tuple(sorted(name for name in found if not name.startswith(PREFIX)))


@cache
def _source(name: str) -> str:
    """Hash of the code of a package: between two releases its version says little."""
    module = import_module(name)
    folders = [Path(folder) for folder in getattr(module, "__path__", ())]
    file = getattr(module, "__file__", None)
    files = [(path, folder) for folder in folders for path in folder.rglob("*.py")]
    files += [(Path(file), Path(file).parent)] if file and not folders else []
    digest = hashlib.blake2b(digest_size=8)
    for path, folder in sorted(files):
        digest.update(str(path.relative_to(folder)).encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def keep(package: Package) -> Package:
    """The package itself; Dask keeps what a task gives, hands it from worker to worker, and makes it anew where it was lost."""
    return package


def play_chunk(package: Package, runs: Sequence[Run], key: str) -> list[Finished]:
    """Play runs of one group side by side.

    Args:
        package: What the group plays, its only mission.
        runs: The runs.
        key: Name of this task.

    Returns:
        What came of them, in the order in which they ended; only some where nobody waits for them any more.
    """
    from distributed import get_worker

    worker = get_worker()
    held, finished = list(runs), list[Finished]()

    def take(n: int) -> list[Run]:
        taken, held[:] = held[:n], held[n:]
        return taken

    with _playing:
        beat_at = time.monotonic() + BEAT_EVERY
        with closing(play(package.mission(0), take, len(runs))) as messages:  # type: ignore[type-var]
            for message in messages:
                task = worker.state.tasks.get(key)
                if task is None or task.state == "cancelled":  # a thread cannot be ended from outside
                    break
                if isinstance(message, Finished):
                    finished.append(message)
                elif time.monotonic() >= beat_at:
                    beat_at = time.monotonic() + BEAT_EVERY
                    worker.log_event(TOPIC, [key, len(finished) + message.under_way])
    return finished
