"""Faults of channels: what they do to the numbers."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection
from functools import cache
from typing import Any

import numpy as np

from tussle.api.channel_map import MEASURED_LISTS
from tussle.api.group import GroupView
from tussle.api.kinds import EntityPlugin
from tussle.declare.columns import Param, State
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import clip, exp


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


FAULTS = "dropout", "bias", "freeze", "delay", "saturate", "reverse"
MAX_DELAY = 1000
"""Calls by which a value can be late: the memory of a fault holds as many values of each channel."""


@cache
def channel_names(text: str) -> tuple[str, ...]:
    """Names of channels in a text, separated by spaces or commas."""
    return tuple(text.replace(",", " ").split())


class ChannelsParam(Param):
    """Names of channels, as text.

    Args:
        default: The names.
        known: Names that are allowed.
        at_least: Least number of names.
        doc: One-line description.
    """

    def __init__(self, default: str, known: Collection[str], *, at_least: int = 1, doc: str = "") -> None:
        self.known, self.at_least = tuple(known), at_least
        super().__init__(default, doc=doc)

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the names; the value is their text.

        Raises:
            ParameterError: A name is unknown or written twice, or there are too few.
        """
        text: str = super().convert(value, where, from_geodetic)
        names = channel_names(text)
        for name in names:
            if name not in self.known:
                near = nearest_name(name, self.known)
                raise ParameterError(
                    f"{self._place(where)}: there is no channel {name!r}{near}; {listed(self.known)}"
                )
            if names.count(name) > 1:
                raise ParameterError(f"{self._place(where)}: channel {name!r} is written twice")
        if len(names) < self.at_least:
            raise ParameterError(f"{self._place(where)} names no channel; {listed(self.known)}")
        return text


class ChannelFault(TimedFault):
    """A fault that alters channels of an entity for some time; abstract."""

    channels: str
    fault = Param("dropout", choices=FAULTS, doc="What happens to the channels.")
    value = Param(
        0.0,
        doc="Value of a dropout, what a bias adds, or the greatest magnitude when saturated, in the channel's SI unit.",
    )
    delay = Param(
        5, ge=1, le=MAX_DELAY, structural=True, doc="Calls of the plugin by which delayed values are late."
    )
    held = State(doc="Values of frozen channels.")
    past = State(doc="Values of the last calls, newest first, for delayed ones.")
    has_past = State(dtype=bool, doc="Whether there was a call.")

    def numbers(self) -> list[str]:
        """Return the channels that are numbers."""
        return [name for name in channel_names(self.values["channels"]) if name not in MEASURED_LISTS]

    def state_size(self, name: str) -> int:
        """Return the number of components: one value per channel is held, and of delayed ones those of all calls."""
        k = len(self.numbers())
        if name == "held":
            return max(k, 1) if self.values["fault"] == "freeze" else 1
        if name == "past":
            return max(k * self.values["delay"], 1) if self.values["fault"] == "delay" else 1
        return super().state_size(name)

    def unused_states(self) -> tuple[str, ...]:
        """Return the columns of the other faults."""
        unused = {"held": "freeze", "past": "delay", "has_past": "delay"}
        return tuple(name for name, fault in unused.items() if self.values["fault"] != fault)

    def altered(self, begins: np.ndarray, true: np.ndarray) -> np.ndarray:
        """Return what becomes of the values of the channels in a call, (k, n); in rows `begins`, (n,), the fault begins."""
        if self.fault == "freeze":
            self.held[:, begins] = true[:, begins]
            wrong = self.held
        elif self.fault == "delay":
            wrong = self._remember(true)
        else:
            wrong = self.wrong(true, self.value)
        return np.where(self.is_faulty, wrong, true)

    def wrong(self, true: np.ndarray, value: np.ndarray) -> np.ndarray:
        """What a fault without memory makes of true values, (..., m); `value`, (m,), is that of each."""
        if self.fault == "bias":
            return np.asarray(true + value)
        if self.fault == "saturate":
            return np.asarray(clip(true, -np.abs(value), np.abs(value)))
        return np.asarray(-true) if self.fault == "reverse" else np.broadcast_to(value, true.shape)

    def _remember(self, true: np.ndarray) -> np.ndarray:
        """Store the values, and return those of `delay` calls before; the first ones where there were fewer calls."""
        k = len(true)
        is_new = ~self.has_past
        self.past[:, is_new] = np.tile(true[:, is_new], (self.delay, 1))
        self.has_past[:] = True
        late: np.ndarray = self.past[-k:].copy()
        self.past[k:] = self.past[:-k].copy()
        self.past[:k] = true
        return late
