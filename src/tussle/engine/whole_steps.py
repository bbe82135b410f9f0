"""Steps are played whole: Ctrl-C waits for the end of a step, and a step that was cut off is not continued."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from types import FrameType

from tussle.errors import SnapshotError


class WholeSteps:
    """What has begun a step, and what was interrupted in one."""

    def __init__(self) -> None:
        self._within = threading.Lock()
        self._cut: set[int] = set()

    def begin(self) -> None:
        """Begin a step.

        Raises:
            SnapshotError: A step is under way, or one was cut off.
        """
        if not self._within.acquire(blocking=False):
            raise SnapshotError(
                "a step is under way: it is called by another thread, or by a plugin; one thread may step a simulation at a time"
            )
        if self._cut:
            self._within.release()
            raise SnapshotError(
                f"world {min(self._cut)} was interrupted in the middle of a step: some plugins have played it, others have not; "
                "to go on, reset the world or restore a snapshot"
            )

    def end(self) -> None:
        """End a step."""
        self._within.release()

    def cut(self, worlds: Iterable[int]) -> None:
        """Worlds have not played the step to its end."""
        self._cut.update(worlds)

    def renew(self, worlds: Iterable[int]) -> None:
        """Worlds have a state between two steps again."""
        self._cut.difference_update(worlds)

    @contextmanager
    def interruptible(self) -> Iterator[Callable[[], None]]:
        """Let Ctrl-C take effect between two steps, where the given function is called; a second one at once.

        Programs that handle Ctrl-C in their own way, as the command does, are left alone.
        """
        usual = signal.default_int_handler
        if (
            threading.current_thread() is not threading.main_thread()
            or signal.getsignal(signal.SIGINT) is not usual
        ):
            yield lambda: None
            return
        pressed: list[int] = []

        def handle(number: int, frame: FrameType | None) -> None:
            if pressed or not self._within.locked():
                usual(number, frame)
            else:
                pressed.append(number)

        def check() -> None:
            if pressed:
                usual(pressed.pop(), None)

        signal.signal(signal.SIGINT, handle)
        try:
            yield check
        finally:
            signal.signal(signal.SIGINT, usual)
        check()
