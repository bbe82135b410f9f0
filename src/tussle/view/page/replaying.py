"""A recorded run behind the controls of a live one."""

from __future__ import annotations

import math
import threading
import time
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.api.bodies import BODY_UNITS
from tussle.engine.result import WorldResult
from tussle.mission import Mission
from tussle.view.drawn import Shape
from tussle.view.entity import EntityState, Reading
from tussle.view.frame import Frame, Happening
from tussle.view.looks import Looks
from tussle.view.pacing import checked_warp, faster, slower
from tussle.view.scenery import Scenery

if TYPE_CHECKING:
    from tussle.view.recording import Recording

FASTEST = 1000.0
"""What "as fast as possible" is of a recorded run, in simulated seconds per second: there is nothing to compute."""


class PlayHead:
    """A place in time that moves by itself: the wall's clock times the warp.

    Args:
        times: Times of the frames [s], ascending.
        warp: Simulated seconds per second.
        is_paused: Whether it stands still at first.
    """

    def __init__(self, times: np.ndarray, warp: float | None = 1.0, is_paused: bool = False) -> None:
        self._times = times
        self.first, self.last = (float(times[0]), float(times[-1])) if len(times) else (0.0, 0.0)
        self._warp = checked_warp(warp)
        self.is_paused = is_paused
        self._anchor = (time.monotonic(), self.first)
        self._lock = threading.Lock()

    @property
    def warp(self) -> float:
        return self._warp

    @warp.setter
    def warp(self, warp: float | None) -> None:
        wanted = checked_warp(warp)
        with self._lock:
            self._hold()
            self._warp = wanted

    @property
    def pace(self) -> float:
        """Simulated seconds per second at which it moves now."""
        return 0.0 if self.is_paused or self.t >= self.last else min(self._warp, FASTEST)

    @property
    def t(self) -> float:
        """Where it is [s]."""
        began, t = self._anchor
        if not self.is_paused:
            t += (time.monotonic() - began) * min(self._warp, FASTEST)
        return min(t, self.last)

    def _hold(self) -> None:
        self._anchor = (time.monotonic(), self.t)

    def pause(self) -> None:
        """Stand still."""
        with self._lock:
            self._hold()
            self.is_paused = True

    def resume(self) -> None:
        """Go on; from the end, from the beginning."""
        with self._lock:
            self._anchor = (time.monotonic(), self.first if self.t >= self.last else self.t)
            self.is_paused = False

    def seek(self, t: float) -> None:
        """Go to a time [s], and there stand still or go on as now."""
        with self._lock:
            self._anchor = (time.monotonic(), min(max(t, self.first), self.last))

    def step(self, n: int) -> None:
        """Go n frames forward, or with n < 0 back, and stand still."""
        if not len(self._times):
            return
        here = int(np.searchsorted(self._times, self.t + 1e-9, side="right")) - 1
        place = min(max(here + n, 0), len(self._times) - 1)
        with self._lock:
            self._anchor = (time.monotonic(), float(self._times[place]))
            self.is_paused = True


class Replay:
    """A recorded run as a `Source`: it plays, stands still, and goes to any time at once.

    Of an entity it knows what was recorded; what plugins kept to themselves and what they drew is not in a run directory.

    Args:
        recording: The run.
        warp: Simulated seconds per second; None is as fast as can be shown.
        is_paused: Whether it stands still at first.
    """

    def __init__(self, recording: Recording, *, warp: float | None = 1.0, is_paused: bool = False) -> None:
        self.recording = recording
        self.head = PlayHead(recording.t, warp, is_paused)
        self._last: tuple[int, Frame] | None = None

    # -- what it is -------------------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        return self.recording.name

    @property
    def blocks(self) -> list[str]:
        return self.recording.blocks

    @property
    def teams(self) -> dict[int, str]:
        return self.recording.teams

    @property
    def looks(self) -> Looks:
        return self.recording.looks

    @property
    def scenery(self) -> Scenery:
        return self.recording.scenery

    @property
    def mission(self) -> Mission | None:
        return self.recording.mission

    @property
    def viewer(self) -> dict[str, Any]:
        return self.recording.viewer

    # -- where it is --------------------------------------------------------------------------------------------------------------

    @property
    def t(self) -> float:
        return self.head.t

    @property
    def span(self) -> tuple[float, float]:
        return self.head.first, self.head.last

    @property
    def is_paused(self) -> bool:
        return self.head.is_paused

    @property
    def is_over(self) -> bool:
        return self.head.t >= self.head.last

    @property
    def epoch(self) -> int:
        return 0

    @property
    def error(self) -> None:
        return None

    @property
    def warp(self) -> float:
        return self.head.warp

    @warp.setter
    def warp(self, warp: float | None) -> None:
        self.head.warp = checked_warp(warp)

    @property
    def warp_reached(self) -> float:
        return self.head.pace

    # -- what is seen -------------------------------------------------------------------------------------------------------------

    def frame(self) -> Frame:
        """The last recorded moment not after the present."""
        index = self.recording.index_at(self.t)
        last = self._last
        if last is None or last[0] != index:
            last = self._last = (index, self.recording.frame(index))
        return last[1]

    def frame_at(self, t: float) -> Frame:
        """The last recorded moment not after a time [s]."""
        return self.recording.at(t)

    def shapes(self) -> tuple[Shape, ...]:
        """Nothing: what plugins drew is not recorded."""
        return ()

    def result(self) -> WorldResult | None:
        """Nothing: metrics are recorded as of the end."""
        return None

    def entity(self, who: int) -> EntityState | None:
        """What was recorded of an entity at this moment."""
        return recorded_state(self.frame(), who, self.blocks)

    @cached_property
    def happenings(self) -> list[Happening]:
        return self.recording.happenings

    @property
    def notes(self) -> list[str]:
        return self.recording.notes

    # -- controls -----------------------------------------------------------------------------------------------------------------

    def pause(self) -> None:
        """Stand still."""
        self.head.pause()

    def resume(self) -> None:
        """Go on; at the end, from the beginning."""
        self.head.resume()

    def toggle(self) -> None:
        """Pause, or go on; at the end, play again."""
        if self.head.is_paused or self.is_over:
            self.head.resume()
        else:
            self.head.pause()

    def step(self, n: int = 1) -> None:
        """Go n recorded moments forward and stand still."""
        self.head.step(n)

    def step_back(self, n: int = 1) -> None:
        """Go n recorded moments back and stand still."""
        self.head.step(-n)

    def seek(self, t: float) -> None:
        """Go to a time [s]."""
        self.head.seek(t)

    def faster(self) -> None:
        """Warp up: doubled below 2, then one more."""
        self.warp = faster(self.warp)

    def slower(self) -> None:
        """Warp down: one less above 2, then halved."""
        self.warp = slower(self.warp, FASTEST)


def recorded_state(frame: Frame, who: int, blocks: list[str]) -> EntityState | None:
    """What a frame holds of an entity; None where it is not there."""
    row = frame.row_of(who)
    if row < 0:
        return None
    w, x, y, z = (float(v) for v in frame.quat[row])
    vel = frame.vel[row]
    values: dict[str, Any] = {
        "pos": frame.pos[row], "vel": vel, "quat": frame.quat[row], "health": float(frame.health[row]),
        "yaw": math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
    }  # fmt: skip
    body = {name: Reading(value, BODY_UNITS[name]) for name, value in values.items()}
    body["speed"] = Reading(float(np.linalg.norm(vel)), "m/s")
    block = blocks[int(frame.block[row])]
    return EntityState(frame.t, frame.step, who, int(frame.team[row]), block, body)
