"""A pass-through controller."""

from __future__ import annotations

from typing import ClassVar

from tussle.api import Controller


class DirectController(Controller):
    """Passes every channel from the autonomies to the motion model unchanged.

    It declares no channels and is never called: the inputs of the motion model are the outputs of the autonomies.
    SCRIMMAGE copied the values in every substep, with the same result.
    """

    grade = "portable"
    passthrough: ClassVar[bool] = True
