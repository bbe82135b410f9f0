"""Frames and events of a recorded run at any time."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from tussle.api.draw import KINDS
from tussle.arguments import explained
from tussle.batch.trust import DirectoryCode
from tussle.documents import is_whole
from tussle.errors import ParameterError, RecordError, TussleError, listed, nearest_name
from tussle.folders import real_path
from tussle.mission import Loaded, Mission, PluginFile, read_mission
from tussle.record import Run, load_run
from tussle.record.plugin_columns import PluginColumn
from tussle.record.plugin_copies import copied_plugins
from tussle.record.schema import MISSION_FILE, RUN_FILE, SHAPES_FILE, TRAJECTORY_FILE
from tussle.view.alarms import SpecificationAlarms, SpecificationMonitor
from tussle.view.drawn import Shape
from tussle.view.frame import Event, Frame, empty_frame
from tussle.view.ground_map import GroundMap
from tussle.view.scenery import Scenery, scenery_of
from tussle.view.sight import fields_of_view
from tussle.view.style import Style

MAX_EMPTY = 5_000_000
"""Frames without entities that are added, in memory about 300 MB."""
MAX_SAMPLED = 60
"""Frames that are sampled of a run that stays in its file."""
POS, QUAT, VEL = ("x", "y", "z"), ("qw", "qx", "qy", "qz"), ("vx", "vy", "vz")


def masked(column: pa.ChunkedArray) -> np.ma.MaskedArray[Any, Any]:
    """Numbers of a table's column, (n,), masked where they are null."""
    return np.ma.array(
        pc.fill_null(column, False if column.type == pa.bool_() else 0).to_numpy(),
        mask=column.is_null().to_numpy(),
    )


