"""The mission of a search, and the batches that are made of it."""

from __future__ import annotations

import hashlib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.batch.batch import Batch
from tussle.batch.points import settings_of
from tussle.batch.search.trials import Point
from tussle.batch.treatments import build_points
from tussle.batch.variables import Value, Variable
from tussle.errors import BatchError, TussleError
from tussle.mission import Loaded, Mission, PluginFile, read_mission


@dataclass(frozen=True)
class SearchedMission:
    """A mission, what is set in it, and what varies.

    Attributes:
        source: A mission file, the name of one that ships, a `Mission`, or a function of the varied values that makes one.
        variables: What varies.
        runs: Games of each set of values.
        first_seed: Seeds of the games count up from here.
        settings: Values that are set in all of them.
        plugin_files: Python files whose plugins the mission file may name.
        ends_by_time: The game ends at its end time whatever the mission says.
        run_timeout: Wall time that a game may take [s]; None sets no limit.
        options: Further options of `read_mission`.
    """

    source: str | Path | Mission | Callable[..., Mission]
    variables: tuple[Variable, ...]
    runs: int
    first_seed: int
    settings: Mapping[str, Any]
    plugin_files: tuple[str | Path, ...]
    ends_by_time: bool
    run_timeout: float | None
    options: Mapping[str, Any]

    def read(self) -> Content:
        """The mission as it is now, without any varied value.

        Raises:
            TussleError: It cannot be read, or cannot be made with any of the values that are tried.
        """
        loaded = None
        if isinstance(self.source, (str, Path)):
            loaded = read_mission(self.source, self.settings, plugin_files=self.plugin_files, **self.options)
            name, texts = loaded.path.stem, [loaded.text]
        else:
            missions = self._corners(self.source)
            name, texts = missions[0].name, [repr(m) for m in missions]
        texts += [text for p in self.plugin_files for text in PluginFile.of(p).texts.values()]
        plain = re.sub(r"[^A-Za-z0-9_.-]+", "_", name).strip("._") or "mission"
        return Content(
            loaded, plain[:80], hashlib.blake2b("\0".join(texts).encode(), digest_size=16).hexdigest()
        )

    def _corners(self, source: Mission | Callable[..., Mission]) -> list[Mission]:
        """Missions with all values low, all in the middle, and all high; those of them that can be made."""
        found: list[Mission] = []
        errors = []
        for share in (0.0, 0.5, 1.0):
            point = {v.name: v.value_at(share) for v in self.variables}
            try:
                found += build_points(source, self.settings, [self.given(point)])
            except TussleError as error:
                errors.append(error)
        if not found:
            raise errors[0]
        return found

    def given(self, point: Point) -> dict[str, Value]:
        """Values as a mission takes them."""
        return settings_of(point, self.variables, is_argument=callable(self.source))

    def batch(self, points: Sequence[Point]) -> Batch:
        """All games of some sets of values.

        Raises:
            TussleError: The mission cannot be played with one of them.
        """
        return Batch(
            self.source,
            runs=self.runs,
            points=[self.given(point) for point in points],
            first_seed=self.first_seed,
            settings=self.settings,
            plugin_files=self.plugin_files,
            ends_by_time=self.ends_by_time,
            run_timeout=self.run_timeout,
            **self.options,
        )

    def batch_of_playable(self, points: Sequence[Point]) -> tuple[Batch | None, dict[int, str]]:
        """All games of those sets of values with which the mission can be played; what is wrong with the others, by place."""
        try:
            return self.batch(points), {}
        except TussleError:
            errors = {}
        for i, point in enumerate(points):
            try:
                self.batch([point])
            except TussleError as error:
                values = ", ".join(f"{k}={v}" for k, v in self.given(point).items())
                errors[i] = str(error).removeprefix(f"point 0 ({values}): ")
        playable = [point for i, point in enumerate(points) if i not in errors]
        return self.batch(playable) if playable else None, errors

    def about(self, content: Content) -> dict[str, Any]:
        """Its entry in `study.json`."""
        if content.loaded is None:
            return {"made_in": "python"}
        return {
            "made_in": "file",
            "file": content.loaded.path.name,
            "settings": content.loaded.settings,
            "plugin_files": [Path(p).name for p in self.plugin_files],
            "ends_by_time": self.ends_by_time,
        }


@dataclass(frozen=True)
class Content:
    """What a mission is made of, at some time.

    Attributes:
        loaded: The file as read; None for a mission that is made in Python.
        name: Short name, fit for a file.
        hash: Of the mission and the plugin files.
    """

    loaded: Loaded | None
    name: str
    hash: str

    def check_same(self, now: Content) -> None:
        """See that nothing has changed.

        Raises:
            BatchError: It has.
        """
        if now.hash != self.hash:
            raise BatchError(
                f"{self.name}: the mission or a plugin file has changed during the search; finished rounds are kept"
            )
