"""The policies that ship, in games of the paper that training did not see, beside the autonomies that they replace.

    python benchmarks/policies.py [--sizes 1000] [--first 200001] [--json FILE]

`predator_team`: games that its five predators won, drew and lost against the five pursuers. `prey_escape`: mean survival of 100 prey
[s], of `Boids` too. `--sizes` is the number of games; 1,000 take about five minutes of CPU for each row.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

import numpy as np
from statsmodels.stats.proportion import proportion_confint

from tussle import Mission, Simulation
from tussle.plugins.stock.autonomy import learned
from tussle.rl import PredatorTeam, PreyEscape, Term, alive, evaluate
from tussle.rl.flight import Policy
from tussle.stock import Learned

STACK = 50
"""Games of one stack."""


def team(n: int, first: int) -> dict[str, Any]:
    """Games of the learned team against the pursuing one."""
    given = PredatorTeam().given
    blocks = [
        block.replace(autonomy=(*block.autonomy, Learned(policy="predator_team")))
        if block.name == "switchers"
        else block
        for block in given.blocks
    ]
    mission: Mission = given.replace(blocks=blocks)
    ahead: list[float] = []
    for seed in range(first, first + n, STACK):
        with Simulation(mission, seeds=range(seed, min(seed + STACK, first + n))) as games:
            ahead += [result.scores[3] - result.scores[2] for result in games.run()]
    won, lost = sum(a > 0 for a in ahead), sum(a < 0 for a in ahead)
    low, high = proportion_confint(won, n, method="wilson")
    return {"games": n, "won": won, "drawn": n - won - lost, "lost": lost, "won_95%": [low, high]}


def prey(n: int, first: int, policy: str | None) -> dict[str, Any]:
    """Mean survival of the prey."""
    task = PreyEscape(reward={"time": Term(alive, 0.5)})
    fly = None
    if policy is not None:
        network = Policy(policy)

        def fly(obs: np.ndarray) -> np.ndarray:
            actions = np.clip(network(obs.reshape(-1, obs.shape[-1])), -1.0, 1.0)
            return actions.reshape(*obs.shape[:2], -1)

    seconds = np.concatenate(
        [
            evaluate(task, fly, min(STACK, first + n - seed), seed=seed)["time"] / 100
            for seed in range(first, first + n, STACK)
        ]
    )
    error = 1.96 * seconds.std(ddof=1) / n**0.5
    return {"games": n, "survival_s": float(seconds.mean()), "error_95%": float(error)}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--sizes", type=int, nargs="+", default=[1000])
    parser.add_argument("--first", type=int, default=200001, help="seed of the first game")
    parser.add_argument("--json", type=Path)
    options = parser.parse_args()
    folder = Path(learned.__file__).parent
    rows: dict[str, dict[str, Any]] = {}
    for n in options.sizes:
        rows[f"predator_team, {n}"] = team(n, options.first)
        rows[f"prey_escape, {n}"] = prey(n, options.first, str(folder / "prey_escape.onnx"))
        rows[f"Boids, {n}"] = prey(n, options.first, None)
    for name, row in rows.items():
        print(f"{name:22}", *(f"{key} {value}" for key, value in row.items()))
    if options.json:
        options.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
