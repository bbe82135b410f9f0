"""Plays the examples of stock plugins by SCRIMMAGE's laws, and knows what is kept of them.

python tests/golden/historic_runs.py writes historic.json anew: only where a law is meant to have changed.

These laws use the machine's mathematics, so numbers made of all columns are kept in place of hashes, and compared within a tolerance.
"""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
from golden_runs import example_of, module_of

from tussle import Simulation
from tussle.engine.snapshot import hashed
from tussle.mission import read_mission
from tussle.plugins import historic, stock

FILE = Path(__file__).with_name("historic.json")
STEPS = 30
JSBSIM = {"controller/jsbsim_controllers", "motion/jsbsim_model"}
"""Their numbers are those of the version of JSBSim that is installed; tests/unit/jsbsim holds them to that."""


def folder_of(name: str) -> str:
    """Folder of the stock plugin whose example plays the historic plugin of this name."""
    return module_of(stock.examples()[name])


def folders() -> list[str]:
    """Folders of the examples that are played."""
    return sorted({folder_of(name) for name in historic.manifest()} - JSBSIM)


def _number(values: np.ndarray) -> float:
    """A sum of the numbers of a column with weights, relative to the largest."""
    x = np.nan_to_num(np.asarray(values, float).ravel(), nan=0.5, posinf=0.25, neginf=-0.25)
    return float((x * np.cos(1.0 + np.arange(len(x)))).sum() / (1.0 + np.abs(x).max(initial=0.0)))


def play(folder: str) -> tuple[float, set[str]]:
    """A number of all columns after the first steps of an example, and the historic classes that played."""
    loaded = read_mission(example_of(folder), compat="scrimmage")
    with warnings.catch_warnings(), Simulation(loaded.mission, seeds=1, on_error="raise") as sim:
        warnings.simplefilter("ignore")
        sim.step(STEPS)
        columns = [v for _, v in hashed(sim.state, 0) if isinstance(v, np.ndarray) and v.dtype.kind in "fiub"]
        numbers = np.array([_number(values) for values in columns])
        total = float((numbers * np.cos(1.0 + np.arange(len(numbers)))).sum())
        plugins = [b.plugin for g in sim.state.population.groups for b in g.walk()]
        plugins += [b.plugin for b in sim.state.world_bindings]
        classes = {type(p).__mro__ for p in plugins}
    played = {
        f"{c.__module__}:{c.__name__}"
        for mro in classes
        for c in mro
        if c.__module__.startswith("tussle.plugins.historic.")
    }
    return total, played


def kept() -> dict[str, float]:
    """Folder -> number."""
    return json.loads(FILE.read_text(encoding="utf-8"))


def main() -> None:
    """Play all and say what differs."""
    before = kept() if FILE.exists() else {}
    now = {folder: round(play(folder)[0], 10) for folder in folders()}
    print("changed:", ", ".join(k for k, v in now.items() if before.get(k) != v) or "nothing")
    FILE.write_text(json.dumps(now, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
