"""Sensors that fail."""

from __future__ import annotations

from typing import Any, ClassVar

import numpy as np

from tussle.api import GroupView, Output, Param, RaggedColumn, Sensor, State
from tussle.api.channel_fault import ChannelFault, ChannelsParam, channel_names
from tussle.api.channel_map import MEASURED_CHANNELS, MEASURED_LISTS
from tussle.errors import ParameterError, listed, nearest_name

MEMORY = "freeze", "delay"
"""Faults that need what was measured before."""
KEPT = "gps_latitude", "gps_longitude", "gps_altitude", "gps_time"
"""Numbers that a sensor does not write in each call: GPS keeps those of its last fix."""
ATTITUDE = tuple(f"belief_quat_{i}" for i in "wxyz")
FIXED = ("id", "team", "kind", "solid", "qw", "qx", "qy", "qz")
"""Fields of lists that are no measured numbers, or not alone."""


class SensorFault(ChannelFault, Sensor):
    """Alters what sensors before it have measured while there is a fault; autonomies and controllers read the altered values.

    The channels are numbers that sensors earlier in the block write, or one list, such as the contacts of NoisyContacts. The true states
    are not changed, nor are messages of sensors, nor the scans of RayTrace, which keeps them from one scan to the next. With the belief
    of `NoisyState` or `SimpleINS` the robot navigates by wrong positions or velocities. It needs the `rate` of these sensors, so that it
    alters each measurement once.

    The values of `fault` are:

    * dropout: `value`, by default 0.
    * bias: the measurement plus `value`.
    * freeze: the measurement at the beginning of the fault.
    * delay: the measurement of `delay` calls before.
    * saturate: the measurement within -`value` and `value`.
    * reverse: the measurement with the other sign.

    Of a list, the fields in `fields` are altered in all items, by the same faults. Without `fields` a dropout leaves the list empty.
    Freeze and delay are of the whole list, with its items of then.

    The attitude, four channels, can freeze and be late; the others would be no rotations.
    """

    grade = "portable"
    alters_sensors: ClassVar[bool] = True

    channels = ChannelsParam(
        "belief_pos_x belief_pos_y belief_pos_z",
        (*MEASURED_CHANNELS, *MEASURED_LISTS),
        doc="Channels that are altered.",
    )
    fields = Param("", doc="Fields of the list that are altered.")
    past_items = State(ragged=True, doc="Items of the list in calls before: how many calls ago, and fields.")
    n_calls = State(dtype=int, doc="Number of calls, for delayed lists.")
    measured = State(doc="Last measurements of numbers that a sensor may keep.")
    written = State(doc="What was written instead of them.")
    for _channel, _unit in MEASURED_CHANNELS.items():
        vars()[_channel] = Output(unit=_unit, doc="Measurement.")
    for _channel, (_fields, _unit) in MEASURED_LISTS.items():
        vars()[_channel] = Output(ragged=True, fields=_fields, unit=_unit, doc="List.", finite=False)

    def check_values(self) -> None:
        """Check that an attitude stays a rotation, that there is one list at most, and its fields."""
        names, fault = channel_names(self.values["channels"]), self.values["fault"]
        where = f"{type(self).__name__}: channels = {' '.join(names)}"
        named = [name for name in ATTITUDE if name in names]
        if named and (len(named) < len(ATTITUDE) or fault not in ("freeze", "delay")):
            raise ParameterError(
                f"{type(self).__name__}: channels = {' '.join(named)} with fault = {fault!r} is not allowed; an attitude is "
                f"the channels {' '.join(ATTITUDE)} together, and takes freeze or delay"
            )
        lists = [name for name in names if name in MEASURED_LISTS]
        if len(lists) > 1:
            raise ParameterError(f"{where} has several lists; give each a {type(self).__name__} of its own")
        fields, all_fields = (
            channel_names(self.values["fields"]),
            "".join(MEASURED_LISTS[n][0] for n in lists),
        )
        known = [name for name in all_fields.split() if name not in FIXED]
        for name in fields:
            if name not in known:
                raise ParameterError(
                    f"{where} has no field {name!r} that can be altered{nearest_name(name, known)}; {listed(known)}"
                )
        if fields and fault in MEMORY:
            raise ParameterError(f"{where} with fault = {fault!r} takes no fields; it is of the whole list")
        if all_fields and not fields and fault not in (*MEMORY, "dropout"):
            raise ParameterError(f"{where} with fault = {fault!r} needs fields; {listed(known)}")

    def unused_states(self) -> tuple[str, ...]:
        """Return the columns of the other faults, and those of lists without need of them."""
        has_list = len(self.numbers()) < len(self.offered_outputs())
        of_lists = {"past_items": MEMORY, "n_calls": ("delay",)}
        unused = [n for n, faults in of_lists.items() if not has_list or self.values["fault"] not in faults]
        return *super().unused_states(), *unused, *(() if self._kept() else ("measured", "written"))

    def state_size(self, name: str) -> int:
        """Return the number of components: one per channel that a sensor may keep."""
        return max(1, len(self._kept())) if name in ("measured", "written") else super().state_size(name)

    def _kept(self) -> list[int]:
        """Places of the numbers that a sensor may keep."""
        return [i for i, name in enumerate(self.numbers()) if name in KEPT]

    def offered_outputs(self) -> list[str]:
        """Return the channels that are altered."""
        return list(channel_names(self.channels))

    def step(self, g: GroupView) -> None:
        """Alter the measurements."""
        begins, numbers = self.begin(g), self.numbers()
        if numbers:
            columns, kept = [getattr(self, name) for name in numbers], self._kept()
            true = np.array(columns)
            if kept:  # a measurement that the sensor has kept is altered already
                is_kept = true[kept] == self.written
                self.measured[:] = true[kept] = np.where(is_kept, self.measured, true[kept])
            altered = self.altered(begins, true)
            if kept:
                self.written[:] = altered[kept]
            for column, row in zip(columns, altered, strict=True):
                column[:] = row
        for name in self.offered_outputs():
            if name in MEASURED_LISTS:
                self._alter(getattr(self, name), MEASURED_LISTS[name][0].split(), begins)

    def _alter(self, lists: RaggedColumn, fields: list[str], begins: np.ndarray) -> None:
        """Alter a list of each row, whose items have some fields."""
        chosen: Any = [fields.index(name) for name in channel_names(self.fields)] or slice(None)
        if self.fault in MEMORY:
            wrong = self._items_before(lists, begins)
        elif self.fault == "dropout" and not self.fields:
            wrong = lists.take(np.full(len(lists), -1))
        else:
            wrong = lists.copy()
            wrong.data[chosen] = self.wrong(lists.data[chosen], self.value[lists.row])
        rows = np.flatnonzero(self.is_faulty)
        lists.put(rows, wrong.take(rows))

    def _items_before(self, lists: RaggedColumn, begins: np.ndarray) -> RaggedColumn:
        """Store the lists, and return those of the beginning of the fault, or of `delay` calls before."""
        now = np.atleast_2d(lists.data)
        now = np.concatenate([np.zeros((1, now.shape[1])), now])
        width = len(now)
        past, row = self.past_items.data.reshape(-1, width).T, self.past_items.row[::width]
        if self.fault == "freeze":
            is_kept, is_new = ~begins[row], begins[lists.row]
        else:
            past[0] += 1.0
            is_kept, is_new = past[0] <= self.delay, np.ones(now.shape[1], bool)
            self.n_calls += 1
        row = np.concatenate([row[is_kept], lists.row[is_new]])
        order = np.argsort(row, kind="stable")
        row, items = row[order], np.concatenate([past[:, is_kept], now[:, is_new]], axis=1)[:, order]
        rows = np.arange(len(lists) + 1)
        self.past_items.set(np.searchsorted(row, rows) * width, items.T.ravel())
        if self.fault == "delay":  # the first ones where there were fewer calls
            is_due = items[0] == np.minimum(self.delay, self.n_calls - 1)[row]
            row, items = row[is_due], items[:, is_due]
        return RaggedColumn(np.searchsorted(row, rows), items[1:].reshape(*lists.data.shape[:-1], -1))
