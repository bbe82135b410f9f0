"""Faults of channels: what they do to the numbers."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import numpy as np

from tussle.api.group import GroupView
from tussle.api.timed_fault import TimedFault
from tussle.declare.columns import Param, State
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import clip

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

    def __init__(self, default: str, known: Mapping[str, str], *, at_least: int = 1, doc: str = "") -> None:
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

    def state_size(self, name: str) -> int:
        """Return the number of components: one value per channel is held, and of delayed ones those of all calls."""
        k = len(channel_names(self.values["channels"]))
        if name == "held":
            return k if self.values["fault"] == "freeze" else 1
        if name == "past":
            return k * self.values["delay"] if self.values["fault"] == "delay" else 1
        return super().state_size(name)

    def unused_states(self) -> tuple[str, ...]:
        """Return the columns of the other faults."""
        unused = {"held": "freeze", "past": "delay", "has_past": "delay"}
        return tuple(name for name, fault in unused.items() if self.values["fault"] != fault)

    def altered(self, g: GroupView, true: np.ndarray) -> np.ndarray:
        """Advance the fault by a call, and return what becomes of the values of the channels, (k, n)."""
        begins = self.begin(g)
        if self.fault == "freeze":
            self.held[:, begins] = true[:, begins]
            wrong = self.held
        elif self.fault == "delay":
            wrong = self._remember(true)
        elif self.fault == "bias":
            wrong = true + self.value
        elif self.fault == "saturate":
            wrong = clip(true, -np.abs(self.value), np.abs(self.value))
        elif self.fault == "reverse":
            wrong = -true
        else:
            wrong = np.broadcast_to(self.value, true.shape)
        return np.where(self.is_faulty, wrong, true)

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
