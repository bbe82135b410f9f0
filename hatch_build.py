"""Compiles the kernels of the missions that ship, which a wheel brings along, so that the first game begins at once.

They are compiled for each level of processor in TUSSLE_WHEEL_LEVELS that this processor can run, by default its own, and fit the
versions of Python, NumPy and Numba that compile them. With other versions, and for other missions, kernels are compiled on the first run,
as without them.
TUSSLE_WHEEL_LEVELS= (empty) leaves them out.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

LEVELS = "TUSSLE_WHEEL_LEVELS"
MISSIONS = ("predator_prey",)
"""Those of the first hour. Each further one makes the installation from source longer."""
OWN_LEVELS = "from tussle.numeric import processor; print(*processor.levels())"
PLAY = """
import sys
from tussle import Simulation
from tussle.numeric import processor
processor.choose(sys.argv[2])
from tussle.mission.xml import read_mission
Simulation(read_mission(sys.argv[1]).mission).run()
"""


class KernelsHook(BuildHookInterface):
    """Adds compiled kernels to a wheel. An editable installation has none: its code changes."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile, and tell the wheel's files and tag."""
        if version == "editable":
            return
        self._folder = Path(tempfile.mkdtemp(prefix="tussle-kernels-"))
        try:
            own = self._python(OWN_LEVELS).split()
            for level in os.environ[LEVELS].split() if LEVELS in os.environ else own[:1]:
                if level not in own:
                    self.app.display_warning(
                        f"the wheel brings no kernels for {level} along, which this processor cannot run"
                    )
                    continue
                for mission in MISSIONS:
                    self._python(PLAY, mission, level)
        except RuntimeError as error:
            self.app.display_warning(f"the wheel brings no kernels along: {error}")
            return
        kernels = sorted(self._folder.glob("*.kernel"))
        build_data["force_include"] |= {str(k): f"tussle/numeric/shipped/{k.name}" for k in kernels}
        if kernels:
            build_data["pure_python"], build_data["infer_tag"] = False, True

    def finalize(self, *_: Any) -> None:
        """Remove what was compiled."""
        if folder := getattr(self, "_folder", None):
            shutil.rmtree(folder)

    def _python(self, code: str, *arguments: str) -> str:
        """Run code with the package of the source tree; returns what it prints.

        Raises:
            RuntimeError: It fails.
        """
        # Not by PYTHONPATH: the isolation of pip would take the source tree out where tussle is installed in editable form.
        path = [str(Path(self.root) / "src"), *filter(None, sys.path)]
        command = [
            sys.executable,
            "-S",
            "-E",
            "-B",
            "-c",
            f"import sys; sys.path[:0] = {path!r}\n{code}",
            *arguments,
        ]
        env = {**os.environ, "TUSSLE_CACHE_DIR": str(self._folder)}
        done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(done.stderr[-2000:])
        return done.stdout
