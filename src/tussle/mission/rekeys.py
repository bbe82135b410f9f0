"""Changes of the random key during a game: from a step on, a world draws with another key.

A game is its mission, its seed and its re-keys. One with other re-keys from step k on is a branch: the same game up to the state at the
start of step k, and then other luck. A re-key with a target is for some draws only: those of a block, an entity, a plugin or a label.
If several re-keys apply to one draw, the last one is used. A re-key without a target ends all re-keys before it.

The target left/2/birth is for what is drawn before step 0: where the entity starts, and what its plugins draw as it is born.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

import numpy as np

from tussle.declare.texts import shown
from tussle.errors import MissionError, clipped, listed, nearest_name

Rekey = tuple[int, int] | tuple[int, int, str]
Rekeys = tuple[Rekey, ...]
"""(step, key) or (step, key, target) of each change, in order of the steps and, at one step, of the targets."""

PAIR = re.compile(r"(\d{1,10}):(\d{1,20})(?::([^\s:]{1,2000}))?", re.ASCII)
MAX_STEP, MAX_KEY = 2**32 - 1, 2**64 - 1
TAKES = (
    "it takes pairs of a step and a key, as 120:77 340:8, with steps that ascend, below 2^32, and keys below 2^64; "
    "a target behind them, as in 120:77:left/2, says whose draws alone have the key"
)
BIRTH = "birth"
"""In place of a plugin, in a re-key of step 0: what is drawn for entities as the game begins."""
TARGET = "a target is a world plugin, a block, or BLOCK/NUMBER/PLUGIN/LABEL, of which what is not meant is left empty or out"


class RekeyTarget(NamedTuple):
    """Whose draws a re-key is for.

    Attributes:
        owner: A block, or a world plugin.
        number: An entity of the block, from 1; 0 for all.
        plugin: Instance name of a plugin; "" for all that draw for these entities; or `BIRTH`.
        label: A label of its draws; "" for all.
    """

    owner: str
    number: int = 0
    plugin: str = ""
    label: str = ""

    @classmethod
    def parse(cls, text: str) -> RekeyTarget:
        """Read "left", "left/2", "left//Hover/gust"; parts are quoted as in a URL.

        Raises:
            MissionError: It is no target.
        """
        owner, number, plugin, label, *more = [*map(unquote, text.split("/")), *[""] * 3][
            : max(4, text.count("/") + 1)
        ]
        if not owner or more or not re.fullmatch(r"\d{0,9}", number, re.ASCII):
            raise MissionError(f"target {shown(text)} of a re-key is not allowed; {TARGET}")
        return cls(owner, int(number or 0), plugin, label)

    def __str__(self) -> str:
        parts = self.owner, str(self.number or ""), self.plugin, self.label
        return "/".join(quote(part, safe="") for part in parts).rstrip("/")


def checked_rekeys(value: Any) -> Rekeys:
    """Re-keys as a tuple of pairs of whole numbers, some with a target.

    Raises:
        MissionError: They are not in order of their steps, or a number or target is not allowed.
    """
    try:
        rekeys: Rekeys = tuple(
            (_whole(step), _whole(key), *map(_target, target))  # type: ignore[misc]
            for step, key, *target in value
        )
    except MissionError:
        raise
    except (TypeError, ValueError):
        raise MissionError(f"rekeys = {value!r:.80} is not allowed; {TAKES}") from None
    order = [(each[0], *each[2:]) for each in rekeys]
    is_wrong = order != sorted(set(order)) or any(len(place) > 2 for place in order)
    if is_wrong or not all(0 <= each[0] <= MAX_STEP and 0 <= each[1] <= MAX_KEY for each in rekeys):
        raise MissionError(f"rekeys = {value!r:.80} is not allowed; {TAKES}")
    return rekeys


def _target(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError
    return str(RekeyTarget.parse(value))


def check_targets(rekeys: Rekeys, blocks: Mapping[str, Sequence[str]], world_plugins: Sequence[str]) -> None:
    """Check that the targets of re-keys exist. Labels are known only where they are drawn.

    Args:
        rekeys: The re-keys.
        blocks: Block -> names of its plugins.
        world_plugins: Names of the world plugins.

    Raises:
        MissionError: There is no such block or plugin.
    """
    for step, _, *texts in rekeys:
        for owner, number, plugin, _ in map(RekeyTarget.parse, texts):
            known: Sequence[str] = [*blocks, *world_plugins]
            wrong = owner
            if owner in blocks:
                known, wrong = ["", *([] if step else [BIRTH]), *blocks[owner], *world_plugins], plugin
            elif owner in known and (number or plugin not in ("", owner)):
                raise MissionError(
                    f"rekeys: {clipped(owner)} is a world plugin, of which there are no entities; {TARGET}"
                )
            if wrong not in known:
                names = [name for name in known if name]
                raise MissionError(
                    f"rekeys: there is no block or plugin {clipped(wrong)!r}{nearest_name(wrong, names)}; {listed(names)}"
                )


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError
    return int(value)


def parse_rekeys(text: str) -> Rekeys:
    """Parse a text such as "120:77 340:8 340:9:left/2".

    Raises:
        MissionError: It is written otherwise, or a number is not allowed.
    """
    pairs = [PAIR.fullmatch(word) for word in text.split()]
    if not pairs or None in pairs:
        raise MissionError(f"rekeys {shown(text)} are not allowed; {TAKES}")
    return checked_rekeys(
        [(int(pair[1]), int(pair[2]), *([pair[3]] if pair[3] else [])) for pair in pairs if pair]
    )


def rekeys_text(rekeys: Rekeys) -> str:
    """The text of `parse_rekeys`."""
    return " ".join(":".join(map(str, each)) for each in rekeys)
