"""`tussle doctor`: show the installation and run a self-test."""

from __future__ import annotations

import os
import platform
import re
import time
from importlib import metadata

from rich.text import Text

import tussle
from tussle.cli.options import MissionOptions
from tussle.cli.play import simulate
from tussle.cli.play_options import DoctorOptions
from tussle.cli.progress import compiling, home_short, times
from tussle.cli.tables import Cell, fact_list
from tussle.cli.terminal import OK, WRONG_INPUT, put, say_error
from tussle.numeric import store

SELF_TEST = "predator_prey"
SEED, STEPS = 1, 300
EXPECTED_HASH = "4092338cd3f84e5fc94d8c9e3a149b9c"
"""State hash of the self-test mission after STEPS steps, the same on every machine."""


def doctor(_: DoctorOptions) -> int:
    """Show the installation, and run the self-test.

    Returns:
        The exit code.
    """
    needed, extras = requirements()
    facts: list[tuple[str, Cell]] = [
        ("tussle", tussle.__version__),
        ("Python", f"{platform.python_version()} on {platform.platform()}"),
        ("packages", ", ".join(f"{name} {version_of(name)}" for name in needed)),
    ]
    for extra, names in extras.items():
        missing = ", ".join(name for name in names if not version_of(name))
        advice = f"not installed: {missing}; pip install 'tussle[{extra}]'"
        facts.append((f"extra {extra}", advice if missing else "installed"))
    facts += [
        ("kernels", Text(f"kept in {home_short(store.directory())}")),
        ("processors", str(os.cpu_count())),
    ]
    put(fact_list(facts))
    with compiling():
        state_hash, speed = play()
    if state_hash != EXPECTED_HASH:
        say_error(
            f"self-test: {SELF_TEST} has the state hash {state_hash} after {STEPS} steps; expected {EXPECTED_HASH}"
        )
        return WRONG_INPUT
    put("", f" self-test passed: {SELF_TEST} at {times(speed)} × real time, with the expected hash")
    return OK


def requirements() -> tuple[list[str], dict[str, list[str]]]:
    """Return the names of the required packages, and of the packages of each extra."""
    needed, extras = list[str](), dict[str, list[str]]()
    for line in metadata.requires("tussle") or ():
        name = re.match(r"[\w.-]+", line)[0]  # type: ignore[index]
        extra = re.search(r"extra == ['\"]([\w-]+)['\"]", line)
        if extra is None:
            needed.append(name)
        elif name != "tussle" and extra[1] != "test":
            extras.setdefault(extra[1], []).append(name)
    return needed, extras


def version_of(package: str) -> str:
    """Return the installed version, or "" if the package is not installed."""
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return ""


def play() -> tuple[str, float]:
    """Run the self-test; return its state hash and speed [simulated seconds per second]."""
    loaded, mission, _ = MissionOptions(mission=SELF_TEST).read()
    with simulate(loaded, mission, SEED) as simulation:
        simulation.step()
        began = time.perf_counter()
        simulation.step(STEPS - 1)
        speed = (STEPS - 1) * mission.dt / (time.perf_counter() - began)
        return simulation.state_hash(0), speed
