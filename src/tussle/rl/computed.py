"""Observations that a function of the simulation computes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from tussle.arguments import check_fields
from tussle.documents import Whole, check_argument
from tussle.errors import ParameterError
from tussle.rl.observation import AgentRows, Component

if TYPE_CHECKING:
    from tussle.engine.simulation import Simulation
    from tussle.mission import Mission


@dataclass(frozen=True)
class Computed(Component):
    """Numbers from a function of the simulation: function(simulation) -> (worlds, agents, n), for the agents of all worlds.

    Attributes:
        n: Numbers of each agent.
        function: The function.
        low: Smallest value, of all numbers or of each; high: largest value. 0 has to be between them, since the dead observe zeros.
    """

    n: int
    function: Callable[[Any], np.ndarray]
    low: float | Sequence[float] = -np.inf
    high: float | Sequence[float] = np.inf

    def width(self, mission: Mission, block: str) -> int:
        self.check()
        return self.n

    def check(self) -> None:
        """Check the bounds.

        Raises:
            ParameterError: They do not fit.
        """
        check_fields(self)
        check_argument("Computed: n", self.n, Whole(1))
        if np.shape(self.low) not in ((), (self.n,)) or np.shape(self.high) not in ((), (self.n,)):
            raise ParameterError(f"Computed: low and high are one number, or {self.n} numbers")
        if not ((np.array(self.low) <= 0.0) & (np.array(self.high) >= 0.0)).all():
            raise ParameterError(
                f"Computed: low = {self.low!r} and high = {self.high!r} are not allowed; 0 is between them"
            )

    def of_worlds(self, simulation: Simulation) -> np.ndarray:
        """The function as one of worlds, (W, n).

        Raises:
            ParameterError: It returns another shape, or a number that is not finite.
        """
        values, shape = np.asarray(self.function(simulation)), (simulation.n_worlds, self.n)
        if values.shape != shape or values.dtype.kind not in "biuf" or not np.isfinite(values).all():
            raise ParameterError(
                f"state: the function returns {_shape_of(values)}; it returns {shape}, {self.n} finite numbers for each world"
            )
        return values

    def bounds(self, mission: Mission, block: str) -> np.ndarray:
        return np.array([np.broadcast_to(self.low, self.n), np.broadcast_to(self.high, self.n)], float)

    def write(self, simulation: Simulation, part: AgentRows, column: int, out: np.ndarray) -> None:
        values = np.asarray(self.function(simulation))
        shape = simulation.n_worlds, len(out) // simulation.n_worlds, self.n
        if values.shape != shape or values.dtype.kind not in "biuf":
            raise ParameterError(
                f"Computed: the function returns {_shape_of(values)}; it returns {shape}, {self.n} numbers for each world and agent"
            )
        mine = values.reshape(-1, self.n)[part.agents]
        if not np.isfinite(mine).all():
            world, agent = divmod(
                int(part.agents[np.flatnonzero(~np.isfinite(mine).all(axis=1))[0]]), shape[1]
            )
            raise ParameterError(
                f"Computed: agent {agent} in world {world} observes {values[world, agent].tolist()}; the function returns finite numbers "
                "(`simulation.read` has NaN for the dead)"
            )
        out[part.agents, column : column + self.n] = mine


def _shape_of(values: np.ndarray) -> str:
    return f"shape {values.shape}{'' if values.dtype.kind in 'biuf' else f' of {values.dtype}'}"


__all__ = ["Computed"]
