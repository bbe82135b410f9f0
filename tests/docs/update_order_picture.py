"""Makes the picture of docs/batches.md and the README: python tests/docs/update_order_picture.py."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from tussle.batch.report.drawing import blank, house_style, legend_above, rule_x
from tussle.mission import read_mission, shipped_missions
from tussle.palette import NEUTRAL, PAPER, team_colours

DOCS = Path(__file__).resolve().parents[2] / "docs"
ROW = re.compile(r"^\| (published|`run\.update=\w+`) \| (\d+) \| (\d+) \| (\d+) \|$", re.MULTILINE)


def main() -> None:
    """Draw the table of games won as bars, in the colours of the teams."""
    loaded = read_mission(shipped_missions()["predator_prey_paper"][0])
    colours = team_colours(
        (b.team, loaded.viewer["entities"].get(b.name, {}).get("color")) for b in loaded.mission.blocks
    )
    rows = ROW.findall((DOCS / "batches.md").read_text(encoding="utf-8"))
    names = [re.sub(r"`run\.update=(\w+)`", r"\1", name) for name, *_ in rows]
    keepers, switchers, ties = np.array([row[1:] for row in rows], float).T / 10.0
    with house_style():
        figure, ((plot,),) = blank(1.5)
        begin, handles = np.zeros(len(rows)), []
        for name, share, colour in (
            ("keepers", keepers, colours[2]),
            ("ties", ties, NEUTRAL[0]),
            ("switchers", switchers, colours[3]),
        ):
            bars = plot.barh(names, share, left=begin, height=0.66, color=colour, edgecolor=PAPER)
            handles.append((bars[0], name))
            begin = begin + share
        plot.invert_yaxis()
        plot.set_xlim(0.0, 100.0)
        plot.set_xlabel("share of the games [%]")
        rule_x(plot)
        legend_above(figure, handles)
        figure.savefig(DOCS / "images" / "update-order.png", metadata={"Software": None})


if __name__ == "__main__":
    main()