@explained
class Recording:
    """One world of a run directory, complete or not.

    The tables stay as they were read: a frame reads only its own rows.

    Args:
        path: The run directory.
        world: Number of the world.
        plugin_files: Python files with plugins of the run's mission; by default those that the directory holds, if the user's own.
        is_mapped: States stay in their file and are checked when a frame is made of them, so a run of any size opens at once. Extent
            and teams are then those of at most `MAX_SAMPLED` frames, evenly spaced.
        ground_map: A map that pictures show on the ground; by default that of the mission file.

    Attributes:
        run: The run directory as it was loaded.
        name: The mission's title, else the directory's name.
        blocks: Names of the blocks; the column `block` of a frame counts in them.
        block_teams: Team of each block.
        teams: Team number -> names of its blocks, in order of the teams.
        t: Time of each frame [s], (T,), ascending.
        steps: Step of each frame, (T,).
        notes: Missing parts of the run, and notes about its mission, one line each.
        alarms: What `watch` has found of specifications; None before.
        id_shift: Offset of the ids: 0.

    Raises:
        RecordError: It is not a run directory, is damaged, or does not have the world.
    """

    id_shift = 0

    def __init__(
        self,
        path: str | Path,
        world: int = 0,
        plugin_files: tuple[str | Path, ...] = (),
        *,
        is_mapped: bool = False,
        ground_map: GroundMap | None = None,
    ) -> None:
        self.path = Path(path)
        self._ground_map = ground_map
        self.world = world
        self.run: Run = load_run(self.path, is_mapped=is_mapped)
        self._is_mapped = is_mapped
        self.notes: list[str] = [*self.run.notes, *self.run.mission_notes]
        self._plugin_files = plugin_files
        self.alarms: SpecificationAlarms | None = None
        table = self.run.trajectory_table
        self._batches = table.to_batches()
        self._starts = np.cumsum([0, *(b.num_rows for b in self._batches)])
        self._arrays: dict[tuple[int, str], np.ndarray] = {}
        self._find_frames()
        self._name_blocks()

    # -- tables ---------------------------------------------------------------------------------------------------------------

    def _whole(self, name: str) -> np.ndarray:
        """A column of all worlds."""
        column = self.run.trajectory_table[name]
        return np.concatenate([np.zeros(0, np.int32), *(c.to_numpy() for c in column.chunks)])

    def _frame_starts(self) -> np.ndarray:
        """Row, world and step at the beginning of each frame, (3, n): rows of one world and step are side by side."""
        parts = [np.zeros((3, 0), np.int64)]
        before: tuple[int, int] | None = None
        for batch, start in zip(self._batches, self._starts, strict=False):
            world, step = (batch[name].to_numpy() for name in ("world", "step"))
            if not len(step):
                continue
            rows = np.flatnonzero((step[1:] != step[:-1]) | (world[1:] != world[:-1])) + 1
            if before != (world[0], step[0]):
                rows = np.concatenate([[0], rows])
            before = world[-1], step[-1]
            parts.append(np.stack([rows + start, world[rows], step[rows]]))
        return np.concatenate(parts, axis=1)

    def _find_frames(self) -> None:
        """Find the rows of each frame."""
        first, worlds, step = self._frame_starts()
        last = np.concatenate([first[1:], self._starts[-1:]])[: len(first)]
        n_worlds = max(len(self.run.info.get("worlds", ())), int(worlds.max(initial=-1)) + 1)
        if not (is_whole(self.world) and 0 <= self.world < max(n_worlds, 1)):
            raise RecordError(
                f"{self.path}: there is no world {self.world}; there are worlds 0 to {n_worlds - 1}"
            )
        if not self._is_mapped:
            wrong = np.setdiff1d(np.flatnonzero(np.diff(self._whole("id")) <= 0) + 1, first)
            if len(wrong):
                raise RecordError(
                    f"{self.path / TRAJECTORY_FILE}: the ids of a step do not ascend in row {wrong[0]}"
                )
        mine = np.flatnonzero(worlds == self.world)
        mine = mine[np.argsort(step[mine], kind="stable")]
        self._first, self._last, self.steps = first[mine], last[mine], step[mine]
        if (np.diff(self.steps) <= 0).any():
            raise RecordError(f"{self.path / TRAJECTORY_FILE}: the rows of a step are not contiguous")
        self._set_times()
        self._add_empty_frames()
        if (np.diff(self.t) < 0.0).any():
            raise RecordError(f"{self.path / TRAJECTORY_FILE}: times go back from one step to the next")

    def _set_times(self) -> None:
        """Set the times of frames; start and step length from `run.json`, else from the table."""
        self.t = self._at_rows("t", self._first)
        said = self.run.info.get("mission", {})
        self.start, self.dt = float(said.get("start", 0.0)), float(said.get("dt", 1.0))
        if not said and len(self.steps) > 1:
            self.dt = float(self.t[-1] - self.t[0]) / float(self.steps[-1] - self.steps[0])
            self.start = float(self.t[0]) - float(self.steps[0]) * self.dt

    def _at_rows(self, name: str, rows: np.ndarray) -> np.ndarray:
        """Values of a real column in some rows, (n,)."""
        found, order = np.empty(len(rows)), np.argsort(rows, kind="stable")
        edges = np.searchsorted(rows[order], self._starts)
        for number in np.flatnonzero(np.diff(edges)):
            here = order[edges[number] : edges[number + 1]]
            found[here] = self._batches[number][name].to_numpy()[rows[here] - self._starts[number]]
        return found

    def _usual_stride(self) -> int:
        """The largest number of steps between two frames with entities."""
        period, strides = self.run.info.get("period"), np.diff(self.steps)
        if period:
            return max(1, math.ceil(float(period) / self.dt - 1e-9))
        return max(1, int(np.median(strides))) if len(strides) and not self.run.info else 1

    def _add_empty_frames(self) -> None:
        """Add frames without entities, which have no rows in the table."""
        if not len(self.steps):
            return
        stride = self._usual_stride()
        edges = np.concatenate([self.steps, [self._last_step() + 1]])
        gaps = np.flatnonzero(np.diff(edges) > stride)
        n_missing = int((np.diff(edges)[gaps] // stride).sum())
        if n_missing > MAX_EMPTY:
            raise RecordError(
                f"{self.path}: {n_missing:,} frames without entities, by the steps of {RUN_FILE} and {TRAJECTORY_FILE}; "
                f"allowed are {MAX_EMPTY:,}"
            )
        missing = [np.arange(edges[i] + stride, edges[i + 1], stride) for i in gaps]
        end = self._last_step()
        if end > self.steps[-1] and (not missing or missing[-1][-1] != end):
            missing.append(np.array([end]))
        if missing:
            added = np.concatenate(missing)
            steps, nothing = np.concatenate([self.steps, added]), np.zeros(len(added), np.int64)
            order = np.argsort(steps, kind="stable")
            self.steps = steps[order]
            self.t = np.concatenate([self.t, self.start + added * self.dt])[order]
            self._first = np.concatenate([self._first, nothing])[order]
            self._last = np.concatenate([self._last, nothing])[order]

    def _last_step(self) -> int:
        """The last step that was reached."""
        worlds = self.run.info.get("worlds", ())
        said = int(worlds[self.world]["steps"]) if self.world < len(worlds) else 0
        return max(said, int(self.steps[-1]))

    def _name_blocks(self) -> None:
        said = self.run.info.get("mission", {}).get("blocks", [])
        names = [b["name"] for b in said]
        teams = {name: int(b["team"]) for name, b in zip(names, said, strict=True)}
        tables = [batch["block"].dictionary for batch in self._batches]
        if tables and not names:
            names = tables[0].to_pylist()
        if any(table.to_pylist() != names for table in tables):
            raise RecordError(
                f"{self.path / TRAJECTORY_FILE}: the blocks differ from {', '.join(names)}, those of {RUN_FILE} and the first rows"
            )
        self.blocks: list[str] = names
        seen = self._teams_sampled() if self._is_mapped else self._teams_seen()
        for block, team in sorted(seen):
            teams.setdefault(names[block], team)
        self.block_teams: list[int] = [teams.get(name, 0) for name in names]
        by_team: dict[int, list[str]] = {}
        for name, team in [
            *zip(names, self.block_teams, strict=True),
            *((names[b], t) for b, t in sorted(seen)),
        ]:
            of_team = by_team.setdefault(team, [])
            if name not in of_team:
                of_team.append(name)
        self.teams: dict[int, str] = {team: ", ".join(by_team[team]) for team in sorted(by_team)}
        self._plugins = [[p.partition("(")[0] for p in b["plugins"]] for b in said]

    def _teams_seen(self) -> set[tuple[int, int]]:
        """(block, team) of all entities."""
        found: set[tuple[int, int]] = set()
        for number in range(len(self._batches)):
            block, team = (self._array(number, name) for name in ("block", "team"))
            changes = np.flatnonzero((np.diff(block) != 0) | (np.diff(team) != 0)) + 1
            first = np.concatenate([[0], changes]) if len(block) else changes
            found |= set(zip(block[first].tolist(), team[first].tolist(), strict=True))
        return found

    @property
    def _sample(self) -> list[int]:
        """Numbers of the sampled frames."""
        places = np.linspace(0, self.n_frames - 1, min(self.n_frames, MAX_SAMPLED))
        return [int(i) for i in np.unique(places.astype(np.int64))]

    def _teams_sampled(self) -> set[tuple[int, int]]:
        """(block, team) of the entities of the sampled frames."""
        frames = [self.frame(i) for i in self._sample]
        return {pair for f in frames for pair in set(zip(f.block.tolist(), f.team.tolist(), strict=True))}

    # -- frames ---------------------------------------------------------------------------------------------------------------

    @property
    def n_frames(self) -> int:
        return len(self.t)

    @property
    def counts(self) -> np.ndarray:
        """Entities of each frame, (T,)."""
        counts: np.ndarray = self._last - self._first
        return counts

    @property
    def is_complete(self) -> bool:
        """The run was played to its end, and all of it is recorded."""
        return self.run.is_complete

    def frame(self, i: int) -> Frame:
        """The frame by its number; -1 is the last.

        Raises:
            IndexError: There are not so many.
        """
        i = range(self.n_frames)[i]
        first, last = int(self._first[i]), int(self._last[i])
        t, step = float(self.t[i]), int(self.steps[i])
        if first == last:
            return empty_frame(t, step)
        ids, team = (self._column(first, last, name) for name in ("id", "team"))
        block = self._column(first, last, "block")
        pos, quat, vel = (self._columns(first, last, names) for names in (POS, QUAT, VEL))
        if self._is_mapped:
            self._check(step, ids, block, pos, quat)
        return Frame(t, step, ids, team, block, pos, quat, vel, self._column(first, last, "health"))

    @property
    def columns(self) -> dict[str, PluginColumn]:
        """Columns of plugins that were recorded with the states, by name."""
        return self.run.columns

    @cached_property
    def parts(self) -> set[str]:
        """Columns of the table of states that belong to plugins."""
        return {part for column in self.columns.values() for part in column.parts}

    def values(self, i: int, name: str) -> np.ma.MaskedArray[Any, Any]:
        """Values of a column of plugins in a frame, (n, k), in the order of its ids; masked where an entity does not have the column.

        Raises:
            ParameterError: The column was not recorded.
        """
        if name not in self.columns:
            known = self.columns
            raise ParameterError(
                f"{self.path}: no column {name!r} was recorded{nearest_name(name, known)}; {listed(known)}"
            )
        first, n = int(self._first[i]), int(self._last[i] - self._first[i])
        return np.ma.stack(
            [masked(self.run.trajectory_table[part].slice(first, n)) for part in self.columns[name].parts],
            axis=1,
        )

    def _check(
        self, step: int, ids: np.ndarray, block: np.ndarray, pos: np.ndarray, quat: np.ndarray
    ) -> None:
        """Check the rows of a frame of a table that was not checked as a whole.

        Raises:
            RecordError: They are damaged.
        """
        wrong = ""
        if (np.diff(ids) <= 0).any() or ids[0] < 0:
            wrong = "the ids do not ascend from 0 or more"
        elif block.min() < 0 or block.max() >= len(self.blocks):
            wrong = f"there are {len(self.blocks)} blocks, and not a block {block.max()}"
        elif not (np.isfinite(pos).all() and np.isfinite(quat).all()):
            wrong = "a position or an attitude is not finite"
        if wrong:
            raise RecordError(f"{self.path / TRAJECTORY_FILE}: step {step}: {wrong}")

    def team_column(self, i: int) -> np.ndarray:
        """Team of each entity of a frame, (n,)."""
        first, last = int(self._first[i]), int(self._last[i])
        return self._column(first, last, "team") if last > first else np.zeros(0, np.int32)

    def row_of(self, i: int, who: int) -> int:
        """Row of an entity in the table at a frame; -1 if it is not there."""
        first, last = int(self._first[i]), int(self._last[i])
        if first == last:
            return -1
        ids = self._column(first, last, "id")
        place = int(np.searchsorted(ids, who))
        return first + place if place < len(ids) and ids[place] == who else -1

    def values_at(self, rows: np.ndarray, name: str) -> np.ndarray:
        """A column of numbers of the table in some rows, (n,); NaN in those below 0 and where it is null."""
        values = np.full(len(rows), np.nan)
        column = self.run.trajectory_table[name].take(pa.array(rows[rows >= 0]))
        values[rows >= 0] = column.cast(pa.float64()).to_numpy()
        return values

    def at(self, t: float) -> Frame:
        """The last frame that is not after a time [s]; the first for times before it.

        Raises:
            IndexError: There are no frames.
        """
        return self.frame(self.index_at(t))

    def index_at(self, t: float) -> int:
        """Number of the last frame that is not after a time [s], within a millionth of a step; 0 for times before the first."""
        return max(0, int(np.searchsorted(self.t, t + 1e-6 * self.dt, side="right")) - 1)

    def _column(self, first: int, last: int, name: str) -> np.ndarray:
        """Rows [first, last) of a column: a view where they lie in one batch."""
        parts = []
        number = int(np.searchsorted(self._starts, first, side="right")) - 1
        while first < last:
            start, end = int(self._starts[number]), int(self._starts[number + 1])
            parts.append(self._array(number, name)[first - start : min(last, end) - start])
            first, number = min(last, end), number + 1
        return parts[0] if len(parts) == 1 else np.concatenate(parts)

    def _array(self, number: int, name: str) -> np.ndarray:
        """A column of a batch without a copy; of `block` the numbers."""
        key = (number, name)
        if key not in self._arrays:
            column = self._batches[number][name]
            self._arrays[key] = (column.indices if name == "block" else column).to_numpy()
        return self._arrays[key]

    def _columns(self, first: int, last: int, names: tuple[str, ...]) -> np.ndarray:
        """Rows [first, last) of several columns, (rows, columns)."""
        return np.stack([self._column(first, last, name) for name in names], axis=1)

    @cached_property
    def extent(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of a box around all positions [m], each (3,)."""
        if not (self._last > self._first).any():
            return np.zeros(3), np.zeros(3)
        if self._is_mapped:
            pos = np.concatenate([self.frame(i).pos for i in self._sample])
            return pos.min(axis=0, initial=np.inf), pos.max(axis=0, initial=-np.inf)
        is_mine = self._whole("world") == self.world
        columns = [self._whole(name)[is_mine] for name in POS]
        return np.array([c.min() for c in columns]), np.array([c.max() for c in columns])

    @cached_property
    def events(self) -> list[Event]:
        """Births, deaths, captures, collisions and the end, in order."""
        table = self.run.events_table
        mine = table.filter(pa.array(np.asarray(table["world"]) == self.world)) if len(table) else table
        rows = [mine[name].to_pylist() for name in ("t", "kind", "id", "other", "text")]
        found = [Event(*row) for row in zip(*rows, strict=True)]
        return sorted(found, key=lambda event: event.t)

    # -- what is said about the game ------------------------------------------------------------------------------------------

    def watch(self, monitors: Sequence[SpecificationMonitor], margin: float = 1.0) -> None:
        """Show specifications on pages: how far the game is from breaking them, and alarms among the events.

        Args:
            monitors: One for each, such as `tussle.stress.RecordedMonitor`.
            margin: Distance from failure below which there is an alarm, in the SI unit of what is compared.
        """
        self.alarms = SpecificationAlarms(monitors, margin, self.world, self.time_of)
        self.alarms.read(int(self.steps[-1]), True)
        stride = int(np.diff(self.steps, prepend=0).max())
        if stride > 1:
            self.notes.append(
                f"{real_path(self.path).name} has states up to {stride * self.dt:g} s apart; specifications do not know what was between"
            )
        self._add_events(self.alarms.events)

    def mark(self, t: float, text: str) -> None:
        """Mark a moment on the time line of pages.

        Args:
            t: Its time [s].
            text: What there is to say about it.
        """
        self._add_events([Event(t, "mark", 0, 0, text)])

    def _add_events(self, events: Iterable[Event]) -> None:
        self.events = sorted([*self.events, *events], key=lambda event: event.t)

    def time_of(self, step: int) -> float:
        """Time of the start of a step [s]."""
        return self.start + step * self.dt

    @cached_property
    def results(self) -> dict[tuple[str, int | None], tuple[list[float], list[float]]]:
        """Name and team of each score and result that was recorded -> times of its changes [s], and values."""
        found: dict[tuple[str, int | None], tuple[list[float], list[float]]] = {}
        table = self.run.results_table
        for row in table.filter(pc.equal(table["world"], self.world)).to_pylist():
            t, values = found.setdefault((row["name"], row["team"]), ([], []))
            t.append(row["t"])
            values.append(row["value"])
        return found

    # -- shapes of plugins ------------------------------------------------------------------------------------------------------

    @cached_property
    def _shapes(self) -> pa.Table:
        table = self.run.shapes_table
        return table.filter(pa.array(np.asarray(table["world"]) == self.world)) if len(table) else table

    @property
    def has_shapes(self) -> bool:
        """True if shapes that plugins drew were recorded."""
        return len(self._shapes) > 0

    @cached_property
    def _shape_times(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Step, time and lifetime [s] of each shape, (n,) each."""
        step, t, lifetime = (np.asarray(self._shapes[name]) for name in ("step", "t", "lifetime"))
        return step, t, lifetime

    def shapes(self, i: int) -> tuple[Shape, ...]:
        """The shapes that are seen in a frame, in the order in which they were drawn.

        Raises:
            RecordError: A row of the table holds no shape.
        """
        step, t, lifetime = self._shape_times
        now = self.t[i] + 1e-6 * self.dt  # as in `DrawCollector`
        seen = (step < self.steps[i]) & ((step == self.steps[i] - 1) | (now < t + lifetime))
        return tuple(self._shape(int(row), float(t[row])) for row in np.flatnonzero(seen))

    def _shape(self, row: int, t: float) -> Shape:
        kind, text = (self._shapes[name][row].as_py() for name in ("kind", "attributes"))
        try:
            attributes = json.loads(text)
        except (ValueError, RecursionError):
            attributes = None
        if kind not in KINDS or not isinstance(attributes, dict):
            raise RecordError(f"{self.path / SHAPES_FILE}: row {row} of world {self.world} holds no shape")
        return Shape(kind, attributes, t)

    # -- the mission ------------------------------------------------------------------------------------------------------------

    @cached_property
    def _loaded(self) -> Loaded | None:
        path = self.path / MISSION_FILE
        if not path.exists():
            self.notes.append(
                f"{MISSION_FILE} is missing: a mission file cannot hold everything of the mission"
            )
            return None
        try:
            loaded = read_mission(
                real_path(path),
                strict=False,
                plugin_files=self._plugin_files or self._own_plugins(),
                plays=False,
            )
            self.notes.extend(note for note in loaded.notes if "<terrain>" in note or "<map>" in note)
            return loaded
        except TussleError as error:
            first = str(error).splitlines()[0]
            self.notes.append(
                f"{MISSION_FILE} cannot be read, so its colours, bases and boundaries are not shown: {first}"
            )
            return None

    def _own_plugins(self) -> tuple[PluginFile, ...]:
        """The plugin files in the directory, if they are those of a run or batch of the user.

        Raises:
            RecordError: They cannot be read.
        """
        code = DirectoryCode(self.path, copied_plugins(self.path))
        if code.is_own:
            return code.files
        self.notes.append(
            f"the plugin code in {self.path} is not known to be yours, so it is not run: {code}; --plugin-path names files that are"
        )
        return ()

    @property
    def mission(self) -> Mission | None:
        """The mission; None if the run does not hold it or it cannot be read, which `notes` says."""
        return None if self._loaded is None else self._loaded.mission

    @property
    def viewer(self) -> dict[str, Any]:
        """Viewer tags of the mission file, see `tussle.mission.Loaded`; empty without one."""
        return {} if self._loaded is None else self._loaded.viewer

    @property
    def name(self) -> str:
        said = self.run.info.get("mission", {}).get("name")
        return str(said) if said else real_path(self.path).name

    @cached_property
    def style(self) -> Style:
        """Colours and models of the entities."""
        known = {block.name: block for block in self.mission.blocks} if self.mission else {}
        blocks = [known.get(name) for name in self.blocks]
        boxes, views = (
            [b.box if b else None for b in blocks],
            [fields_of_view(b) if b else () for b in blocks],
        )
        return Style(self.blocks, self.block_teams, self._plugins, self.viewer, boxes, views)

    @cached_property
    def scenery(self) -> Scenery:
        """Ground, bases, boundaries and terrain."""
        return scenery_of(self.mission, self.viewer, self.extent, self._ground_map)

    def __len__(self) -> int:
        return self.n_frames

    def __repr__(self) -> str:
        return f"<Recording {str(self.path)!r}, world {self.world}: {self.n_frames} frames>"
