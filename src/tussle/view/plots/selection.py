"""The selected part of a recording, as one trajectory per entity."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from tussle.errors import ParameterError, ViewError, listed
from tussle.palette import hex_of, on_paper
from tussle.view.frame import Event
from tussle.view.recording import Recording


@dataclass(frozen=True)
class Selection:
    """Entities and times to plot; by default all.

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


class Trajectories:
    """The selected states of a recording, ordered by entity and time.

    Args:
        recording: The recorded run.
        selection: Entities and times.

    Attributes:
        frame_times: Times of the frames in the span [s], (T,).
        who: Ids, ascending, (k,).
        team: Team of each, (k,).
        first: Number of the first state of each, and the number of all states, (k + 1,).
        frame: Frame of each state, counted from the first of the span, (m,).
        t: Time of each state [s], (m,).

    Raises:
        ViewError: Nothing was recorded.
        ParameterError: The selection is empty, or a selected team or entity does not exist.
    """

    def __init__(self, recording: Recording, selection: Selection | None = None) -> None:
        self.recording, self.selection = recording, selection or Selection()
        if not recording.n_frames:
            raise ViewError(f"{recording.path}: nothing was recorded")
        begin, end = self._span()
        self.frame_times = recording.t[begin:end]
        steps = recording.steps[begin:end]
        step, ids = self._column("step"), self._column("id")
        is_mine = self._is_mine("team", self.selection.teams) & self._is_mine("id", self.selection.entities)
        rows = np.flatnonzero(is_mine & (step >= steps[0]) & (step <= steps[-1]))
        self._rows = rows[np.lexsort((step[rows], ids[rows]))]
        self.frame = np.searchsorted(steps, step[self._rows])
        self.t = self.frame_times[self.frame]
        self.who, first = np.unique(ids[self._rows], return_index=True)
        self.first = np.append(first, len(self._rows))
        self.team = self._column("team")[self._rows[first]]
        self._check_selection()

    def __len__(self) -> int:
        return len(self.who)

    def column(self, name: str) -> np.ndarray:
        """A column of the trajectory table for the selected states, (m,); one of a plugin as real numbers, NaN where there is none."""
        return self._column(name)[self._rows]

    def pos(self, axes: str = "xyz") -> np.ndarray:
        """Positions along some axes [m], (m, axes)."""
        return np.stack([self.column(axis) for axis in axes], axis=1)

    @cached_property
    def speed(self) -> np.ndarray:
        """Speed [m/s], (m,)."""
        return np.sqrt(sum(self.column(name) ** 2 for name in ("vx", "vy", "vz")))

    @property
    def last(self) -> np.ndarray:
        """Number of the last state of each, (k,)."""
        return self.first[1:] - 1

    def each(self) -> Iterator[tuple[int, int, slice]]:
        """Id, team and states of each entity."""
        for i, (who, team) in enumerate(zip(self.who.tolist(), self.team.tolist(), strict=True)):
            yield who, team, slice(self.first[i], self.first[i + 1])

    @cached_property
    def teams(self) -> dict[int, str]:
        """Number and name of the teams of these entities, ascending."""
        return {int(team): self.recording.teams[int(team)] for team in np.unique(self.team)}

    @cached_property
    def colours(self) -> dict[int, str]:
        """Colour of each team of the recording, and of each that has a base."""
        style, scenery = self.recording.style, self.recording.scenery
        teams = {*self.recording.teams, *(base.team for base in scenery.bases)}
        return {team: on_paper(hex_of(style.colour(team))) for team in teams}

    @cached_property
    def is_breaking(self) -> np.ndarray:
        """True if a state begins a new line: another entity, or missing frames before it, (m,)."""
        breaks = np.append(True, np.diff(self.frame) != 1)
        breaks[self.first[:-1]] = True
        return breaks

    def spread(self, most: int) -> np.ndarray:
        """Numbers of at most so many entities, evenly spaced."""
        return np.unique(np.linspace(0, len(self) - 1, min(most, len(self))).round().astype(int))

    @cached_property
    def events(self) -> list[Event]:
        """Events in the span."""
        low, high, slack = self.frame_times[0], self.frame_times[-1], 1e-6 * self.recording.dt
        return [h for h in self.recording.events if low - slack <= h.t <= high + slack]

    @cached_property
    def deaths(self) -> dict[int, Event]:
        """Deaths of these entities in the span, by id."""
        chosen = set(self.who.tolist())
        return {h.id: h for h in self.events if h.kind == "death" and h.id in chosen}

    @cached_property
    def team_of(self) -> dict[int, int]:
        """Team of each entity of the world, selected or not, also of one that lived between two recorded states."""
        is_mine, run = self._is_mine(), self.recording
        ids, first = np.unique(self._column("id")[is_mine], return_index=True)
        team = self._column("team")[is_mine][first]
        by_block = dict(zip(run.blocks, run.block_teams, strict=True))
        born = {h.id: by_block[h.text] for h in run.events if h.kind == "birth" and h.text in by_block}
        return born | dict(zip(ids.tolist(), team.tolist(), strict=True))

    # -- reading the tables -----------------------------------------------------------------------------------------------------

    def _column(self, name: str) -> np.ndarray:
        values = self.recording.run.trajectory_table[name].to_numpy()
        return np.asarray(values, float if name in self.recording.parts else None)

    def _span(self) -> tuple[int, int]:
        """Numbers of the first frame of the span and of the first after it."""
        times, slack = self.recording.t, 1e-6 * self.recording.dt
        begin = int(np.searchsorted(times, self.selection.start - slack))
        end = int(np.searchsorted(times, self.selection.end + slack, side="right"))
        if begin >= end:
            raise ParameterError(
                f"{self.recording.path}: nothing was recorded {self._when()}; "
                f"there are states from {times[0]:g} s to {times[-1]:g} s"
            )
        return begin, end

    def _when(self) -> str:
        limits = (("from", self.selection.start), ("to", self.selection.end))
        return " ".join(f"{word} {t:g} s" for word, t in limits if np.isfinite(t))

    def _check_selection(self) -> None:
        """Refuse teams and ids that the world never had, and entities that are not selected by team or time."""
        where, teams = self.recording.path, self.selection.teams
        for team in teams:
            if team not in self.recording.teams:
                known = (f"{number} ({name})" for number, name in self.recording.teams.items())
                raise ParameterError(f"{where}: there is no team {team}; {listed(known)}")
        for who in self.selection.entities:
            if who not in self.team_of:
                raise ParameterError(f"{where}: there is no entity {who}; {_existing(self.team_of, who)}")
            if teams and self.team_of[who] not in teams:
                raise ParameterError(
                    f"{where}: entity {who} is of team {self.team_of[who]}, which is not selected"
                )
            if who not in self.who:
                t = self.recording.t[
                    np.isin(self.recording.steps, self._column("step")[self._is_mine("id", [who])])
                ]
                if not len(t):
                    raise ParameterError(
                        f"{where}: no state of entity {who} was recorded; it lived between two that were"
                    )
                raise ParameterError(
                    f"{where}: entity {who} does not exist {self._when()}; it does from {t[0]:g} s to {t[-1]:g} s"
                )
        if not len(self):
            of = f" of team {', '.join(map(str, teams))}" if teams else ""
            raise ParameterError(f"{where}: there are no entities{of} {self._when()}".rstrip())

    def _is_mine(self, name: str = "", values: Sequence[int] = ()) -> np.ndarray:
        """Rows of this world, with one of these values in a column if there are any."""
        is_mine: np.ndarray = self._column("world") == self.recording.world
        return is_mine & np.isin(self._column(name), values) if values else is_mine


def _existing(ids: Collection[int], wrong: int) -> str:
    """The range of existing ids, and those nearest to a wrong one if the range has gaps."""
    if not ids:
        return "there are none"
    text = f"there are {min(ids)} to {max(ids)}"
    if max(ids) - min(ids) + 1 == len(ids):
        return text
    nearest = sorted(sorted(ids, key=lambda known: (abs(known - wrong), known))[:3])
    return f"{text}, with gaps; the nearest: {', '.join(map(str, nearest))}"
