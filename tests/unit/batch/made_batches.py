"""Batches whose results are known, in the tables that a played batch has."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from tussle.batch import finished_runs, schemas
from tussle.batch.plan import BatchPlan
from tussle.batch.store import StoredBatch
from tussle.batch.tasks import Finished
from tussle.batch.variables import Variable
from tussle.batch.varied import variable_entry
from tussle.record.run_file import plain, put_whole

TEAMS = {1: "prey", 2: "keepers", 3: "switchers"}
START = {1: 50, 2: 5, 3: 5}


def made_batch(
    scores: Mapping[int, Any],
    *,
    variables: Sequence[Variable] = (),
    points: Sequence[Mapping[str, Any]] = ({},),
    metrics: Mapping[str, Any] | None = None,
    alive: Mapping[int, list[tuple[int, float, int]]] | None = None,
    failed: Mapping[int, str] | None = None,
    missing: Sequence[int] = (),
    sample: str = "",
    independent: bool = False,
    hashes: Mapping[int, str] | None = None,
) -> StoredBatch:
    """A batch with given results.

    Args:
        scores: Score of each team, by seed and point, (n_seeds, n_points); none for games without scores.
        variables: What varies.
        points: Its values.
        metrics: What plugins report: name -> {team or None: by seed and point}; of the world as None.
        alive: Run -> (team, t, entities left); by default a third of the first team is left after 30 s.
        failed: Run -> what went wrong.
        missing: Runs that are not finished.
        sample: How the points were sampled.
        independent: Each run has a seed of its own.
        hashes: Run -> hash of its final state; by default all are different.
    """
    failed, metrics, alive = failed or {}, metrics or {}, alive or {}
    by_run = {team: np.asarray(values, dtype=float).ravel() for team, values in scores.items()}
    shapes = [np.shape(v) for v in scores.values()] + [
        np.shape(v) for of in metrics.values() for v in of.values()
    ]
    plan = BatchPlan(list(points), shapes[0][0], first_seed=1, independent=independent)
    rows = [
        finished_runs.row(_finished(run, by_run, metrics, alive, failed))
        for run in range(plan.n_runs)
        if run not in missing
    ]
    played = pa.Table.from_batches(rows, schemas.PLAYED)
    if hashes:
        own = [
            hashes.get(run, old)
            for run, old in zip(played["run"].to_pylist(), played["state_hash"].to_pylist(), strict=True)
        ]
        played = played.set_column(played.schema.names.index("state_hash"), "state_hash", pa.array(own))
    finished = finished_runs.tables(played, plan.table())
    info = {
        "format": 1, "tussle": "0.1", "name": "A made game", "mission": {"made_in": "python"}, "sample": sample, "sample_seed": 0,
        "variables": [variable_entry(v) for v in variables], "n_points": plan.n_points, "n_seeds": plan.n_seeds, "first_seed": 1,
        "independent": independent, "until": None, "n_runs": plan.n_runs, "stopped_by": None, "command": [], "versions": {},
        "is_complete": not missing, "timings": {"wall_s": 1.0, "cpu_s": 1.0},
        "teams": {str(team): name for team, name in TEAMS.items()}, "dt": 0.1, "start": 0.0, "end": 100.0,
    }  # fmt: skip
    return StoredBatch(None, info, plan.table(), [finished])


def _finished(
    run: int,
    scores: Mapping[int, np.ndarray],
    metrics: Mapping[str, Any],
    alive: Mapping[int, Any],
    failed: Mapping[int, str],
) -> Finished:
    counts = alive.get(run, [(1, 0.0, 50), (1, 30.0, 17), (1, 100.0, 17), *_unchanged()])
    left, first = {team: n for team, _, n in counts}, {team: n for team, _, n in reversed(counts)}
    found: list[tuple[int | None, str, float]] = [(team, "start", float(n)) for team, n in first.items()]
    found += [(team, "alive", float(n)) for team, n in left.items()]
    found += [(team, "score", float(values[run])) for team, values in scores.items()]
    for name, of in metrics.items():
        found += [(team, name, float(np.ravel(values)[run])) for team, values in of.items()]
    best = sorted(((float(values[run]), team) for team, values in scores.items()), reverse=True)
    winner = best[0][1] if len(best) > 1 and best[0][0] > best[1][0] else None
    end, t = "time", max(t for _, t, _ in counts)
    if run in failed:
        end, winner, found = "error", None, [(team, name, np.nan) for team, name, _ in found]
    return Finished(
        run,
        end,
        t,
        round(10 * t),
        winner,
        f"{run:016x}",
        failed.get(run, ""),
        1.0 + run % 7,
        "here",
        found,
        list(counts),
    )


def _unchanged() -> list[tuple[int, float, int]]:
    return [(team, t, START[team]) for team in (2, 3) for t in (0.0, 100.0)]


def with_table(stored: StoredBatch, table: pa.Table, design: pa.Table | None = None) -> StoredBatch:
    """The batch with other results."""
    return StoredBatch(
        None, stored.info, stored.design if design is None else design, [(table, stored.alive)]
    )


def write_batch(stored: StoredBatch, path: Path) -> Path:
    """Put a batch into a directory."""
    path.mkdir(parents=True)
    put_whole(path / schemas.BATCH_FILE, json.dumps(plain(stored.info)))
    for name, table in (
        (schemas.DESIGN_FILE, stored.design), (schemas.RESULTS_FILE, stored.table), (schemas.ALIVE_FILE, stored.alive)
    ):  # fmt: skip
        pq.write_table(table, path / name)
    return path
