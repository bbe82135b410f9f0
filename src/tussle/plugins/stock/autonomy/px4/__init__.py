"""An autonomy that leaves a vehicle to PX4."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import GroupView, Param
from tussle.api.channel_map import ChannelMapParam
from tussle.errors import MissingExtraError
from tussle.plugins.links.autopilots.link import MAX_PORT, resolved
from tussle.plugins.links.autopilots.plugin import Autopilot
from tussle.plugins.stock.autonomy.px4.link import Px4Link, SensorSuite

N_CONTROLS = 16
N_DRAWS = 10
CONTROL_MAP = "\n    ".join(f"[ motor_{i} {i} 0 1 0 1200 1 ]" for i in range(4))


class PX4(Autopilot):
    """Leaves a vehicle to PX4's simulated flight controller (SITL), in another process, which connects to tussle by TCP.

    In each step it sends HIL_SENSOR, HIL_STATE_QUATERNION and, at gps_rate, HIL_GPS of MAVLink, and takes HIL_ACTUATOR_CONTROLS; a row
    of `control_map` is [channel output control_min control_max channel_min channel_max factor], outputs counted from 0. An output that is
    not a number gives 0. The vehicle with the id 1 listens at `port`, that of PX4's instance 0; each id more adds port_step. A step is
    the mission's, usually 0.004 s. A step whose measurements are not answered goes on with the controls before, since the rate of PX4's
    controllers is limited; `unanswered` counts such steps, and a PX4 that is silent for `timeout` ends the world. Until PX4 sends its
    first controls the vehicle stands still. See [Autopilots](../autopilots.md).

    It needs `pip install 'tussle[autopilot]'`.

    Raises:
        MissingExtraError: pymavlink is not installed.
        ParameterError: A port is taken, or an address is none.
        PluginError: PX4 does not connect or answer, ends, or sends something other than MAVLink or too much.
    """

    awaits = "PX4, such as its SITL"

    control_map = ChannelMapParam(
        CONTROL_MAP,
        n_inputs=N_CONTROLS,
        doc="Rows [channel output control_min control_max channel_min channel_max factor].",
    )
    port = Param(
        4560, structural=True, ge=1, le=MAX_PORT, doc="Port for PX4's instance 0, the vehicle with the id 1."
    )
    port_step = Param(1, structural=True, ge=0, le=MAX_PORT, doc="Ports are higher by this for each id.")
    listen_ip = Param("127.0.0.1", doc="Address of this machine at which PX4 connects.")
    system_id = Param(
        1, structural=True, ge=1, le=255, doc="Number of the MAVLink system from which measurements come."
    )
    patience = Param(
        1.0,
        structural=True,
        unit="s",
        gt=0.0,
        doc="Longest wait for an answer in lockstep, wall time, before the step goes on with the controls before.",
    )
    gps_rate = Param(10.0, structural=True, unit="1/s", gt=0.0, le=1000.0, doc="Rate of HIL_GPS.")
    slow_rate = Param(
        50.0, structural=True, unit="1/s", gt=0.0, le=1000.0, doc="Rate of magnetic field and pressures."
    )
    magnetic_field = Param(
        (0.215, 0.0077, 0.4274),
        fields="north east down",
        structural=True,
        doc="Magnetic field [gauss]; by default that of Zurich, where PX4 starts.",
    )
    noise = Param(
        (0.02, 0.001, 0.001, 1.0),
        fields="acceleration rate magnetic_field pressure",
        unit="m/s^2 rad/s 1 Pa",
        structural=True,
        ge=0.0,
        doc="Standard deviations of the measurements, the field's in gauss; PX4 takes a sensor for broken whose values do not change.",
    )
    freewheel_period = Param(
        0.01,
        structural=True,
        unit="s",
        gt=0.0,
        doc="Wall time between messages of 4 ms until PX4's first controls.",
    )

    def channel_map(self) -> str:
        """The rows that map outputs to channels."""
        return str(self.control_map)

    def draws(self, g: GroupView) -> np.ndarray:
        """Standard normal numbers for the sensors of each row, (k, n)."""
        return g.normal("noise", N_DRAWS)

    def open_one(self, row: Any) -> Px4Link:
        """Listen for the PX4 of a vehicle.

        Raises:
            MissingExtraError: pymavlink is not installed.
            ParameterError: A port is taken, or an address is none.
        """
        try:
            from pymavlink.dialects.v20 import common
        except ImportError:
            raise MissingExtraError("PX4 needs pymavlink: pip install 'tussle[autopilot]'") from None
        own = row.plugin.values
        port = own["port"] + own["port_step"] * (row.id - 1) + own["world_step"] * row.world
        listen = resolved(own["listen_ip"], "listen_ip")
        periods = [round(1e6 / own[name]) for name in ("gps_rate", "slow_rate")]

        def make_suite(mav: Any) -> SensorSuite:
            return SensorSuite(mav, own["magnetic_field"], own["noise"], *periods)

        release = self.claim(row, (port,), "each vehicle has a port of its own: set port_step")
        try:
            return Px4Link(
                listen,
                port,
                own["lockstep"],
                own["timeout"],
                own["patience"],
                own["system_id"],
                own["freewheel_period"],
                make_suite,
                common,
                release,
            )
        except BaseException:
            release()
            raise
