"""Interactive 3D views in notebooks: the page of `tussle view` in an output cell, without a port."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape

from tussle.documents import Whole, check_argument
from tussle.engine.simulation import Simulation
from tussle.errors import MissingExtraError
from tussle.view.live import Live
from tussle.view.notebook_widget import GameView, RunView
from tussle.view.page.assemble import page_html
from tussle.view.page.recorded import RecordedData
from tussle.view.recording import Recording

MAX_STATES = 500_000
"""Largest number of states of a run that its cell holds whole, at some 10 B each. Larger runs ask the kernel for what they show."""
HEIGHT = Whole(100, 4000)
"""Allowed heights of a view [pixels]."""


@dataclass(frozen=True, repr=False)
class RecordedView:
    """A recorded run in a cell that holds all of it: a saved notebook plays it without a kernel.

    Attributes:
        html: The page.
        height: Height of the view [pixels].
    """

    html: str
    height: int

    def _repr_html_(self) -> str:
        # The page runs its own script and nothing else, and reaches nothing of the notebook.
        return (
            f'<iframe sandbox="allow-scripts" title="tussle" srcdoc="{escape(self.html)}" '
            f'style="width: 100%; height: {self.height}px; border: 0; display: block"></iframe>'
        )

    def __repr__(self) -> str:
        return f"RecordedView({len(self.html):,} characters; notebooks show it)"


def view_run(recording: Recording, height: int = 520) -> RecordedView | RunView:
    """Return a view of a recorded run, with a time line.

    Runs of at most `MAX_STATES` states are whole in the cell. Larger ones need anywidget and the kernel.

    Args:
        recording: The run.
        height: Height of the view [pixels].

    Raises:
        MissingExtraError: The run is larger, and anywidget is not installed.
        ParameterError: The height is not allowed.
        ViewError: The run holds no states.
    """
    check_argument("height", height, HEIGHT)
    data = RecordedData(recording, is_file=True)
    if data.counts.sum() <= MAX_STATES:
        blobs = {name: data.blob(name) or b"" for name in data.names}
        return RecordedView(page_html(data.document(), blobs), height)
    _check_extra()
    return RunView(RecordedData(recording, is_file=False), height)


def view_simulation(simulation: Simulation, world: int = 0, height: int = 520) -> GameView:
    """Return a view that plays a simulation, paused at first. `stop()` of the view, or closing the simulation, ends it.

    Args:
        simulation: The simulation; until `stop` nobody else steps it.
        world: Number of the world that is shown.
        height: Height of the view [pixels].

    Raises:
        MissingExtraError: anywidget is not installed.
        ParameterError: A value is not allowed.
    """
    check_argument("height", height, HEIGHT)
    _check_extra()
    return GameView(Live(simulation, world, is_paused=True), height)


def _check_extra() -> None:
    try:
        import anywidget  # noqa: F401
    except ImportError as error:
        raise MissingExtraError(
            "the view in a notebook needs anywidget, which is not installed: pip install 'tussle[notebook]'"
        ) from error
