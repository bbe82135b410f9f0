"""A battery that commands discharge."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from tussle.api import Controller, GroupView, Input, Output, Param, Publish, State, Subscribe, service
from tussle.api.channel_map import CHANNEL_UNITS
from tussle.declare import texts
from tussle.declare.messages import ChargeAdded, ChargePercentage
from tussle.errors import ParameterError, listed, nearest_name
from tussle.numeric import clip

TYPES = ("NonZero", "Delta")
DEPLETION = """[ desired_speed, 1.0, NonZero, true, 0.0 ]
    [ desired_altitude, 0.0, Delta, false, 0.0 ]
    [ desired_heading, 0.0, Delta, false, 0.0 ]"""


class Depletion(NamedTuple):
    """Discharge by one channel."""

    channel: str
    rate: float
    type: str
    is_limited: bool
    empty_value: float


@cache
def depletions(text: str) -> tuple[Depletion, ...]:
    """Parse rows [channel, rate, NonZero or Delta, limit when empty, value when empty].

    Raises:
        ParameterError: A row has another form, or a channel is unknown or written twice.
    """
    found = []
    for row in texts.rows(text):
        items = [item.strip() for item in row.split(",")]
        if len(items) != 5 or items[2] not in TYPES:
            raise ParameterError(
                f"{texts.shown(row)} is not [channel, rate, NonZero or Delta, true or false, value]"
            )
        if items[0] not in CHANNEL_UNITS:
            raise ParameterError(
                f"there is no channel {items[0]!r}{nearest_name(items[0], CHANNEL_UNITS)}; {listed(CHANNEL_UNITS)}"
            )
        numbers = texts.row(f"{items[1]} {items[4]}", [("rate", "", ""), ("value", "", "")])
        found.append(Depletion(items[0], numbers[0], items[2], texts.truth(items[3]), numbers[1]))
    if len({each.channel for each in found}) != len(found) or not found:
        raise ParameterError(f"{texts.shown(text)} names no channel, or one twice")
    return tuple(found)


class DepletionParam(Param):
    """The rows of a `MotionBattery`; see `depletions` for the errors."""

    def convert(self, value: Any, where: str = "", from_geodetic: Callable[..., Any] | None = None) -> Any:
        """Check the rows; the value is their text."""
        text = super().convert(value, where, from_geodetic)
        try:
            depletions(text)
        except ParameterError as error:
            raise ParameterError(f"{self._place(where)}: {error}") from None
        return text


class MotionBattery(Controller):
    """Passes channels on and discharges a battery by them. When the battery is empty, the values of limited channels are replaced.

    A row of `depletion_map` is [channel, rate, type, limit, value]. A channel of type NonZero discharges `rate` per second while its
    value is not 0; one of type Delta discharges `rate` times the change of its value. At `charge_min`, channels with limit true have the
    value of their row. Only the channels in the map are passed. A `ChargeAdded` message charges the battery; the service
    `get_battery_charge` returns the charge of each row, (n,).

    Differences from SCRIMMAGE: there the type was ignored and the charge taken was rate times value, so that negative values
    charged the battery; an empty battery removed the entity, whose limited values were then useless. The charge starts at charge_initial
    within its limits, so at 1 with the defaults.
    """

    grade = "portable"

    charge_initial = Param(10.0, doc="Charge at the start, within the limits.")
    charge_min = Param(0.0, doc="Charge of an empty battery.")
    charge_max = Param(1.0, doc="Charge of a full battery.")
    depletion_map = DepletionParam(
        DEPLETION, doc="Rows [channel, rate, NonZero or Delta, limit when empty, value when empty]."
    )
    publish_charge = Param(False, structural=True, doc="Send ChargePercentage on LocalNetwork in every call.")
    for _channel, _unit in CHANNEL_UNITS.items():
        vars()[f"{_channel}_in"] = Input(_channel, unit=_unit, doc="Command.")
        vars()[f"{_channel}_out"] = Output(_channel, unit=_unit, doc="Command passed on.")
    charge = State(doc="Charge.")
    last = State(" ".join(CHANNEL_UNITS), doc="Values of the last call.")
    is_started = State(dtype=bool, doc="Whether there was a call.")
    charged = Subscribe(ChargeAdded)
    reported = Publish(ChargePercentage, network="LocalNetwork")

    def check_values(self) -> None:
        """Check that no lower limit is above its upper one."""
        self.check_order("charge_min", "charge_max")

    def active_inputs(self) -> list[str]:
        """Return the channels of the map."""
        return [f"{each.channel}_in" for each in depletions(self.depletion_map)]

    def offered_outputs(self) -> list[str]:
        """Return the channels of the map."""
        return [f"{each.channel}_out" for each in depletions(self.depletion_map)]

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Charge the battery."""
        self.charge[rows] = clip(self.charge_initial[rows], self.charge_min[rows], self.charge_max[rows])

    def step(self, g: GroupView) -> None:
        """Discharge the battery, and pass or limit the channels."""
        taken = np.zeros(g.n)
        rows, messages = self.charged.pairs()
        is_own = messages.entity == g.id[rows]
        np.subtract.at(taken, rows[is_own], messages.charge[is_own])
        used = depletions(self.depletion_map)
        places = list(CHANNEL_UNITS)
        for each in used:
            value, last = getattr(self, f"{each.channel}_in")[0], self.last[places.index(each.channel)]
            if each.type == "NonZero":
                taken += each.rate * g.dt * (value != 0.0)
            else:
                taken += each.rate * np.abs(value - last) * self.is_started
            last[:] = value
        self.is_started[:] = True
        self.charge[:] = clip(self.charge - taken, self.charge_min, self.charge_max)
        is_empty = self.charge <= self.charge_min
        for each in used:
            value, out = getattr(self, f"{each.channel}_in")[0], getattr(self, f"{each.channel}_out")[0]
            out[:] = np.where(is_empty & each.is_limited, each.empty_value, value)
        if self.publish_charge:
            span = self.charge_max - self.charge_min
            share = np.divide(self.charge - self.charge_min, span, out=np.zeros(g.n), where=span > 0.0)
            self.reported.publish(np.arange(g.n), percentage=100.0 * share)

    @service
    def get_battery_charge(self, g: GroupView) -> np.ndarray:
        """Return the charge of each row, (n,)."""
        charge: np.ndarray = self.charge
        return charge
