"""Makes the picture of docs/planning.md: python tests/docs/planning_picture.py."""

from __future__ import annotations

import re
from pathlib import Path

import matplotlib.pyplot as plt
from matplotlib.collections import PolyCollection

DOCS = Path(__file__).resolve().parents[2] / "docs"


def main() -> None:
    """Run the first program of the page, and draw its tree and plan from above."""
    names: dict[str, object] = {}
    program = re.search(r"```python\n(.*?)```", (DOCS / "planning.md").read_text(encoding="utf-8"), re.DOTALL)
    assert program
    exec(program[1], names)
    plan = names["plan"]
    figure, axes = plt.subplots(figsize=(6.6, 5.4), layout="constrained")
    for wall in plan.problem.scene.walls:  # type: ignore[attr-defined]
        axes.add_collection(PolyCollection(wall.triangles()[:, :, :2], facecolor="0.55", edgecolor="0.55"))
    east, north, _ = plan.nodes  # type: ignore[attr-defined]
    cloud = axes.scatter(east, north, c=plan.costs, s=1.0, cmap="viridis")  # type: ignore[attr-defined]
    figure.colorbar(cloud, label="Time to get there [s]")
    axes.plot(plan.path[:, 0], plan.path[:, 1], color="tab:red", linewidth=2.0)  # type: ignore[attr-defined]
    axes.add_patch(plt.Circle((90, 10), 3, fill=False, color="tab:red"))
    axes.set(aspect="equal", xlabel="East [m]", ylabel="North [m]", xlim=(0, 100), ylim=(0, 100))
    figure.savefig(DOCS / "images" / "planning.png", dpi=110)


if __name__ == "__main__":
    main()
