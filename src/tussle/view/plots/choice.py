"""Which part of a recording is plotted, and its states as one track per entity."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tussle.errors import ParameterError, ViewError, listed
from tussle.view.frame import Event
from tussle.view.recording import Recording


@dataclass(frozen=True)
class Choice:
    """Who is plotted, and when; all of them at all times unless it says otherwise.

    Args:
        teams: Numbers of the teams.
        entities: Ids of the entities.
        start: First time [s].
        end: Last time [s].
    """

    teams: tuple[int, ...] = ()
    entities: tuple[int, ...] = ()
    start: float = -np.inf
    end: float = np.inf


class Tracks:
    """The chosen part of a recording: states ordered by entity and time.

    Args:
        recording: What was recorded.
        choice: Which part of it.

    Attributes:
        frame_times: Times of the frames in the span [s], (T,).
        who: Ids, ascending, (k,).
        team: Team of each, (k,).
        first: Number of each one's first state, and the number of all states, (k + 1,).
        frame: Frame of each state, counted from the first of the span, (m,).
        t: Time of each state [s], (m,).

    Raises:
        ViewError: Nothing was recorded.
        ParameterError: Nothing of what was recorded is chosen, or somebody who is not there.
    """

    def __init__(self, recording: Recording, choice: Choice | None = None) -> None:
        self.recording, self.choice = recording, choice or Choice()
        if not recording.n_frames:
            raise ViewError(f"{recording.path}: nothing was recorded")
        begin, end = self._span()
        self.frame_times = recording.t[begin:end]
        steps = recording.steps[begin:end]
        is_mine = self._column("world") == recording.world
        self._check_who(is_mine)
        step, ids = self._column("step"), self._column("id")
        is_mine &= (step >= steps[0]) & (step <= steps[-1])
        if self.choice.teams:
            is_mine &= np.isin(self._column("team"), self.choice.teams)
        if self.choice.entities:
            is_mine &= np.isin(ids, self.choice.entities)
        rows = np.flatnonzero(is_mine)
        self._rows = rows[np.lexsort((step[rows], ids[rows]))]
        self.frame = np.searchsorted(steps, step[self._rows])
        self.t = self.frame_times[self.frame]
        self.who, first = np.unique(ids[self._rows], return_index=True)
        self.first = np.append(first, len(self._rows))
        self.team = self._column("team")[self._rows[first]]
        self._check_all_there()

    # -- what there is --------------------------------------------------------------------------------------------------------

    def __len__(self) -> int:
        return len(self.who)

    def column(self, name: str) -> np.ndarray:
        """A column of the trajectory table for the chosen states, (m,)."""
        return self._column(name)[self._rows]

    def pos(self, axes: str = "xyz") -> np.ndarray:
        """Positions along some axes [m], (m, axes)."""
        return np.stack([self.column(axis) for axis in axes], axis=1)

    @cached_property
    def speed(self) -> np.ndarray:
        """Ground speed, climb included [m/s], (m,)."""
        return np.sqrt(sum(self.column(name) ** 2 for name in ("vx", "vy", "vz")))

    @property
    def last(self) -> np.ndarray:
        """Number of each one's last state, (k,)."""
        return self.first[1:] - 1

    def each(self) -> Iterator[tuple[int, int, slice]]:
        """Id, team and states of each."""
        for i, (who, team) in enumerate(zip(self.who.tolist(), self.team.tolist(), strict=True)):
            yield who, team, slice(self.first[i], self.first[i + 1])

    @cached_property
    def teams(self) -> dict[int, str]:
        """Number and name of the teams that are there, ascending."""
        return {int(team): self.recording.teams[int(team)] for team in np.unique(self.team)}

    @cached_property
    def is_breaking(self) -> np.ndarray:
        """Whether a state does not follow the one before it: another entity, or frames in between without it, (m,)."""
        breaks = np.append(True, np.diff(self.frame) != 1)
        breaks[self.first[:-1]] = True
        return breaks

    def spread(self, most: int) -> np.ndarray:
        """Numbers of at most so many entities, evenly through all of them."""
        return np.unique(np.linspace(0, len(self) - 1, min(most, len(self))).round().astype(int))

    @cached_property
    def events(self) -> list[Event]:
        """What happened in the span."""
        low, high, slack = self.frame_times[0], self.frame_times[-1], 1e-6 * self.recording.dt
        return [h for h in self.recording.events if low - slack <= h.t <= high + slack]

    @cached_property
    def deaths(self) -> dict[int, Event]:
        """How those ended that died in the span."""
        chosen = set(self.who.tolist())
        return {h.id: h for h in self.events if h.kind == "death" and h.id in chosen}

    @cached_property
    def team_of(self) -> dict[int, int]:
        """Team of each entity of the world, chosen or not."""
        is_mine = self._column("world") == self.recording.world
        ids, first = np.unique(self._column("id")[is_mine], return_index=True)
        team = self._column("team")[is_mine][first]
        return dict(zip(ids.tolist(), team.tolist(), strict=True))

    @property
    def is_whole(self) -> bool:
        """Whether the span holds all that was recorded."""
        return len(self.frame_times) == self.recording.n_frames

    # -- what there is not ------------------------------------------------------------------------------------------------------

    def _column(self, name: str) -> np.ndarray:
        return np.asarray(self.recording.run.trajectory_table[name].to_numpy())

    def _span(self) -> tuple[int, int]:
        """Numbers of the first frame of the span and of the first behind it."""
        times, slack = self.recording.t, 1e-6 * self.recording.dt
        begin = int(np.searchsorted(times, self.choice.start - slack))
        end = int(np.searchsorted(times, self.choice.end + slack, side="right"))
        if begin >= end:
            raise ParameterError(
                f"{self.recording.path}: nothing was recorded {self._when()}; "
                f"there are states from {times[0]:g} s to {times[-1]:g} s"
            )
        return begin, end

    def _when(self) -> str:
        start, end = self.choice.start, self.choice.end
        parts = [f"from {start:g} s"] if np.isfinite(start) else []
        return " ".join([*parts, f"to {end:g} s"] if np.isfinite(end) else parts)

    def _check_who(self, is_mine: np.ndarray) -> None:
        """Refuse teams and ids that the world never had."""
        for team in self.choice.teams:
            if team not in self.recording.teams:
                known = (f"{number} ({name})" for number, name in self.recording.teams.items())
                raise ParameterError(f"{self.recording.path}: there is no team {team}; {listed(known)}")
        ids = np.unique(self._column("id")[is_mine])
        for who in self.choice.entities:
            if who not in ids:
                raise ParameterError(
                    f"{self.recording.path}: there is no entity {who}; {_there_are(ids, who)}"
                )

    def _check_all_there(self) -> None:
        """Refuse what leaves nothing, or leaves out somebody who was asked for."""
        where = self.recording.path
        for who in self.choice.entities:
            if who in self.who:
                continue
            team = self.team_of[who]
            if self.choice.teams and team not in self.choice.teams:
                raise ParameterError(
                    f"{where}: entity {who} is of team {team}, which is not among those chosen"
                )
            t = self.recording.t[np.isin(self.recording.steps, self._column("step")[self._rows_of(who)])]
            raise ParameterError(
                f"{where}: entity {who} is not there {self._when()}; it is from {t[0]:g} s to {t[-1]:g} s"
            )
        if not len(self):
            of = f" of team {', '.join(map(str, self.choice.teams))}" if self.choice.teams else ""
            raise ParameterError(f"{where}: there is nobody{of} {self._when()}".rstrip())

    def _rows_of(self, who: int) -> np.ndarray:
        is_its: np.ndarray = (self._column("world") == self.recording.world) & (self._column("id") == who)
        return is_its


def _there_are(ids: np.ndarray, wrong: int) -> str:
    """The ids that there are, and the nearest to a wrong one where they have gaps."""
    if not len(ids):
        return "there are none"
    text = f"there are {ids[0]} to {ids[-1]}"
    if ids[-1] - ids[0] + 1 == len(ids):
        return text
    nearest = np.sort(ids[np.argsort(np.abs(ids.astype(int) - wrong), kind="stable")[:3]])
    return f"{text}, with gaps; the nearest: {', '.join(map(str, nearest))}"
