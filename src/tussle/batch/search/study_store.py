"""The directory of a search: what is searched, and all whole rounds."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import Any, Self

import pyarrow as pa
import pyarrow.parquet as pq

from tussle.batch.consistency import MOST_VALUE
from tussle.batch.plan import MOST_RUNS
from tussle.batch.schemas import SEED, VARIABLE
from tussle.batch.search.proposals import SAMPLERS
from tussle.batch.search.study import Study
from tussle.batch.search.trials import (
    FACTS,
    MOST_TRIALS,
    Trial,
    column_name,
    column_type,
    trials_of,
    trials_table,
)
from tussle.batch.store import locked, told
from tussle.batch.variables import Range, Variable
from tussle.batch.varied import variable_of
from tussle.documents import Document, Map, Whole
from tussle.errors import BatchError
from tussle.record.parquet_file import read_parquet
from tussle.record.run_file import plain, put_whole, versions
from tussle.record.table_values import COUNT, TEXT, Bounds, check_values

STUDY = Document(
    "the search",
    1,
    {
        "variables": [VARIABLE],
        "name": str,
        "fingerprint": str,
        "objective": str,
        "direction": ("maximize", "minimize"),
        "runs": Whole(1, MOST_RUNS),
        "first_seed": SEED,
        "sampler": SAMPLERS,
        "sample_seed": Whole(),
        "per_round": Whole(1),
        "versions": Map(str),
    },
    BatchError,
)
"""What `study.json` says."""
_MEAN = Bounds(-MOST_VALUE, MOST_VALUE, may_miss=True)
RULES = {
    "objective": _MEAN,
    "low": _MEAN,
    "high": _MEAN,
    "trial": COUNT,
    "round": COUNT,
    "n_failed": COUNT,
    "state": TEXT,
}
"""Of the table of trials."""
STUDY_FILE, TRIALS_FILE, LOCK = "study.json", "trials.parquet", "lock"

COMPARED = (
    "tussle", "name", "mission", "objective", "direction", "variables", "runs", "first_seed", "sampler", "sample_seed", "per_round",
)  # fmt: skip
"""What a search is told apart by, in the order in which differences are named."""


PROPOSED_BY = ("optuna", "cmaes", "numpy", "scipy")
"""Packages on whose versions it depends what is tried."""


class StudyStore:
    """A directory into which one search writes; nobody else does meanwhile.

    The table of trials is replaced after each round, so that a round is there whole or not at all.

    Args:
        path: The directory; made if need be.
        info: What is searched.

    Attributes:
        info: What `study.json` says.

    Raises:
        BatchError: It holds another search or something else, or another process writes there.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path, info: Mapping[str, Any]) -> None:
        self.path = path
        own = (STUDY_FILE, TRIALS_FILE, LOCK)
        with told(path):
            path.mkdir(parents=True, exist_ok=True)
            foreign = [p.name for p in path.iterdir() if p.name.removesuffix(".part") not in own]
            if foreign and not (path / STUDY_FILE).exists():
                raise BatchError(
                    f"{path}: holds something that is no search ({min(foreign)}); choose another directory"
                )
        self._lock = locked(path, "at this search")
        try:
            self.info = self._agreed(dict(plain(info)))
        except BaseException:
            self._lock.close()
            raise

    def _agreed(self, info: dict[str, Any]) -> dict[str, Any]:
        """What the directory says; written down where it says nothing yet."""
        if not (self.path / STUDY_FILE).exists():
            with told(self.path):
                put_whole(self.path / STUDY_FILE, json.dumps(info, indent=1, allow_nan=False) + "\n")
            return info
        before = read_info(self.path)
        if any(before.get(name) != info[name] for name in (*COMPARED, "fingerprint")):
            raise BatchError(
                f"{self.path}: holds another search ({_difference(before, info)}); choose another directory, or remove it"
            )
        return before

    def put(self, trials: Sequence[Trial], variables: Sequence[Variable]) -> None:
        """Put the table of all trials in its place."""
        table = trials_table(trials, variables)
        draft = self.path / f"{TRIALS_FILE}.part"
        with told(self.path):
            try:
                draft.unlink(missing_ok=True)
                pq.write_table(table, draft, compression="zstd")
                draft.replace(self.path / TRIALS_FILE)
            except OSError:
                draft.unlink(missing_ok=True)
                raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()


def _difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """In which words two searches differ."""
    for name in COMPARED:
        if before.get(name) != now[name]:
            if isinstance(now[name], (str, int)):
                return f"its {name} is {before.get(name)!r}, not {now[name]!r}"
            return f"it differs in {name}"
    return "the mission or a plugin file has changed since"


def read_info(path: Path) -> dict[str, Any]:
    """What `study.json` of a directory says.

    Raises:
        BatchError: There is no search, or one that cannot be read.
    """
    file = path / STUDY_FILE
    if not path.is_dir():
        raise BatchError(f"{path}: there is no such directory")
    if not file.exists():
        raise BatchError(f"{path}: this is no directory of a search; it has no {STUDY_FILE}")
    return STUDY.read(file)


def read_trials(path: Path, info: Mapping[str, Any]) -> list[Trial]:
    """All trials of whole rounds.

    Args:
        path: The directory.
        info: What `study.json` says.

    Raises:
        BatchError: They cannot be read.
    """
    file = path / TRIALS_FILE
    if not file.exists():
        return []
    variables = [variable_of(said) for said in info["variables"]]
    wanted = [(column_name(v), column_type(v)) for v in variables]
    table = read_parquet(file, pa.schema([*FACTS, *wanted]), BatchError, most_rows=MOST_TRIALS)
    tried = {column_name(v): Bounds(v.low, v.high) if isinstance(v, Range) else TEXT for v in variables}
    check_values(zip(table.column_names, table.columns, strict=True), RULES | tried, file, BatchError)
    try:
        trials = trials_of(table, variables)
    except (KeyError, TypeError) as error:
        raise BatchError(f"{file}: cannot be read: {error}") from None
    for i, trial in enumerate(trials):
        if trial.low > trial.high or math.isnan(trial.low) != math.isnan(trial.high):
            raise BatchError(f"{file}: low = {trial.low} in row {i} is not allowed; high is {trial.high}")
        if trial.number != i:
            raise BatchError(f"{file}: trial = {trial.number} in row {i} is not allowed; it is {i}")
        n_games = len(trial.by_seed)
        if n_games != info["runs"] and (n_games or trial.is_complete):
            raise BatchError(f"{file}: trial {i} has {n_games} games; study.json says {info['runs']}")
    return trials


def load_study(path: str | Path) -> Study:
    """A search as far as it has come; also while it goes on.

    Raises:
        BatchError: There is none, or it cannot be read.
    """
    path = Path(path)
    info = read_info(path)
    variables = tuple(variable_of(said) for said in info["variables"])
    return Study(path, info, variables, tuple(read_trials(path, info)))


def versions_of_samplers() -> dict[str, str]:
    """Of Python and of the packages that results and proposals depend on."""
    found = versions()
    for name in PROPOSED_BY:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # cmaes, where another sampler proposes
            found[name] = ""
    return found


def notes_on_versions(before: Mapping[str, Any], now: Mapping[str, Any], n: int) -> list[str]:
    """What is to be said where the trials so far were proposed by other versions."""
    then, today = before.get("versions", {}), now["versions"]
    changed = [
        f"{name} {then.get(name)}, now {today[name]}" for name in PROPOSED_BY if then.get(name) != today[name]
    ]
    if not changed or not n:
        return []
    return [
        f"the search was begun with {'; '.join(changed)}: trials from {n} on may differ from those of a search without a break"
    ]
