"""The directory of a search: `study.json`, and Optuna's journal of the trials."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import pyarrow.parquet as pq

from tussle.arguments import explained
from tussle.batch.consistency import MAX_VALUE
from tussle.batch.plan import MAX_RUNS
from tussle.batch.schemas import SEED, VARIABLE
from tussle.batch.search.proposals import SAMPLERS, new_study, quiet, require_optuna
from tussle.batch.search.study import Study
from tussle.batch.search.trials import MAX_TRIALS, Trial, frozen, thawed, trials_table
from tussle.batch.store import locked, reported
from tussle.batch.variables import Variable
from tussle.batch.varied import variable_of
from tussle.documents import Document, Map, Maybe, Real, Whole, json_text, problem, read_text
from tussle.errors import BatchError
from tussle.record.run_file import plain, put_whole, versions

if TYPE_CHECKING:
    from optuna.storages import JournalStorage

STUDY_FILE, JOURNAL_FILE, TRIALS_FILE, LOCK = "study.json", "trials.journal", "trials.parquet", "lock"
OWN_FILES = (STUDY_FILE, JOURNAL_FILE, TRIALS_FILE, LOCK)

STUDY = Document(
    "the search",
    2,
    {
        "variables": [VARIABLE],
        "name": str,
        "fingerprint": str,
        "objective": str,
        "direction": ("maximize", "minimize"),
        "runs": Whole(1, MAX_RUNS),
        "first_seed": SEED,
        "sampler": SAMPLERS,
        "sample_seed": Whole(),
        "per_round": Whole(1, MAX_TRIALS),
        "constraints": Maybe([str]),
        "versions": Map(str),
    },
    BatchError,
)
"""Fields of `study.json`."""
_MEAN = Maybe(Real(-MAX_VALUE, MAX_VALUE))
TRIAL = {
    "value": _MEAN,
    "low": _MEAN,
    "high": _MEAN,
    "n_failed": Whole(0, MAX_RUNS),
    "error": str,
    "by_seed": [Maybe(Real())],
    "violations": Maybe([Maybe(Real())]),
}
"""Fields of a trial in the journal, besides its parameters."""
COMPARED = (
    "tussle", "name", "mission", "objective", "direction", "variables", "runs", "first_seed", "sampler", "sample_seed", "per_round",
    "constraints",
)  # fmt: skip
"""Settings that identify a search, in the order in which differences are reported."""
PROPOSED_BY = ("optuna", "cmaes", "numpy", "scipy")
"""Packages on whose versions the proposals depend."""
MAX_JOURNAL = 1 << 28
"""Largest size of a journal [B]."""


class StudyStore:
    """The directory of a search, opened for writing.

    Each trial is one line of the journal, written when its round is finished.

    Args:
        path: The directory; made if need be.
        info: What is searched.

    Attributes:
        info: What `study.json` says.
        trials: All trials so far.

    Raises:
        BatchError: It holds another search or something else, or another process writes there.
        RecordError: It cannot be written.
    """

    def __init__(self, path: Path, info: Mapping[str, Any]) -> None:
        self.path = path
        with reported(path):
            path.mkdir(parents=True, exist_ok=True)
            foreign = [p.name for p in path.iterdir() if p.name.removesuffix(".part") not in OWN_FILES]
            if foreign and not (path / STUDY_FILE).exists():
                raise BatchError(
                    f"{path}: holds something that is no search ({min(foreign)}); choose another directory"
                )
        self._lock = locked(path, "at this search")
        try:
            self.info = self._agreed(dict(plain(info)))
            self.variables = [variable_of(entry) for entry in self.info["variables"]]
            self._repair()
            self.trials = read_trials(path, self.info)
        except BaseException:
            self._lock.close()
            raise

    def _agreed(self, info: dict[str, Any]) -> dict[str, Any]:
        """Return the info of the directory; write it if there is none."""
        if not (self.path / STUDY_FILE).exists():
            with reported(self.path):
                put_whole(self.path / STUDY_FILE, json_text(info))
            return info
        before = read_info(self.path)
        if any(before.get(name) != info.get(name) for name in (*COMPARED, "fingerprint")):
            raise BatchError(
                f"{self.path}: holds another search ({_difference(before, info)}); choose another directory, or remove it"
            )
        return before

    def _repair(self) -> None:
        """Remove what a killed process may leave: a cut line at the end of the journal, and Optuna's lock."""
        journal = self.path / JOURNAL_FILE
        with reported(self.path):
            (self.path / f"{JOURNAL_FILE}.lock").unlink(missing_ok=True)
            if journal.exists():
                whole = read_text(journal, BatchError, MAX_JOURNAL).rpartition("\n")
                os.truncate(journal, len((whole[0] + whole[1]).encode()))

    def add(self, trials: Sequence[Trial]) -> None:
        """Append trials to the journal, and write the table of all."""
        import optuna

        with reported(self.path), quiet():
            storage = _journal(self.path / JOURNAL_FILE)
            is_new = not storage.get_all_studies()
            is_minimized = self.info["direction"] == "minimize"
            study = (
                new_study(is_minimized, storage)
                if is_new
                else optuna.load_study(study_name="tussle", storage=storage)
            )
            study.add_trials([frozen(trial, self.variables) for trial in trials])
            self.trials += trials
            draft = self.path / f"{TRIALS_FILE}.part"
            draft.unlink(missing_ok=True)
            pq.write_table(trials_table(self.trials, self.variables), draft, compression="zstd")
            draft.replace(self.path / TRIALS_FILE)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._lock.close()


