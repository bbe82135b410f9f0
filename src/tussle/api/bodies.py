"""The body table: the physical state of all entities of all worlds, and what is derived from it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tussle.api import kernels
from tussle.errors import listed, nearest_name
from tussle.neighbors.index import Index

FLOATS = {"pos": 3, "vel": 3, "quat": 4, "omega": 3, "force": 3, "torque": 3, "health": 1, "radius": 1, "mass": 1}
INTS = ("id", "team", "world", "block", "place_in_block")
DERIVED = {"yaw": 1, "climb": 1, "roll": 1, "forward": 3, "level_forward": 2}
N_FLOATS = sum(FLOATS.values())
EVERYWHERE = np.inf
BRUTE = 600
"""Rows per world up to which a search for the nearest needs no cells."""

_OFFSETS = {name: sum(list(FLOATS.values())[:i]) for i, name in enumerate(FLOATS)}
_UNITS = {"pos": "m", "vel": "m/s", "quat": "", "omega": "rad/s", "force": "N", "torque": "N m", "radius": "m", "mass": "kg"}


@dataclass
class ByPlace:
    """A column in the order of an index, and which rows have changed since."""

    built: int
    columns: list[np.ndarray]
    stale: list[tuple[int, int]] = field(default_factory=list)


class Bodies:
    """Rows of all entities, ordered by (group, world, id); components first.

    Attributes:
        floats: Storage of the real columns, (22, n).
        ints: Storage of the whole-number columns, (5, n).
        n_worlds: Number of worlds; world numbers in the table are below it.
        n: Number of rows.
        pos: Position [m], (3, n), world frame; likewise vel [m/s], quat (w, x, y, z), omega [rad/s], force [N], torque [N m],
            health, radius [m], mass [kg], and id, team, world, block, place_in_block.
    """

    def __init__(self, floats: np.ndarray, ints: np.ndarray, n_worlds: int) -> None:
        self.n_worlds = n_worlds
        self.scans = False
        self.replace(floats, ints)

    @classmethod
    def empty(cls, n: int, n_worlds: int) -> Bodies:
        """n rows at the origin, unit mass and health, level."""
        floats = np.zeros((N_FLOATS, n))
        for name in ("health", "radius", "mass"):
            floats[_OFFSETS[name]] = 1.0
        floats[_OFFSETS["quat"]] = 1.0
        return cls(floats, np.zeros((len(INTS), n), np.int64), n_worlds)

    def replace(self, floats: np.ndarray, ints: np.ndarray) -> None:
        """Take other rows; everything that was derived from the old ones is dropped."""
        self.floats, self.ints = floats, ints
        self.n = floats.shape[1]
        own = self.__dict__
        for name, k in FLOATS.items():
            first = _OFFSETS[name]
            own[name] = floats[first : first + k] if k > 1 else floats[first]
        for i, name in enumerate(INTS):
            own[name] = ints[i]
        self._derived: dict[str, np.ndarray] = {}
        self._pending: dict[str, list[tuple[int, int]]] = {}
        self._indexes: dict[Any, Index] = getattr(self, "_indexes", {})
        self._stale: dict[Any, list[tuple[int, int]]] = {}
        self._laid_out: set[Any] = set()
        self._by_place: dict[tuple[int, str], ByPlace] = {}
        self._layout: tuple[np.ndarray, ...] | None = None
        self._read_only: BodyView | None = None

    @property
    def view(self) -> BodyView:
        """The table as plugins see it."""
        if self._read_only is None:
            self._read_only = BodyView(self)
        return self._read_only

    def touch(self, first: int, last: int) -> None:
        """Rows [first, last) have moved or turned."""
        for pending in self._pending.values():
            pending.append((first, last))
        for stale in self._stale.values():
            stale.append((first, last))
        for sorted_ in self._by_place.values():
            sorted_.stale.append((first, last))

    def derived(self, name: str) -> np.ndarray:
        """yaw, climb, roll [rad], (n,), or forward, (3, n), up to date."""
        pending = self._pending.get(name)
        if pending is None:
            k = DERIVED[name]
            self._derived[name] = np.empty((k, self.n) if k > 1 else self.n)
            self._pending[name] = pending = [(0, self.n)]
        if pending:
            out, q = self._derived[name], self.quat
            whole = sum(last - first for first, last in pending) >= self.n
            for a, b in [(0, self.n)] if whole else pending:
                derive(name, q[:, a:b], out[..., a:b])
            pending.clear()
        return self._derived[name]

    # -- who is where -----------------------------------------------------------------------------------------------------

    def layout(self) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """(members, world_start, id_row, id_start): rows by (world, id), and the row of each id that ever lived, -1 when gone."""
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
        """Row of each (world, id), (m,); -1 for id 0 and for those that are gone."""
        _, _, id_row, id_start = self.layout()
        rows = np.empty(len(ids), np.int64)
        kernels.find_rows(np.ascontiguousarray(world, np.int64), np.ascontiguousarray(ids, np.int64), id_row, id_start, rows)
        return rows

    def index(self, reach: float | np.ndarray) -> Index:
        """Neighbour index good for queries up to `reach` [m], one number or one per world, at the positions of now."""
        if self.scans:
            reach = EVERYWHERE
        key = reach if isinstance(reach, float) else reach.tobytes()
        index = self._indexes.get(key)
        if index is None:
            index = self._indexes[key] = Index()
        if key not in self._laid_out:
            index.layout(self.world, self.id, self.n_worlds)
            self._laid_out.add(key)
            self._stale[key] = [(0, self.n)]
        stale = self._stale[key]
        if stale:
            x, y, z = self.pos
            moved = sum(last - first for first, last in stale)
            if self.scans and moved < self.n:
                for first, last in stale:
                    index.update(np.arange(first, last), x[first:last], y[first:last], z[first:last])
            else:
                index.build(x, y, z, np.full(self.n_worlds, reach) if isinstance(reach, float) else reach)
            stale.clear()
        return index


    def by_place(self, index: Index, name: str) -> list[np.ndarray]:
        """Components of a column in the order of an index's places, as floats, each (n,) and padded for lanes; for kernels."""
        key = (id(index), name)
        kept = self._by_place.get(key)
        if kept is not None and kept.built == index.built and (not kept.stale or name == "team"):
            return kept.columns
        source = np.atleast_2d(self.derived(name) if name in DERIVED else getattr(self, name))
        if kept is not None and kept.built == index.built and self.scans and sum(b - a for a, b in kept.stale) < self.n:
            for first, last in kept.stale:
                places = index.place[first:last]
                for column, values in zip(kept.columns, source, strict=True):
                    column[places] = values[first:last]
            kept.stale.clear()
            return kept.columns
        columns = [index.gather(values.astype(np.float64, copy=False)) for values in source]
        self._by_place[key] = ByPlace(index.built, columns)
        return columns

    def usual_reach(self) -> float:
        """A reach for searches that need none: of an index that is up to date, else all, else one that suits the density [m]."""
        known = [k for k in self._laid_out if isinstance(k, float) and not self._stale[k]]
        if known:
            return max(known)
        if self.n <= BRUTE * self.n_worlds:
            return EVERYWHERE
        x, y, _ = self.pos[:, self.world == self.world[0]]
        area = (x.max() - x.min() + 1.0) * (y.max() - y.min() + 1.0)
        return float(2.0 ** np.ceil(np.log2(np.sqrt(64.0 * area / len(x)) + 1.0)))


def derive(name: str, quat: np.ndarray, out: np.ndarray) -> None:
    """Fill out with yaw, climb, roll (n,) or forward (3, n) of the quaternions (4, n)."""
    if name in ("forward", "level_forward"):
        getattr(kernels, name)(*quat, *out)
    else:
        getattr(kernels, name)(*quat, out)


def read_only(array: np.ndarray) -> np.ndarray:
    view = array[...]
    view.flags.writeable = False
    return view


class BodyView:
    """The body table, read-only; the columns of `Bodies` and the derived yaw, climb, roll and forward."""

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
        raise AttributeError(f"bodies have no column {name!r}{nearest_name(name, allowed)}; {listed(allowed)}")
