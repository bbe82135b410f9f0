"""Changes of the random key during a game: from a step on, a world draws with another key.

A game is its mission, its seed and its re-keys. One with other re-keys from step k on is a branch: the same game up to the state at the
start of step k, and then other luck.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from tussle.declare.texts import shown
from tussle.errors import MissionError

Rekeys = tuple[tuple[int, int], ...]
"""(step, key) of each change, in order of the steps."""

PAIR = re.compile(r"(\d{1,10}):(\d{1,20})", re.ASCII)
MAX_STEP, MAX_KEY = 2**32 - 1, 2**64 - 1
TAKES = "it takes pairs of a step and a key, as 120:77 340:8, with steps that ascend, below 2^32, and keys below 2^64"


def checked_rekeys(value: Any) -> Rekeys:
    """Re-keys as a tuple of pairs of whole numbers.

    Raises:
        MissionError: They are not in order of their steps, or a number is not allowed.
    """
    try:
        pairs = tuple((_whole(step), _whole(key)) for step, key in value)
    except (TypeError, ValueError):
        raise MissionError(f"rekeys = {value!r:.80} is not allowed; {TAKES}") from None
    steps = [step for step, _ in pairs]
    if steps != sorted(set(steps)) or not all(0 <= s <= MAX_STEP and 0 <= k <= MAX_KEY for s, k in pairs):
        raise MissionError(f"rekeys = {value!r:.80} is not allowed; {TAKES}")
    return pairs


def _whole(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, (int, np.integer)):
        raise TypeError
    return int(value)


def parse_rekeys(text: str) -> Rekeys:
    """Parse a text such as "120:77 340:8".

    Raises:
        MissionError: It is written otherwise, or a number is not allowed.
    """
    pairs = [PAIR.fullmatch(word) for word in text.split()]
    if not pairs or None in pairs:
        raise MissionError(f"rekeys {shown(text)} are not allowed; {TAKES}")
    return checked_rekeys([(int(pair[1]), int(pair[2])) for pair in pairs if pair])


def rekeys_text(rekeys: Rekeys) -> str:
    """The text of `parse_rekeys`."""
    return " ".join(f"{step}:{key}" for step, key in rekeys)
