"""The directory of a search: what is searched, and all whole rounds."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import IO, Any, Self

import pyarrow as pa
import pyarrow.parquet as pq

from tussle.batch.search.study import Study
from tussle.batch.search.trials import Trial, trials_of, trials_table
from tussle.batch.store import told
from tussle.batch.variables import Choice, Range, Variable
from tussle.errors import BatchError
from tussle.record.run_file import plain, put_whole, versions

FORMAT = 1
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
            self._lock: IO[str] = (path / LOCK).open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            self._lock.close()
            raise BatchError(f"{path}: another process is at this search") from None
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
        if before.get("fingerprint") != info["fingerprint"]:
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
    if not file.is_file():
        raise BatchError(f"{path}: this is no directory of a search; it has no {STUDY_FILE}")
    try:
        info = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise BatchError(f"{file}: cannot be read: {error}") from None
    if not isinstance(info, dict) or info.get("format") != FORMAT:
        found = info.get("format") if isinstance(info, dict) else None
        raise BatchError(f"{file}: the search has format {found!r}; this tussle reads format {FORMAT}")
    return info


def read_trials(path: Path, variables: Sequence[Variable]) -> list[Trial]:
    """All trials of whole rounds.

    Raises:
        BatchError: They cannot be read.
    """
    file = path / TRIALS_FILE
    if not file.exists():
        return []
    try:
        return trials_of(pq.read_table(file), variables)
    except (OSError, KeyError, TypeError, pa.ArrowException) as error:
        raise BatchError(f"{file}: cannot be read: {error}") from None


def load_study(path: str | Path) -> Study:
    """A search as far as it has come; also while it goes on.

    Raises:
        BatchError: There is none, or it cannot be read.
    """
    path = Path(path)
    info = read_info(path)
    try:
        variables = tuple(_variable(said) for said in info["variables"])
    except (KeyError, TypeError, ValueError) as error:
        raise BatchError(f"{path / STUDY_FILE}: cannot be read: {error}") from None
    return Study(path, info, variables, tuple(read_trials(path, variables)))


def _variable(said: Mapping[str, Any]) -> Variable:
    values = {name: value for name, value in said.items() if name != "kind"}
    if said["kind"] == "choice":
        return Choice(values["name"], tuple(values["values"]))
    return Range(**values)


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
