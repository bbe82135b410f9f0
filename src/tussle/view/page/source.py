"""What the page shows and steers: a simulation that is played, or a recorded run."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

from tussle.engine.result import WorldResult
from tussle.view.drawn import Shape
from tussle.view.entity import EntityState
from tussle.view.frame import Frame, Happening
from tussle.view.looks import Looks
from tussle.view.scenery import Scenery


class Source(Protocol):
    """A game that can be watched: `tussle.view.live.Live`, or a `Replay` of one or two recorded runs.

    All of it returns at once, whatever the game is doing.
    """

    # -- what it is -------------------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        """Its title."""

    @property
    def blocks(self) -> list[str]:
        """Names of the blocks; the column `block` of a frame counts in them."""

    @property
    def teams(self) -> dict[int, str]:
        """Team number -> names of its blocks."""

    @property
    def looks(self) -> Looks:
        """Colours and models of the entities."""

    @property
    def scenery(self) -> Scenery:
        """What stands still."""

    # -- where it is --------------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        """Time that is shown [s]."""

    @property
    def span(self) -> tuple[float, float]:
        """First and last time that can be gone to [s]."""

    @property
    def is_paused(self) -> bool:
        """Whether it stands still."""

    @property
    def epoch(self) -> int:
        """How often the game has jumped in time or begun anew: what was kept of its past may be void."""

    @property
    def error(self) -> Exception | None:
        """What stopped the game; None while nothing has."""

    @property
    def is_over(self) -> bool:
        """Whether it cannot go on from here."""

    @property
    def warp(self) -> float:
        """Simulated seconds per second that are wanted; inf is as fast as possible."""

    @warp.setter
    def warp(self, warp: float | None) -> None: ...

    @property
    def warp_reached(self) -> float:
        """Simulated seconds per second over the last second."""

    # -- what is seen -------------------------------------------------------------------------------------------------------------

    def frame(self) -> Frame:
        """The newest frame."""

    def frame_at(self, t: float) -> Frame:
        """The last frame not after a time [s], for a look back."""

    def shapes(self) -> tuple[Shape, ...]:
        """What the plugins have drawn."""

    def result(self) -> WorldResult | None:
        """What the game has come to so far; None where that is not known."""

    def entity(self, who: int) -> EntityState | None:
        """All that is known of an entity; None where it is not there."""

    @property
    def happenings(self) -> Sequence[Happening]:
        """Events, in order."""

    @property
    def notes(self) -> Sequence[str]:
        """What the user should know, one line each."""

    # -- controls -----------------------------------------------------------------------------------------------------------------

    def pause(self) -> None:
        """Stand still."""

    def resume(self) -> None:
        """Go on."""

    def toggle(self) -> None:
        """Pause, or go on."""

    def step(self, n: int = 1) -> None:
        """Go n steps forward and stand still."""

    def step_back(self, n: int = 1) -> None:
        """Go n steps back and stand still."""

    def seek(self, t: float) -> None:
        """Go to a time [s]."""

    def faster(self) -> None:
        """Warp up."""

    def slower(self) -> None:
        """Warp down."""
