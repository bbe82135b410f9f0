"""Scores and results of metrics, interactions and networks in the course of a run, as rows of a table."""

from __future__ import annotations

import math
import warnings
from typing import Any

import pyarrow as pa

from tussle.record.arrow_values import arrow_array
from tussle.record.schema import RESULTS


class ResultRows:
    """Collects scores and results of each world whenever they change.

    Args:
        sim: The simulation, see `recorder.Recorded`.
    """

    def __init__(self, sim: Any) -> None:
        self._sim = sim
        self._rows: list[tuple[Any, ...]] = []
        self._last: dict[tuple[int, str, int | None], float] = {}
        self._has_failed = False

    def read(self) -> None:
        """Add the results that have changed since they were read last. After an error of a plugin, which is a warning, nothing is added."""
        if self._has_failed:
            return
        try:
            results = self._sim.result(is_hashed=False)
        except Exception as error:  # noqa: BLE001 - the run goes on, and its end reports the error again if it lasts
            self._has_failed = True
            warnings.warn(f"results are recorded no longer: {error}", RuntimeWarning, stacklevel=2)
            return
        for result in results:
            for team, score in result.scores.items():
                self._add(result, "score", team, score)
            for plugin, named in result.metrics.items():
                for name, value in named.items():
                    for key, number in value.items() if isinstance(value, dict) else ((None, value),):
                        self._add(result, f"{plugin}.{name}", key, number)

    def _add(self, result: Any, name: str, team: int | None, value: Any) -> None:
        if not isinstance(value, (bool, int, float)):
            return
        key, number = (result.world, name, team), float(value)
        last = self._last.get(key)
        if last is None or not (last == number or (math.isnan(last) and math.isnan(number))):
            self._last[key] = number
            self._rows.append((result.world, result.t, result.steps, name, team, number))

    @property
    def n(self) -> int:
        """Number of rows that are collected."""
        return len(self._rows)

    def take(self) -> pa.RecordBatch | None:
        """Return the rows so far, and forget them; None where there are none."""
        rows, self._rows = self._rows, []
        if not rows:
            return None
        arrays = [
            arrow_array(column, f.type) for column, f in zip(zip(*rows, strict=True), RESULTS, strict=True)
        ]
        return pa.RecordBatch.from_arrays(arrays, schema=RESULTS)
