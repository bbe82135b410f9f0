"""Entities that are left out."""

from __future__ import annotations

import numpy as np

from tussle.api import Interaction, Param, WorldView
from tussle.errors import ParameterError


class Absence(Interaction):
    """Leaves out entities of a block: it removes them as soon as they are there, at the start before the first step.

    Those that are left start where they would start anyway, with the same ids, and draw the same random numbers, which fewer entities in
    the block would change.
    """

    grade = "portable"

    block = Param("", doc="Name of the block; empty for none.")
    numbers = Param((), ragged=True, doc="Numbers of the entities in their block, from 1; empty for all.")

    def check_values(self) -> None:
        """Check that numbers of entities are whole and count from 1."""
        for number in self.values["numbers"]:
            if number < 1 or number % 1:
                raise ParameterError(
                    f"Absence.numbers: {number:g} is not allowed; it takes whole numbers from 1"
                )

    def named_blocks(self) -> tuple[str, ...]:
        """Return the block."""
        return (self.block,) if self.block else ()

    def start(self, w: WorldView) -> None:
        if self.block:
            is_absent = w.block == w.context.block_names.index(self.block)
            if len(self.values["numbers"]):
                is_absent &= np.isin(w.block_index + 1, self.values["numbers"])
            w.kill(np.flatnonzero(is_absent), "removed")

    def step(self, w: WorldView) -> None:
        self.start(w)  # those that are born later
