"""Faults of entities: when they begin and end."""

from __future__ import annotations

import math

import numpy as np

from tussle.api.group import GroupView
from tussle.api.kinds import EntityPlugin
from tussle.declare.columns import Param, State
from tussle.numeric import exp


class TimedFault(EntityPlugin):
    """Something that befalls an entity for some time; abstract.

    A fault begins at `start_after`, with `probability` for each entity, and besides at random with `failure_rate`, and lasts for
    `duration`. A second one that begins meanwhile makes it longer.
    """

    start_after = Param(
        0.0, unit="s", doc="Time at which the fault begins; inf for only those that begin at random."
    )
    probability = Param(
        1.0, ge=0.0, le=1.0, doc="Probability that an entity has the fault that begins at start_after."
    )
    failure_rate = Param(0.0, unit="1/s", ge=0.0, doc="Faults of an entity that begin at random, per time.")
    duration = Param(math.inf, unit="s", gt=0.0, doc="Time that a fault lasts.")
    until = State(unit="s", default=-math.inf, doc="Time at which the fault ends.")
    is_decided = State(dtype=bool, doc="Whether it has been drawn if the fault of start_after happens.")
    is_faulty = State(dtype=bool, recorded=True, doc="Whether there is a fault.")

    def begin(self, g: GroupView) -> np.ndarray:
        """Advance the fault by a call: find out which rows have it, and return in which it begins, (n,)."""
        now = g.t + 1e-6 * g.dt
        is_due = ~self.is_decided & (now >= self.start_after)
        self.is_decided |= is_due
        happens = is_due & (g.uniform("happens") < self.probability)
        happens |= g.uniform("begins") < 1.0 - exp(-self.failure_rate * g.dt)
        self.until[happens] = np.maximum(self.until, g.t + self.duration)[happens]
        was_faulty = self.is_faulty.copy()
        self.is_faulty[:] = now < self.until
        return np.asarray(self.is_faulty & ~was_faulty)
