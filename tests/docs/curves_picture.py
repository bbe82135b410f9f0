"""Makes the picture of training in docs/learning.md: python tests/docs/curves_picture.py NAME=FOLDER..., folders of `tussle train`."""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

IMAGE = Path(__file__).resolve().parents[2] / "docs" / "images" / "learning-curves.png"
MOST = 60
"""Means along a curve."""


def main(words: list[str]) -> None:
    """Draw the reward per decision over the decisions, one panel a task."""
    figure, axes = plt.subplots(3, 3, figsize=(10, 7.2), layout="constrained")
    for place in axes.flat[len(words) :]:
        place.set_visible(False)
    for place, word in zip(axes.flat, words, strict=False):
        name, _, folder = word.partition("=")
        curve = pd.read_csv(Path(folder) / "curve.csv")
        decisions, reward = curve["decisions"] / 1e6, curve["reward_per_decision"]
        group = np.arange(len(curve)) * MOST // max(len(curve), MOST)
        place.plot(decisions, reward, color="0.8", linewidth=0.8)
        place.plot(decisions.groupby(group).mean(), reward.groupby(group).mean())
        place.set_title(name)
        place.locator_params(nbins=5)
    figure.supxlabel("decisions [millions]", fontsize="medium")
    figure.supylabel("reward per decision; grey: of each update", fontsize="medium")
    figure.savefig(IMAGE, dpi=80)


if __name__ == "__main__":
    main(sys.argv[1:])
