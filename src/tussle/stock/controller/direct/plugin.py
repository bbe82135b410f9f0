"""Wiring for motion models that autonomies command directly."""

from __future__ import annotations

from typing import ClassVar

from tussle.api import Controller


class DirectController(Controller):
    """Joins what comes before it to what comes after it, channel by channel, unchanged.

    It has no channels of its own and is never called: the reader's inputs are the writer's outputs. The existing
    system copied value by value in every substep, to the same end.
    """

    grade = "portable"
    passthrough: ClassVar[bool] = True
