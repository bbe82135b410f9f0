"""Events of a game: births, deaths, captures, collisions, flags and ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

BIRTH: Final = "birth"
DEATH: Final = "death"
CAPTURE: Final = "capture"
COLLISION: Final = "collision"
FLAG: Final = "flag"
END: Final = "end"
KINDS: Final = (BIRTH, DEATH, CAPTURE, COLLISION, FLAG, END)


@dataclass(frozen=True)
class Events:
    """Events of one kind in one step, ordered by world.

    Attributes:
        kind: "birth", "death", "capture", "collision", "flag" or "end".
        world: World of each, (m,).
        step: Step of the event, (m,): that of the last trajectory row before it; for births and ends, that of the row with it.
        id: Entity that was born, died, captured or has a flag, or the smaller id of a collision; 0 for ends, (m,).
        other: Entity that was captured, that captured or hit the dead one, or the larger id of a collision; 0 for none, (m,).
        text: Block of a birth, "ground" for a collision with it, cause of a death, what happened to a flag, or reason of an end, (m,).
    """

    kind: str
    world: np.ndarray
    step: np.ndarray
    id: np.ndarray
    other: np.ndarray
    text: list[str]

    def __len__(self) -> int:
        return len(self.world)
