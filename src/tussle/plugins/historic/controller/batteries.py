"""Controllers that count the energy of a vehicle, as in SCRIMMAGE."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import GroupView, Publish, row_law
from tussle.declare.messages import RemoveEntity
from tussle.plugins.stock.controller import motion_battery, uuv_6dof_linear_energy
from tussle.plugins.stock.controller.motion_battery import depletions


class MotionBattery(motion_battery.MotionBattery):
    """MotionBattery whose charge falls by rate times value for every type, and that removes the entity when it is empty.

    Negative values charge it. In tussle a channel takes charge while its value is not 0, or with its change, and an empty battery
    limits it.
    """

    emptied = Publish(RemoveEntity)

    def step(self, g: GroupView) -> None:
        """Take the charge, and pass or limit the channels."""
        rows, messages = self.charged.pairs()
        is_own = messages.entity == g.id[rows]
        np.add.at(self.charge, rows[is_own], messages.charge[is_own])
        self.charge[:] = np.minimum(self.charge, self.charge_max)
        for each in depletions(self.depletion_map):
            value, out = getattr(self, f"{each.channel}_in")[0], getattr(self, f"{each.channel}_out")[0]
            self.charge[:] -= value * each.rate * g.dt
            is_empty = self.charge < self.charge_min
            out[:] = np.where(is_empty & each.is_limited, each.empty_value, value)
            self.charge[:] = np.maximum(self.charge, self.charge_min)
            dead = np.flatnonzero(is_empty)
            self.emptied.publish(dead, entity=g.id[dead], why="battery is empty")
        if self.publish_charge:
            span = self.charge_max - self.charge_min
            share = np.divide(self.charge - self.charge_min, span, out=np.zeros(g.n), where=span > 0.0)
            self.reported.publish(np.arange(g.n), percentage=100.0 * share)


class UUV6DOFLinearEnergy(uuv_6dof_linear_energy.UUV6DOFLinearEnergy):
    """UUV6DOFLinearEnergy that a negative throttle charges, without limits of the energy.

    The energy of a call counts in the same call. In tussle the size of the throttle is taken.
    """

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Charge the battery."""
        self.energy[rows] = self.energy_initial[rows]

    @row_law("passed", "energy")
    @staticmethod
    def deplete(command: Any, energy_min: float, energy: float, dt: float) -> Any:
        """Take the energy, and pass the commands."""
        throttle, elevator, rudder = command
        left = energy - throttle * dt
        return (throttle if left > energy_min else 0.0, elevator, rudder), left
