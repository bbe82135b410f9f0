"""The body table: physical state of all entities of all worlds, and quantities derived from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tussle.api import kernels
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric.neighbors.index import Index, Split, padded
from tussle.numeric.neighbors.kernels import update
from tussle.world.rays.bodies import BodyTree

FLOATS = {
    "pos": 3,
    "vel": 3,
    "quat": 4,
    "omega": 3,
    "force": 3,
    "torque": 3,
    "health": 1,
    "radius": 1,
    "mass": 1,
}
INTS = ("id", "team", "world", "block", "block_index")
STORED_INTS = (*INTS, "born")
IN_PLACE = ("health", "force", "torque")
"""Columns that world plugins write in place, without `touch`."""
DERIVED = {"yaw": 1, "climb": 1, "roll": 1, "forward": 3, "level_forward": 2}
N_FLOATS = sum(FLOATS.values())
EVERYWHERE = np.inf
KEPT_RANGES = 1000
"""Maximum number of changed row ranges that are stored."""
KEPT_INDEXES = 32
"""Maximum number of neighbour indexes that are kept, one per reach."""
BRUTE = 600
"""Rows per world up to which a nearest-neighbour search is fast without cells."""

MAX_LENGTH_ERROR = 1e-3
"""Difference from 1 up to which the length of a given quaternion counts as rounded."""

_DERIVING = {name: getattr(kernels, name) for name in DERIVED}
OFFSETS = {name: sum(list(FLOATS.values())[:i]) for i, name in enumerate(FLOATS)}
_COLUMNS = {
    **{name: (OFFSETS[name], k) for name, k in FLOATS.items()},
    **{name: (i, 1) for i, name in enumerate(STORED_INTS)},
    "loads": (OFFSETS["force"], 6),
}
"""First row and number of rows of each column in its storage."""
BODY_UNITS = {
    "pos": "m", "vel": "m/s", "quat": "", "omega": "rad/s", "force": "N", "torque": "N m", "health": "", "radius": "m",
    "mass": "kg", "yaw": "rad", "climb": "rad", "roll": "rad", "forward": "", "level_forward": "",
}  # fmt: skip


def problems_of_states(name: str, values: np.ndarray) -> list[tuple[int, str]]:
    """Items of states given for bodies, (k, m), that are no states, each with what is wrong."""
    found = [
        (int(item), f"{name} is not finite") for item in np.flatnonzero(~np.isfinite(values).all(axis=0))
    ]
    if name == "quat":
        with np.errstate(all="ignore"):
            length = np.sqrt((values * values).sum(axis=0))
        found += [
            (int(item), f"quat has the length {length[item]:.6g}; it takes quaternions of length 1")
            for item in np.flatnonzero(
                np.isfinite(values).all(axis=0) & ~(np.abs(length - 1.0) <= MAX_LENGTH_ERROR)
            )
        ]
    return found


@dataclass(slots=True)
class CachedArrays:
    """Arrays computed from the body table, and the table version that they were computed from."""

    version: int
    columns: Any
    built: int = -1


class Bodies:
    """Rows of all entities, ordered by (group, world, id); components first.

    Attributes:
        floats: Storage of the real columns, (22, n).
        ints: Storage of the integer columns, (6, n).
        n_worlds: Number of worlds.
        n: Number of rows.
        pos: Position [m], (3, n), world frame; likewise vel [m/s], quat (w, x, y, z), omega [rad/s], force [N], torque [N m],
            health, radius [m], mass [kg], and id, team, world, block, block_index.
        loads: Forces and torques, (6, n).
        has_loads: Whether forces and torques may differ from zero.
        born: Step of its world in which each entity was born, (n,); 0 for initial entities.
        scans: Entities move one after another, so that indexes are updated row by row.
        version: Number of the last change, which no later state of the table has again.
        start_pos: While entities move one after another: positions at the start of the step [m], (3, n), which decide who is in range
            of whom; None while the current ones do.
    """

    pos: np.ndarray
    vel: np.ndarray
    quat: np.ndarray
    omega: np.ndarray
    force: np.ndarray
    torque: np.ndarray
    health: np.ndarray
    radius: np.ndarray
    mass: np.ndarray
    id: np.ndarray
    team: np.ndarray
    world: np.ndarray
    block: np.ndarray
    block_index: np.ndarray
    born: np.ndarray
    loads: np.ndarray

    def __init__(self, floats: np.ndarray, ints: np.ndarray, n_worlds: int) -> None:
        self.n_worlds = n_worlds
        self.scans = False
        self.version = -1
        self._laid_out: dict[Any, CachedArrays] = {}
        self.replace(floats, ints)

    @classmethod
    def empty(cls, n: int, n_worlds: int) -> Bodies:
        """Return n rows at the origin, level, with unit mass, radius and health."""
        floats = np.zeros((N_FLOATS, n))
        for name in ("health", "radius", "mass"):
            floats[OFFSETS[name]] = 1.0
        floats[OFFSETS["quat"]] = 1.0
        return cls(floats, np.zeros((len(STORED_INTS), n), np.int64), n_worlds)

    def replace(self, floats: np.ndarray, ints: np.ndarray) -> None:
        """Replace all rows, and discard all derived quantities."""
        self.floats, self.ints = floats, ints
        self.has_loads = True
        self.n = floats.shape[1]
        for name in _COLUMNS:
            self.__dict__.pop(name, None)
        self.version += 1
        self._oldest = self._replaced = self.version
        self._touched: list[tuple[int, int]] = []
        self._derived: dict[str, CachedArrays] = {}
        self._newest: CachedArrays | None = None
        for kept in self._laid_out.values():
            kept.columns = kept.columns[:1]  # not the positions, which would hold the old table in memory
        self.start_pos: np.ndarray | None = None
        self._started = self.version
        self._layout: tuple[np.ndarray, ...] | None = None
        self._tree: tuple[int, BodyTree] | None = None
        self._read_only: BodyView | None = None

    def __getattr__(self, name: str) -> np.ndarray:
        """A column: a view of the storage, created on first access."""
        if name not in _COLUMNS:
            raise AttributeError(f"Bodies has no {name!r}")
        first, k = _COLUMNS[name]
        storage = self.ints if name in STORED_INTS else self.floats
        column = self.__dict__[name] = storage[first : first + k] if k > 1 else storage[first]
        return column

    @property
    def view(self) -> BodyView:
        """Read-only view of the table, for plugins."""
        if self._read_only is None:
            self._read_only = BodyView(self)
        return self._read_only

    def touch(self, first: int, last: int) -> None:
        """Mark rows [first, last) as changed."""
        self.version += 1
        if self.scans:  # ranges are needed only if entities move one after another
            self._touched.append((first, last))
            if len(self._touched) > KEPT_RANGES:
                self._oldest = self.version
                self._touched.clear()

    def clear_loads(self) -> None:
        """Set all forces and torques to zero."""
        if self.has_loads:
            self.loads.fill(0.0)
            self.has_loads = False

    def _since(self, version: int) -> list[tuple[int, int]]:
        """Row ranges that have changed since a version of the table."""
        if not self.scans or version < self._oldest:
            return [(0, self.n)]
        return self._touched[version - self._oldest :]

    def derived(self, name: str) -> np.ndarray:
        """Return yaw, climb, roll [rad], (n,), forward, (3, n), or level_forward, (2, n), of the current attitudes."""
        kept = self._derived.get(name)
        if kept is None:
            k = DERIVED[name]
            kept = self._derived[name] = CachedArrays(-1, np.empty((k, self.n) if k > 1 else self.n))
        if kept.version != self.version:
            for first, last in self._since(kept.version):
                derive(name, self.quat, first, last, 0, kept.columns)
            kept.version = self.version
        return kept.columns  # type: ignore[no-any-return]

    # -- rows by id and by position -----------------------------------------------------------------------------------------------------

    def layout(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Return members, world_start, id_row, id_start: rows by (world, id), and the row of each id so far, -1 if removed."""
        if self._layout is None:
            id_start = np.zeros(self.n_worlds + 1, np.int64)
            kernels.count_ids(self.world, self.id, id_start)
            id_row = np.full(id_start[-1], -1, np.int64)
            members = np.empty(self.n, np.int64)
            world_start = np.zeros(self.n_worlds + 1, np.int64)
            kernels.lay_out(self.world, self.id, id_start, id_row, members, world_start)
            self._layout = members, world_start, id_row, id_start
        return self._layout  # type: ignore[return-value]

    def rows_of(self, world: np.ndarray, ids: np.ndarray) -> np.ndarray:
        """Row of each (world, id), (m,); -1 for id 0 and for removed entities."""
        ids = np.asarray(ids)
        if ids.shape != world.shape or (ids.dtype.kind not in "iu" and ids.size):
            raise ParameterError(
                f"ids = an array of {ids.dtype}, {ids.shape} is not allowed; it takes whole numbers, {world.shape}"
            )
        _, _, id_row, id_start = self.layout()
        rows = np.empty(len(ids), np.int64)
        kernels.find_rows(world, np.ascontiguousarray(ids, np.int64), id_row, id_start, rows)
        return rows

    def index(self, reach: float | np.ndarray, split: Split | None = None) -> Index:
        """Neighbour index of the current positions for queries up to `reach` [m], one number or one per world.

        `split` calls a function for parts of the rows in several threads.
        """
        return self.refreshed(self.laid_out(reach), split)

    def laid_out(self, reach: float | np.ndarray) -> CachedArrays:
        """Neighbour index for `reach` [m], and the arrays that it is built from; valid until the next `replace`.

        The table may discard it and make another one for the same reach. Who has it may go on using it, and its columns.
        """
        if self.scans:
            reach = EVERYWHERE
        key = reach if isinstance(reach, float) else reach.tobytes()
        kept = self._laid_out.pop(key, None) or CachedArrays(-1, (Index(),))
        self._laid_out[key] = kept  # the most recently used is last
        if len(self._laid_out) > KEPT_INDEXES:
            del self._laid_out[next(iter(self._laid_out))]
        if kept.built != self._replaced:
            index = kept.columns[0]
            index.layout(self.world, self.id, self.n_worlds)
            reaches = np.full(self.n_worlds, reach) if isinstance(reach, float) else reach
            kept.version, kept.built, kept.columns = -1, self._replaced, (index, reaches, *self.pos)
        return kept

    def refreshed(self, kept: CachedArrays, split: Split | None) -> Index:
        """The neighbour index of `laid_out`, built again if entities have moved."""
        if kept.version != self.version:
            index, reaches, x, y, z = kept.columns
            ranges = self._since(kept.version) if self.scans and kept.version >= 0 else [(0, self.n)]
            if ranges == [(0, self.n)]:
                index.build(x, y, z, reaches, split)
            else:
                for first, last in ranges:
                    index.update(first, last, x, y, z)
            kept.version = self.version
        self._newest = kept
        return kept.columns[0]  # type: ignore[no-any-return]

    def chained(self, kept: CachedArrays, names: Sequence[str]) -> list[tuple[Any, ...]]:
        """The kernels that put columns by place of the index of `laid_out`, with their arguments, valid until the next `replace`."""
        index, values = kept.columns[0], self._values
        return [
            c for k in names for c in putting(k, values(k), index.place, index.columns[k].columns, 0, self.n)
        ]

    def has_chained(self, kept: CachedArrays, names: Sequence[str]) -> None:
        """Note that the kernels of an index and of `chained` have run for the current positions."""
        self._newest, kept.version = kept, self.version
        index = kept.columns[0]
        for name in names:
            column = index.columns[name]
            column.version, column.built = self.version, index.built

    def moved(self, kept: CachedArrays, names: Sequence[str]) -> list[tuple[Any, ...]]:
        """As `chained`, for rows that move: the kernels take a range of rows; with the place of its first argument before each."""
        index, _, *pos = kept.columns
        calls: list[tuple[Any, ...]] = [(0, update, 0, self.n, *pos, index.place, index.points)]
        for name in names:
            if name in DERIVED and name != "level_forward":
                calls.append((1, _DERIVING[name], self.quat, 0, self.n, 0, self.derived(name)))
            put = putting(name, self._values(name), index.place, index.columns[name].columns, 0, self.n)
            calls += [(1, *call) for call in put]
        return calls

    def rows_moved(self, kept: CachedArrays, names: Sequence[str]) -> tuple[int, int] | None:
        """The only range of rows that has changed since an index and columns by its places were current; None if there is no such one."""
        columns, version = kept.columns[0].columns, kept.version
        for name in names:
            if columns[name].version != version or (
                name in self._derived and self._derived[name].version != version
            ):
                return None
        ranges = self._since(version)
        return ranges[0] if len(ranges) == 1 else None

    def has_moved(self, kept: CachedArrays, names: Sequence[str]) -> None:
        """Note that the kernels of `moved` have run."""
        version = self.version
        self._newest, kept.version = kept, version
        columns = kept.columns[0].columns
        for name in names:
            columns[name].version = version
            if name in self._derived:
                self._derived[name].version = version

    def tree(self, boxes: np.ndarray) -> BodyTree:
        """Tree over the current bodies, for rays; boxes: lengths by block [m], (n_blocks, 3), 0 for spheres."""
        if self._tree is None or self._tree[0] != self.version:
            members, world_start, _, _ = self.layout()
            states = self.pos, self.quat, self.radius
            self._tree = self.version, BodyTree(states, (self.block, boxes), members, world_start)
        return self._tree[1]

    def by_place(self, index: Index, name: str, split: Split | None = None) -> tuple[np.ndarray, ...]:
        """Components of a column by place of an index, as floats, each (n,), padded for lanes; for kernels.

        `split` calls a function for parts of the rows in several threads.
        """
        kept = index.columns.get(name)
        if kept is None:
            k = DERIVED.get(name) or FLOATS.get(name, 1)
            kept = index.columns[name] = CachedArrays(-1, tuple(padded(self.n) for _ in range(k)))
        is_current = name in INTS or (kept.version == self.version and name not in IN_PLACE)
        if kept.built == index.built and is_current:
            return kept.columns  # type: ignore[no-any-return]
        values = self._values(name)
        if split is not None and kept.built != index.built:
            split(self.n, lambda *part: put_by_place(name, values, index.place, kept.columns, *part))
        else:
            is_known = kept.built == index.built and name not in IN_PLACE
            for part in self._since(kept.version) if is_known else [(0, self.n)]:
                put_by_place(name, values, index.place, kept.columns, *part)
        kept.version, kept.built = self.version, index.built
        return kept.columns  # type: ignore[no-any-return]

    def _values(self, name: str) -> np.ndarray:
        """A column as `putting` takes it."""
        if name == "level_forward":
            return self.quat  # computed on the way to the places
        return self.derived(name) if name in DERIVED else getattr(self, name)

    def keep_start(self) -> None:
        """Let the current positions decide who is in range of whom until `end_start`."""
        self.start_pos, self._started = self.pos.copy(), self.version

    def end_start(self) -> None:
        """Let positions decide who is in range as they change."""
        self.start_pos = None

    def range_points(self, index: Index) -> np.ndarray:
        """Positions by place of an index that decide who is in range [m], (3, n + LANES)."""
        if self.start_pos is None:
            return index.points
        kept = index.columns.get("start_pos")
        if kept is None:
            kept = index.columns["start_pos"] = CachedArrays(-1, np.zeros_like(index.points))
        if kept.version != self._started or kept.built != index.built:
            put_by_place("pos", self.start_pos, index.place, tuple(kept.columns), 0, self.n)
            kept.version, kept.built = self._started, index.built
        return kept.columns  # type: ignore[no-any-return]

    def any_index(self) -> Index:
        """Index for searches without a radius, preferably an existing one; results do not depend on the choice."""
        newest = self._newest
        if newest is None or newest.version != self.version:
            return self.index(self.usual_reach())
        return newest.columns[0]  # type: ignore[no-any-return]

    def usual_reach(self) -> float:
        """Reach for searches without a radius [m]: of an existing index, infinite for few rows, otherwise chosen by density."""
        known = [
            k for k, kept in self._laid_out.items() if isinstance(k, float) and kept.version == self.version
        ]
        if known:
            return max(known)
        if self.n <= BRUTE * self.n_worlds:
            return EVERYWHERE
        x, y, _ = self.pos[:, self.world == self.world[0]]
        area = (x.max() - x.min() + 1.0) * (y.max() - y.min() + 1.0)
        return float(2.0 ** np.ceil(np.log2(np.sqrt(64.0 * area / len(x)) + 1.0)))


