"""What the page says of a game: its mission, times, teams and plugins."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from tussle.declare.displays import counted, shortened
from tussle.record.event_texts import end_text

MAX_BLOCKS = 20
"""Blocks that are listed."""
MAX_LENGTH = 400
"""Largest number of characters in the list of a block's plugins."""
Fact = tuple[str, str]


def mission_facts(mission: Mapping[str, Any], teams: Mapping[int, str]) -> list[Fact]:
    """Return names and values of what a mission is.

    Args:
        mission: The mission as `run.json` has it, see `tussle.record.run_file.mission_entry`.
        teams: Number and name of each team.
    """
    facts = [("Mission", str(mission["name"]) or "–"), ("Step", f"{mission['dt']:g} s")]
    if end := _end(mission):
        facts.append(("End", end))
    blocks = mission["blocks"]
    for team, name in teams.items():
        n = sum(block.get("count") or 0 for block in blocks if block["team"] == team)
        facts.append((f"Team {team}", f"{name}: {counted(n, 'entity', 'entities')}" if n else name))
    facts += [(f"Plugins of {block['name']}", _plugins(block["plugins"])) for block in blocks[:MAX_BLOCKS]]
    if len(blocks) > MAX_BLOCKS:
        facts.append(("Plugins", f"of {counted(len(blocks) - MAX_BLOCKS, 'more block')} are not listed"))
    if world := mission.get("world_plugins"):
        facts.append(("Plugins of the world", _plugins(world)))
    return facts


def _plugins(texts: Iterable[str]) -> str:
    return shortened(", ".join(text.partition("(")[0] for text in texts), MAX_LENGTH)


def _end(mission: Mapping[str, Any]) -> str:
    """What ends the game: "500 s, one team is left"."""
    end = float(mission.get("end") or math.inf)
    conditions = mission.get("end_conditions") or ()
    parts = [
        f"{end:g} s" if c == "time" else end_text(c) for c in conditions if c != "time" or math.isfinite(end)
    ]
    return ", or ".join(parts)
