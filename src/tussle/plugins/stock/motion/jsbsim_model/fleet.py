"""Aircraft of JSBSim in this process."""

from __future__ import annotations

import itertools
from array import array
from collections.abc import Callable, Sequence

import numpy as np

from tussle.errors import ParameterError
from tussle.plugins.stock.motion.jsbsim_model.flight import STATE, Aircraft, JSBSimFlight, SavedFlight
from tussle.world.geodesy import Origin

NOWHERE = (0.0,) * len(STATE)
"""State of an aircraft that has failed."""
Flown = tuple[np.ndarray, dict[int, str]]
"""Values of the properties STATE of some aircraft, (m, 12), and the errors of those that have failed, by number."""


class Fleet:
    """Aircraft by number. An aircraft that fails is not flown any more; its error is part of all later results."""

    def __init__(self) -> None:
        self.numbers = itertools.count()
        self.flights: dict[int, JSBSimFlight] = {}
        self.errors: dict[int, str] = {}

    def open(self, number: int, aircraft: Aircraft, dt: float) -> None:
        """Load an aircraft that makes steps of dt [s]."""
        self._add(number, lambda: JSBSimFlight(aircraft, dt))

    def load(self, number: int, saved: SavedFlight) -> None:
        """Repeat a flight."""
        self._add(number, lambda: JSBSimFlight.replay(saved))

    def close(self, number: int) -> None:
        """Release an aircraft."""
        self.flights.pop(number, None)
        self.errors.pop(number, None)

    def save(self, number: int) -> SavedFlight | tuple[()]:
        """Return the record of an aircraft's flight; empty if it has failed."""
        return self.flights[number].save() if number in self.flights else ()

    def place(self, numbers: Sequence[int], places: np.ndarray, origin: Origin) -> Flown:
        """Set the states of some aircraft; places are as in `JSBSimFlight.place`, (m, 17)."""
        return self._each(numbers, places, lambda flight, place: flight.place(place, origin))

    def fly(self, numbers: Sequence[int], commands: np.ndarray, n_steps: int) -> Flown:
        """Make some steps of some aircraft with these commands, (m, k)."""
        return self._each(numbers, commands, lambda flight, values: flight.fly(values, n_steps))

    def end(self) -> None:
        """Release all aircraft."""
        self.flights.clear()

    def _add(self, number: int, make: Callable[[], JSBSimFlight]) -> None:
        try:
            self.flights[number] = make()
        except Exception as error:  # noqa: BLE001 - JSBSim raises what its C++ code throws
            self._fail(number, error)

    def _each(
        self, numbers: Sequence[int], values: np.ndarray, act: Callable[[JSBSimFlight, list[float]], None]
    ) -> Flown:
        read, errors = array("d"), self.errors
        for number, own in zip(numbers, values.tolist(), strict=True):
            state: Sequence[float] = NOWHERE
            if number not in errors:
                try:
                    flight = self.flights[number]
                    act(flight, own)
                    state = flight.finite_state()
                except Exception as error:  # noqa: BLE001 - JSBSim raises what its C++ code throws
                    self._fail(number, error)
            read.extend(state)
        failed = {number: errors[number] for number in numbers if number in errors} if errors else {}
        return np.array(read).reshape(len(numbers), len(STATE)), failed

    def _fail(self, number: int, error: Exception) -> None:
        is_own = isinstance(error, ParameterError)
        self.errors[number] = str(error) if is_own else f"JSBSim: {type(error).__name__}: {error}"
        self.flights.pop(number, None)
