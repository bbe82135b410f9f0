"""A slow link between people and the game: orders come late or are lost, and what is seen is late."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np

from tussle.arguments import explained
from tussle.documents import Real, check_argument
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric.rng import stream_key, uniform
from tussle.record.run_file import plain

LOSS = stream_key("operator", "link", "loss")
RULES = {"delay": Real(0.0, 1e6), "loss": Real(0.0, 1.0), "bandwidth": Real(1e-3), "see": Real(0.0, 600.0)}


@explained
@dataclass(frozen=True)
class OperatorLink:
    """How orders come from people to the game: later, one after the other, or not at all; and how late people see the game.

    An order is sent after those before it. It takes its bytes over the bandwidth, then the delay, and comes before the next step.
    Whether it is lost is drawn from the seed of the world and the order's number.

    Attributes:
        delay: Time that an order takes [s].
        loss: Probability that it is lost. That an entity is given back to its autonomies is never lost.
        bandwidth: Bytes that are sent in a second; inf for any number. An order has the bytes of its JSON text.
        see: Age of what the page shows [s].

    Raises:
        ParameterError: A value is not allowed.
    """

    delay: float = 0.0
    loss: float = 0.0
    bandwidth: float = math.inf
    see: float = 0.0

    def __post_init__(self) -> None:
        for name, rule in RULES.items():
            value = getattr(self, name)
            if (name, value) != ("bandwidth", math.inf):
                check_argument(name, value, rule)

    @classmethod
    def of_text(cls, text: str) -> Self:
        """The link of a text such as "delay=0.5, loss=0.1, bandwidth=200".

        Raises:
            ParameterError: A text has another form, or a value is not allowed.
        """
        values: dict[str, float] = {}
        for each in text.split(","):
            name, _, value = (part.strip() for part in each.partition("="))
            if name not in RULES:
                raise ParameterError(
                    f"link: there is no {name!r}{nearest_name(name, RULES)}; {listed(RULES)}"
                )
            try:
                values[name] = float(value)
            except ValueError:
                raise ParameterError(f"link: {name} = {value!r} is not a number") from None
        return cls(**values)

    def __str__(self) -> str:
        wide = "" if self.bandwidth == math.inf else f" and share {self.bandwidth:g} bytes/s"
        lost = f"; {100 * self.loss:g} % of them are lost" if self.loss else ""
        late = f"; what is seen is {self.see:g} s old" if self.see else ""
        return f"orders take {self.delay:g} s{wide}{lost}{late}"


class Underway:
    """Orders that are on their way.

    Args:
        link: The link.
        dt: Duration of a step [s].
    """

    def __init__(self, link: OperatorLink, dt: float) -> None:
        self._link, self._dt = link, dt
        self._orders: list[tuple[int, Callable[[], None]]] = []
        self.restart()

    def restart(self) -> None:
        """Begin anew, with the first order."""
        self.clear()
        self._n_sent = 0

    def clear(self) -> int:
        """Forget the orders that are on their way; return how many they were."""
        n = len(self._orders)
        self._orders, self._free_at = [], 0.0
        return n

    def send(self, order: Any, step: int, key: np.ndarray, do: Callable[[], None], is_sure: bool) -> None:
        """Send an order before a step.

        Args:
            order: What is sent.
            step: The step.
            key: Key of the world's draws, (1,).
            do: Carries it out.
            is_sure: It is not lost.
        """
        n_bytes = len(json.dumps(plain(order)).encode())
        self._free_at = max(step * self._dt, self._free_at) + n_bytes / self._link.bandwidth
        arrival = math.ceil(round((self._free_at + self._link.delay) / self._dt, 6))
        is_lost = uniform(key, LOSS, self._n_sent, 0)[0, 0] < self._link.loss
        self._n_sent += 1
        if is_sure or not is_lost:
            self._orders.append((max(arrival, step), do))

    def take(self, step: int) -> list[Callable[[], None]]:
        """The orders that arrive before a step, in the order in which they were sent."""
        due = [do for arrival, do in self._orders if arrival <= step]
        self._orders = [order for order in self._orders if order[0] > step]
        return due
