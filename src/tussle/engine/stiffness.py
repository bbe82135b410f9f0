"""Equations that change too fast for the substeps of a mission: rigid bodies are refused, other motion models are noted."""

from __future__ import annotations

import warnings
from dataclasses import dataclass

import numpy as np

from tussle.api.motion import MotionModel
from tussle.api.rigid_body import RigidBodyModel
from tussle.engine.group import Group
from tussle.engine.state import SimulationState
from tussle.errors import MissionError, TussleError

MAX_GROWTH = 1e4
"""Factor by which a substep may enlarge a small change of the state: a hundred substeps with it leave all numbers. The method of Runge
and Kutta has it for a rate of 23 per substep, 8 times that at which it becomes unstable; the models that ship have less than 2."""
SAFE_GROWTH = 2.0
"""That of a value which is proposed; bodies that are unstable by nature, such as an aircraft without a tail, have more than 1."""
CHANGE = 1e-6
"""Size of a small change, relative to that of the number, and absolutely for small ones."""
N_TRIED = 10
"""Substeps after which such a body is refused if its numbers are not finite; a symmetric one, to which nothing happens, may fly on."""
BISECTIONS = 60
MAX_PARTS = 64
"""Largest number of parts of a substep that are tried."""
CLOSE = 1.1
"""Factor up to which two factors of growth are the same."""


@dataclass
class TrialSteps:
    """Substeps that are tried with some rows of a group, whose inputs are 0.

    Attributes:
        group: The group.
        dt: Length of a substep [s].
        u: Inputs, (k, n); those of the body are its own.
    """

    group: Group
    dt: float
    u: np.ndarray

    def growth(self, row: int, p: np.ndarray, n: int = 1, size: float = CHANGE) -> float:
        """Return the largest factor by which a substep, in n parts, of a row with parameters p, (q,), enlarges a change of its state."""
        start = self.group.x[:, row]
        m = len(start)
        change = size * np.maximum(1.0, np.abs(start))
        x = np.repeat(start[:, None], m + 1, axis=1)
        x[range(m), range(m)] += change
        given = [np.repeat(each[:, None], m + 1, axis=1) for each in (self.u[:, row], p)]
        with np.errstate(all="ignore"):
            self.group.integrate(x, *given, self.dt, n)
            jacobian = (x[:, :m] - x[:, m:]) / change
        return (
            float(np.abs(np.linalg.eigvals(jacobian)).max()) if np.isfinite(jacobian).all() else float("inf")
        )

    def advice(self, row: int) -> str:
        """Say that a substep of a row is too long, and what would be short enough: "" if it is not, or its equations are not smooth there.

        Too long is a substep that enlarges a change more than shorter ones do, in which the method of Runge and Kutta is exact.
        """
        p, parts = self.group.p[:, row], [2**k for k in range(MAX_PARTS.bit_length())]
        growth = self.growth(row, p)
        if (
            not CLOSE < growth < np.inf
            or not growth / CLOSE < self.growth(row, p, 1, 10.0 * CHANGE) < CLOSE * growth
        ):
            return ""
        *others, last = [self.growth(row, p, n) for n in parts]
        is_known = last / CLOSE <= max(1.0, others[-1]) <= CLOSE * max(1.0, last) < np.inf
        enough = next(
            (n for n, each in zip(parts, others, strict=False) if each <= CLOSE * max(1.0, last)), MAX_PARTS
        )
        if is_known and enough == 1:
            return ""
        better = (
            f"{enough} times as large a motion_multiplier is enough there"
            if is_known
            else "dt has to be much shorter"
        )
        return f": at its start, each enlarges a change of the state by a factor of {growth:.3g}; {better}"

    def stays_finite(self, row: int) -> bool:
        """Whether the state is finite after some substeps without inputs."""
        p, u = self.group.p[:, [row]], self.u[:, [row]]
        x = self.group.x[:, [row]]
        with np.errstate(all="ignore"):
            self.group.integrate(x, u, p, N_TRIED * self.dt, N_TRIED)
        return bool(np.isfinite(x).all())

    def refusal(self, row: int) -> str:
        """Say by what a rigid body changes so fast that no substep can follow; "" if one can."""
        if self.growth(row, self.group.p[:, row]) <= MAX_GROWTH or self.stays_finite(row):
            return ""
        return f", by {self.reason(row)}; its numbers would not be finite after a few steps"

    def reason(self, row: int) -> str:
        """Return what makes a row too fast: a parameter with its value, the nearest one that is safe at the start, and its default."""
        given, first = self.group.p[:, row], 0
        for name, column in type(self.group.motion.spec).row_params().items():
            k = max(1, len(column.fields))
            better = given.copy()
            better[first : first + k] = column.default
            first += k
            if self.growth(row, better) <= SAFE_GROWTH:
                low, high = 0.0, 1.0  # the share of the default that is added
                for _ in range(BISECTIONS):
                    middle = 0.5 * (low + high)
                    is_safe = self.growth(row, given + middle * (better - given)) <= SAFE_GROWTH
                    low, high = (low, middle) if is_safe else (middle, high)
                where = slice(first - k, first)
                nearest = given[where] + high * (better[where] - given[where])
                return f"{name} = {_text(given[where])} (its start alone takes {_text(nearest)}, the default is {_text(better[where])})"
        return "several parameters"


def check_stiffness(state: SimulationState) -> None:
    """Refuse the worlds in which a rigid body at its start changes so fast that no substep can follow, such as one of nearly no mass.

    Of other models with a `derivative`, those whose substeps are too long at the start are noted: the method of Runge and Kutta then
    enlarges each change of a state, which the equations do not.

    Raises:
        MissionError: There is one, in a stack of one world.
        PluginError: There is one, in another stack whose errors are raised.
    """
    dt = state.mission.dt / state.mission.motion_multiplier
    for group in state.population.groups:
        cls = type(group.motion.spec)
        if not group.n or cls.derivative is None or cls.advance is not MotionModel.advance:
            continue
        trial = TrialSteps(group, dt, group.inputs_of_body())
        is_rigid = issubclass(cls, RigidBodyModel)
        for row in _unlike_rows(group, trial.u, group.x[3:6] if is_rigid else group.x):
            try:
                text = trial.refusal(row) if is_rigid else trial.advice(row)
            except TussleError:
                raise
            except Exception:  # noqa: BLE001 - of the author's code, for inputs of 0; the step that gets there raises it with its place
                break
            if not text:
                continue
            name = f"{group.motion.spec.instance_name} of block {group.block_of(row)!r}"
            how = "changes too fast" if is_rigid else "is too stiff"
            text = f"{name} {how} for substeps of {dt:g} s (dt / motion_multiplier){text}"
            if not is_rigid:
                warnings.warn(text, RuntimeWarning, stacklevel=3)
                break
            world = int(group.motion_view.world[row])
            if state.n_worlds == 1:
                raise MissionError(text)
            state.record_failure(world, state.error(world, text))


def _unlike_rows(group: Group, u: np.ndarray, state: np.ndarray) -> list[int]:
    """The first row, that with the largest number of a part of the state, and those with the extremes of each parameter that differs."""
    given = np.concatenate([group.p, u])
    differs = given[(given != given[:, :1]).any(axis=1)]
    largest = int(np.abs(state).max(axis=0).argmax())
    found = [0, largest, *differs.argmin(axis=1).tolist(), *differs.argmax(axis=1).tolist()]
    return sorted(set(found))


def _text(values: np.ndarray) -> str:
    return " ".join(f"{value:.3g}" for value in values)
