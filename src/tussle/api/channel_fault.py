"""Faults of channels: what they do to the numbers."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import cache
from typing import Any

import numpy as np

from tussle.api.channels import MEASURED_LISTS
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
