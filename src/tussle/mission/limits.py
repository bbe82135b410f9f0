"""How much a mission may ask for: its file is input from outside, and reading and playing it take bounded time and memory."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Largest sizes; `Limits.large()` is what `allow_large` stands for.

    Attributes:
        text: Characters of one file, and of all files with their includes and replaced placeholders.
        nodes: Tags of all files together, and what <entity_common> and <param_common> give to each that takes them.
        depth: Tags inside tags.
        blocks: <entity> tags.
        plugins: Plugins of one entity, and of the world.
        files: Files that one mission includes.
        include_depth: Files that include files.
        rows: Entities of all blocks together, unborn ones included; in play, those of one world.
        sequential: The same with update="sequential", where each entity that ever lived takes calls and columns of its own.
        tries: Places drawn anew for the entities of one world that are born at one moment, where referees reject them.
        substeps: motion_multiplier.
        steps: Steps until the end.
    """

    text: int = 4_000_000
    nodes: int = 100_000
    depth: int = 32
    blocks: int = 5_000
    plugins: int = 1_000
    files: int = 64
    include_depth: int = 8
    rows: int = 200_000
    sequential: int = 10_000
    tries: int = 50_000
    substeps: int = 10_000
    steps: int = 1_000_000_000

    @classmethod
    def large(cls) -> Limits:
        """For whoever trusts the file: still finite, since what is refused says more than a machine without memory."""
        return cls(
            text=256_000_000, nodes=10_000_000, files=4096, rows=50_000_000, sequential=50_000_000, tries=10**12,
            substeps=10_000_000, steps=10**15,
        )  # fmt: skip

    def most_rows(self, update: str) -> int:
        """Entities that a mission with this `update` may have."""
        return self.sequential if update == "sequential" else self.rows
