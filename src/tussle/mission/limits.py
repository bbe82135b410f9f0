"""How much a mission file may ask for: it is input from outside, and reading it takes bounded time and memory."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Limits:
    """Largest sizes; `Limits.large()` is what `allow_large` stands for.

    Attributes:
        text: Characters of one file, and of all files with their includes and replaced placeholders.
        nodes: Tags of all files together.
        depth: Tags inside tags.
        blocks: <entity> tags.
        plugins: Plugins of one entity, and of the world.
        files: Files that one mission includes.
        include_depth: Files that include files.
        rows: Entities of all blocks together, unborn ones included.
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
    substeps: int = 10_000
    steps: int = 1_000_000_000

    @classmethod
    def large(cls) -> Limits:
        """For whoever trusts the file: still finite, since what is refused says more than a machine without memory."""
        return cls(
            text=256_000_000, nodes=10_000_000, files=4096, rows=50_000_000, substeps=10_000_000, steps=10**15
        )
