"""`tussle run --from BATCH:417`: one run of a batch, played again."""

from __future__ import annotations

import sys
from contextlib import suppress
from functools import cached_property
from pathlib import Path

import typer

from tussle.batch.reload import PlannedRun, planned_run
from tussle.batch.trust import DirectoryCode
from tussle.cli.batch_summary import compare_hash
from tussle.cli.terminal import say_note
from tussle.errors import ParameterError
from tussle.mission import Loaded, Mission


class FromBatch:
    """A run of a batch as something to play.

    Args:
        text: Directory and number, "batches/predator_prey-1a2b3c4d:417".
        trusts: Plugin code of the directory is run, whoever made it.
        allow_large: Without limits on how much the mission may ask for.

    Raises:
        ParameterError: It is written otherwise.
    """

    def __init__(self, text: str, trusts: bool = False, allow_large: bool = False) -> None:
        directory, colon, number = text.rpartition(":")
        if not colon or not number.isdigit():
            raise ParameterError(
                f"--from {text!r} is not allowed; it takes a batch directory and the number of a run, DIR:417"
            )
        self._directory, self._number = Path(directory), int(number)
        self._trusts, self._allow_large = trusts, allow_large

    @cached_property
    def _run(self) -> PlannedRun:
        return planned_run(
            self._directory, self._number, may_run=self._may_run, allow_large=self._allow_large
        )

    def _may_run(self, code: DirectoryCode) -> bool:
        """Whether the plugin code is run that the directory holds: the user's own is, and other code where the user wants it."""
        if code.is_own:
            return True
        is_asked = not self._trusts and sys.stdin.isatty() and sys.stderr.isatty()
        if self._trusts or is_asked:
            say_note(
                f"plugin code of {code.path}, which is not known to be yours, has all your rights: {code}"
            )
        if is_asked:
            with suppress(typer.Abort):  # no answer
                return typer.confirm("Run it?", err=True)
        return self._trusts

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
