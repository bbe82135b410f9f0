"""Limits on missions: a mission file is untrusted input, so reading and running it take bounded time and memory."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Maximum sizes; `allow_large` selects `Limits.large()`.

    Attributes:
        text: Characters of one file, and of all files with their includes and replaced placeholders.
        nodes: Tags of all files together, including copies of the tags of <entity_common> and <param_common>.
        depth: Nesting of tags.
        blocks: <entity> tags.
        plugins: Plugins of one entity, and of the world.
        files: Files that one mission includes.
        include_depth: Nesting of includes.
        rows: Entities of all blocks together, unborn ones included; while running, entities of one world.
        sequential: The same where entities move one after another: each entity needs its own calls and columns, even after its
            removal.
        tries: Positions redrawn for the entities of one world that are born at the same time, where interactions reject them.
        substeps: motion_multiplier.
        steps: Steps until the end; so many that a game of SCRIMMAGE that ends by itself or by Ctrl-C may name any end.
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
    steps: int = 10**15

    @classmethod
    def large(cls) -> Limits:
        """Limits for trusted files; still finite, since an error message helps more than running out of memory."""
        return cls(
            text=256_000_000, nodes=10_000_000, files=4096, rows=50_000_000, sequential=50_000_000, tries=10**12,
            substeps=10_000_000,
        )  # fmt: skip

    def most_rows(self, update: str) -> int:
        """Maximum number of entities of a mission with this `update`."""
        return self.rows if update == "synchronous" else self.sequential
