"""What happens in a game besides motion: who came, who went and why, who met whom, how it ended."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

BIRTH: Final = "birth"
DEATH: Final = "death"
CAPTURE: Final = "capture"
COLLISION: Final = "collision"
END: Final = "end"


@dataclass(frozen=True)
class Happenings:
    """Events of one kind in one step, ordered by world.

    Attributes:
        kind: "birth", "death", "capture", "collision" or "end".
        world: World of each, (m,).
        step: Step in which it happened, (m,): that of the trajectory row before it; for births and ends that of the row with it.
        id: Who was born, died, captured, or has the smaller id of two that met; 0 for ends, (m,).
        other: Who was captured; who captured the dead or met it; the larger id of two that met; 0 for nobody, (m,).
        text: Block of the born; "ground" where one met that; why one died; why a world ended, (m,).
    """

    kind: str
    world: np.ndarray
    step: np.ndarray
    id: np.ndarray
    other: np.ndarray
    text: list[str]

    def __len__(self) -> int:
        return len(self.world)
