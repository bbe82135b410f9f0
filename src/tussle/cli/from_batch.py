"""`tussle run --from BATCH:417`: one run of a batch, played again."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

from tussle.batch.reload import PlannedRun, planned_run
from tussle.cli.batch_summary import compare_hash
from tussle.cli.terminal import say_note
from tussle.errors import ParameterError
from tussle.mission import Loaded, Mission


class FromBatch:
    """A run of a batch as something to play.

    Args:
        text: Directory and number, "batches/predator_prey-1a2b3c4d:417".

    Raises:
        ParameterError: It is written otherwise.
    """

    def __init__(self, text: str) -> None:
        directory, colon, number = text.rpartition(":")
        if not colon or not number.isdigit():
            raise ParameterError(
                f"--from {text!r} is not allowed; it takes a batch directory and the number of a run, DIR:417"
            )
        self._directory, self._number = Path(directory), int(number)

    @cached_property
    def _run(self) -> PlannedRun:
        return planned_run(self._directory, self._number)

    @property
    def given(self) -> dict[str, str]:
        """All that was set."""
        return self._run.settings

    def read(self, tells_all: bool = True) -> tuple[Loaded, Mission, int]:
        """The file as read, the mission, and the seed."""
        return self._run.loaded, self._run.mission, self._run.seed

    def ended(self, state_hash: str) -> None:
        """The game has come to its end.

        Raises:
            BatchError: To another one than in the batch.
        """
        compare_hash(self._run, state_hash, self._number)
        known = (
            "it ended as it did in the batch: the same state hash"
            if self._run.state_hash
            else "the batch has not played it yet"
        )
        say_note(f"run {self._number} of {self._directory}: {known}")