def _journal(path: Path) -> JournalStorage:
    from optuna.storages import JournalStorage
    from optuna.storages.journal import JournalFileBackend

    return JournalStorage(JournalFileBackend(str(path)))


def _difference(before: Mapping[str, Any], now: Mapping[str, Any]) -> str:
    """Return the first difference between two searches."""
    for name in COMPARED:
        if before.get(name) != now.get(name):
            if isinstance(now.get(name), (str, int)):
                return f"its {name} is {before.get(name)!r}, not {now[name]!r}"
            return f"it differs in {name}"
    return "the mission or a plugin file has changed since"


def read_info(path: Path) -> dict[str, Any]:
    """The content of `study.json` in a directory.

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
    """All trials of a journal. Each is checked, since the file may be damaged.

    Args:
        path: The directory.
        info: What `study.json` says.

    Raises:
        BatchError: They cannot be read.
        MissingExtraError: Optuna is not installed.
    """
    file = path / JOURNAL_FILE
    if not file.exists():
        return []
    require_optuna()
    import optuna

    read_text(file, BatchError, MAX_JOURNAL)
    variables: list[Variable] = [variable_of(entry) for entry in info["variables"]]
    try:
        with quiet():
            storage = _journal(file)
            if not storage.get_all_studies():
                return []
            found = optuna.load_study(study_name="tussle", storage=storage).get_trials(deepcopy=False)
            for i, one in enumerate(found):
                if violation := _against(i, one, info):
                    raise BatchError(f"{file}: {violation}")
            return [thawed(i, info["per_round"], one, variables) for i, one in enumerate(found)]
    except BatchError:
        raise
    except Exception as error:  # noqa: BLE001  a damaged line breaks Optuna anywhere
        raise BatchError(f"{file}: cannot be read: {type(error).__name__}: {error!s:.200}") from None


def _against(i: int, trial: Any, info: Mapping[str, Any]) -> str:
    """Return what is wrong with a trial of the journal; "" if it is valid."""
    facts = {"value": trial.value, **trial.user_attrs}
    if i >= MAX_TRIALS or (violation := problem(facts, TRIAL, f"trial {i}")):
        return violation if i < MAX_TRIALS else f"has more than {MAX_TRIALS:,} trials"
    low, high, n_games = facts["low"], facts["high"], len(facts["by_seed"])
    if (low is None) != (high is None) or (low is not None and low > high):
        return f"trial {i}: low = {low} is not allowed; high is {high}"
    is_complete = trial.state.name == "COMPLETE"
    if is_complete != (not facts["error"]) or is_complete != (
        trial.value is not None and math.isfinite(trial.value)
    ):
        return f"trial {i}: state = {trial.state.name} is not allowed; its value is {trial.value}"
    n_constraints = len(facts.get("violations") or ())
    if n_constraints != len(info.get("constraints") or ()) and (n_constraints or is_complete):
        return (
            f"trial {i} has {n_constraints} violations, which are not as many as study.json has constraints"
        )
    if n_games != info["runs"] and (n_games or is_complete):
        return f"trial {i} has {n_games} games; study.json says {info['runs']}"
    return ""


@explained
def load_study(path: str | Path) -> Study:
    """Load a search, finished or still running.

    Raises:
        BatchError: There is none, or it cannot be read.
        MissingExtraError: Optuna is not installed.
    """
    path = Path(path)
    info = read_info(path)
    variables = tuple(variable_of(entry) for entry in info["variables"])
    return Study(path, info, variables, tuple(read_trials(path, info)))


def versions_of_samplers() -> dict[str, str]:
    """Versions of Python and of the packages that results and proposals depend on."""
    found = versions()
    for name in PROPOSED_BY:
        try:
            found[name] = metadata.version(name)
        except metadata.PackageNotFoundError:  # cmaes, where another sampler proposes
            found[name] = ""
    return found


def notes_on_versions(before: Mapping[str, Any], now: Mapping[str, Any], n: int) -> list[str]:
    """A note where other versions proposed the trials so far."""
    then, today = before.get("versions", {}), now["versions"]
    changed = [
        f"{name} {then.get(name)}, now {today[name]}" for name in PROPOSED_BY if then.get(name) != today[name]
    ]
    if not changed or not n:
        return []
    return [
        f"the search was begun with {'; '.join(changed)}: trials from {n} on may differ from those of a search without a break"
    ]