def put_by_place(
    name: str, values: np.ndarray, place: np.ndarray, columns: tuple[np.ndarray, ...], first: int, last: int
) -> None:
    """Write the values of rows [first, last) to columns by place; for level_forward, `values` are quaternions (4, n)."""
    for run, *arguments in putting(name, values, place, columns, first, last):
        run(*arguments)


def putting(
    name: str, values: np.ndarray, place: np.ndarray, columns: tuple[np.ndarray, ...], first: int, last: int
) -> list[tuple[Any, ...]]:
    """The kernels of `put_by_place`, with their arguments."""
    if name == "level_forward":
        return [(kernels.level_forward_by_place, values, first, last, place, *columns)]
    if name in INTS:
        return [(kernels.ints_by_place, values, first, last, place, columns[0])]
    sources = zip(columns, np.atleast_2d(values), strict=True)
    return [(kernels.floats_by_place, source, first, last, place, column) for column, source in sources]


def derive(name: str, quat: np.ndarray, first: int, last: int, base: int, out: np.ndarray) -> None:
    """Write yaw, climb, roll, forward or level_forward of quaternions [first, last) to out, (n,) or (k, n), from first - base on."""
    _DERIVING[name](quat, first, last, base, out)


def derived_from(name: str, quat: np.ndarray) -> np.ndarray:
    """Return yaw, climb, roll [rad], (n,), forward, (3, n), or level_forward, (2, n), of quaternions (4, n)."""
    k, n = DERIVED[name], quat.shape[1]
    out = np.empty((k, n) if k > 1 else n)
    derive(name, np.ascontiguousarray(quat), 0, n, 0, out)
    return out


def read_only(array: np.ndarray) -> np.ndarray:
    """Return a read-only view of an array."""
    view = array[...]
    view.flags.writeable = False
    return view


class BodyView:
    """Read-only body table: the columns of `Bodies`, and yaw, climb, roll, forward and level_forward."""

    def __init__(self, bodies: Bodies) -> None:
        self._bodies = bodies
        self.n = bodies.n

    def __getattr__(self, name: str) -> Any:
        if name in FLOATS or name in INTS:
            array = read_only(getattr(self._bodies, name))
            self.__dict__[name] = array
            return array
        if name in DERIVED:
            return read_only(self._bodies.derived(name))
        allowed = [*FLOATS, *INTS, *DERIVED]
        raise AttributeError(
            f"bodies have no column {name!r}{nearest_name(name, allowed)}; {listed(allowed)}"
        )
