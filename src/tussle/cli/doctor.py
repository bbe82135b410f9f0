"""`tussle doctor`: show the installation and run a self-test."""

from __future__ import annotations

import os
import platform
import re
import time
from importlib import metadata

import typer
from rich.table import Table

import tussle
from tussle.cli.options import Debug
from tussle.cli.pages import show
from tussle.cli.progress import compiling, home_short, times
from tussle.cli.terminal import WRONG_INPUT, put, reported, say_error
from tussle.numeric import store

SELF_TEST = "predator_prey"
SEED, STEPS = 1, 300
EXPECTED_HASH = "4092338cd3f84e5fc94d8c9e3a149b9c"
"""State hash of the self-test mission after STEPS steps, the same on every machine."""


def doctor(debug: Debug = False) -> None:
    """Show versions, extras, kernel cache and processors, and run a self-test."""
    with reported(debug):
        facts = Table.grid(padding=(0, 2))
        facts.add_row(" tussle", tussle.__version__)
        facts.add_row(" Python", f"{platform.python_version()} on {platform.platform()}")
        needed, extras = requirements()
        facts.add_row(" packages", ", ".join(f"{name} {version_of(name)}" for name in needed))
        for extra, names in extras.items():
            missing = [name for name in names if not version_of(name)]
            text = (
                f"not installed: {', '.join(missing)}; pip install 'tussle[{extra}]'"
                if missing
                else "installed"
            )
            facts.add_row(f" extra {extra}", text)
        facts.add_row(" kernels", f"kept in {home_short(store.directory())}")
        facts.add_row(" processors", str(os.cpu_count()))
        show(facts)
        with compiling():
            state_hash, speed = play()
        if state_hash != EXPECTED_HASH:
            say_error(
                f"self-test: {SELF_TEST} has the state hash {state_hash} after {STEPS} steps; expected {EXPECTED_HASH}"
            )
            raise typer.Exit(WRONG_INPUT)
        put(f" self-test passed: {SELF_TEST} at {times(speed)} × real time, with the expected hash")


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
    from tussle.cli.play import Source, simulate

    loaded, mission, _ = Source(SELF_TEST, {}, SEED).read(tells_all=False)
    with simulate(loaded, mission, SEED) as simulation:
        simulation.step()
        began = time.perf_counter()
        simulation.step(STEPS - 1)
        speed = (STEPS - 1) * mission.dt / (time.perf_counter() - began)
        return simulation.state_hash(0), speed
