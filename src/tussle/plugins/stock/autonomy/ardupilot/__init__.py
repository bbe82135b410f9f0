"""An autonomy that leaves a vehicle to ArduPilot."""

from __future__ import annotations

from typing import Any

import numpy as np

from tussle.api import GroupView, HistoricAttributes, Param, State
from tussle.api.channel_map import ChannelMapParam
from tussle.plugins.links.autopilots.link import MAX_PORT, resolved
from tussle.plugins.links.autopilots.plugin import Autopilot
from tussle.plugins.stock.autonomy.ardupilot import wire
from tussle.plugins.stock.autonomy.ardupilot.links import JsonLink, ScrimmageLink, UdpLink

SERVO_MAP = """[ throttle 2 1000 +2000 0 +1 +1 ]
    [ elevator 1 1000 +2000 -1 +1 -1 ]
    [ aileron 0 1000 +2000 -1 +1 +1 ]
    [ rudder 3 1000 +2000 -1 +1 -1 ]"""
OF_JSON = "each vehicle has a port of its own: set port_instance_multiplier"
OF_SCRIMMAGE = "each vehicle has ports of its own: set ardupilot_port_base"


class ArduPilot(Autopilot):
    """Leaves a vehicle to ArduPilot's simulated flight controller (SITL), in another process.

    In each step it sends the true state of the vehicle by UDP, and writes ArduPilot's servo pulses [us] to channels: a row of
    `servo_map` is [channel output pulse_min pulse_max channel_min channel_max factor], outputs counted from 0. An output without pulses
    gives 0. With the protocol "scrimmage" states go to to_ardupilot_port, and servo packets come to from_ardupilot_port; with
    ardupilot_port_base, servo packets come to that port + port_instance_multiplier times the id, and states go to the next port. With
    "json" ArduPilot sends to json_port + port_instance_multiplier times (id - 1), and is answered there. With `on_restart` "reset", an
    ArduPilot that starts anew, as the numbers of its frames or its own port tell, finds its vehicle as it was at birth; `restarts`
    counts. See [Autopilots](../autopilots.md).

    Differences from SCRIMMAGE: it waits for the answer to each state, where `asynchronous_mode` was the default, and sends states
    again; an autopilot that is silent ends the world; servo packets are taken from to_ardupilot_ip only, at 127.0.0.1 unless listen_ip
    is another address; before the first servo packet the channels are 0 (there, those of pulses of 0 us); the acceleration is the
    mean of the last step.

    Raises:
        ParameterError: A port is taken, or an address is none.
        PluginError: ArduPilot does not answer, starts anew, sends too much, or a second one sends to its port.
    """

    awaits = "ArduPilot, such as its SITL"

    historic_attributes = HistoricAttributes(unread=("asynchronous_mode",))

    protocol = Param(
        "scrimmage", choices=("scrimmage", "json"), doc="Packets: of ArduPilot's model scrimmage, or JSON."
    )
    servo_map = ChannelMapParam(
        SERVO_MAP,
        n_inputs=wire.N_SERVOS,
        doc="Rows [channel output pulse_min pulse_max channel_min channel_max factor].",
    )
    to_ardupilot_ip = Param("127.0.0.1", doc="Where ArduPilot is, for the protocol scrimmage.")
    to_ardupilot_port = Param(
        5003, structural=True, ge=1, le=MAX_PORT, doc="Port of ArduPilot that takes states."
    )
    from_ardupilot_port = Param(
        5002, structural=True, ge=1, le=MAX_PORT, doc="Port of tussle that takes servo packets."
    )
    ardupilot_port_base = Param(
        0,
        structural=True,
        ge=0,
        le=MAX_PORT,
        doc="If not 0, the ports of each vehicle are counted from here.",
    )
    port_instance_multiplier = Param(
        10, structural=True, ge=0, le=MAX_PORT, doc="Ports are higher by this for each id."
    )
    json_port = Param(
        9002,
        structural=True,
        ge=1,
        le=MAX_PORT,
        doc="Port of tussle for the first vehicle, for the protocol json.",
    )
    listen_ip = Param("127.0.0.1", doc="Address of this machine at which servo packets are taken.")
    resend_period = Param(
        1.0,
        structural=True,
        unit="s",
        gt=0.0,
        doc="Time after which a state without an answer is sent again.",
    )

    on_restart = Param(
        "end",
        choices=("end", "reset"),
        structural=True,
        doc="What happens when ArduPilot starts anew: the world ends, or the vehicle is where it began.",
    )
    start_pose = State("x y z qw qx qy qz", unit="m m m 1 1 1 1", doc="Position and attitude at birth.")
    start_vel = State("x y z wx wy wz", unit="m/s m/s m/s rad/s rad/s rad/s", doc="Velocities at birth.")

    def begin(self, g: GroupView, rows: np.ndarray) -> None:
        """Store the states of newborn vehicles."""
        born = g.first + rows
        self.start_pose[:, rows] = np.concatenate([g.bodies.pos[:, born], g.bodies.quat[:, born]])
        self.start_vel[:, rows] = np.concatenate([g.bodies.vel[:, born], g.bodies.omega[:, born]])

    def restart(self, g: GroupView, row: int) -> None:
        """Put the vehicle where it began."""
        pose, vel = self.start_pose[:, row], self.start_vel[:, row]
        g.context.move(g.first + row, pos=pose[:3], quat=pose[3:], vel=vel[:3], omega=vel[3:])
        self.last_vel[:, row] = vel[:3]

    def channel_map(self) -> str:
        """The rows that map outputs to channels."""
        return str(self.servo_map)

    def open_one(self, row: Any) -> UdpLink:
        """Open the sockets of a vehicle.

        Raises:
            ParameterError: A port is taken, or an address is none.
        """
        own = row.plugin.values
        listen, address = (resolved(own[name], name) for name in ("listen_ip", "to_ardupilot_ip"))
        step, base = own["port_instance_multiplier"], own["ardupilot_port_base"]
        to_port, from_port = own["to_ardupilot_port"], own["from_ardupilot_port"]
        if base:
            to_port, from_port = base + step * row.id + 1, base + step * row.id
        json_port, is_json = own["json_port"] + step * (row.id - 1), own["protocol"] == "json"
        shift = own["world_step"] * row.world
        ports = [port + shift for port in ((json_port,) if is_json else (to_port, from_port))]
        release = self.claim(row, ports, OF_JSON if is_json else OF_SCRIMMAGE)
        may_restart = own["on_restart"] == "reset"
        how = own["lockstep"], own["timeout"], own["resend_period"], may_restart, release
        try:
            if is_json:
                return JsonLink(ports[0], listen, *how)
            return ScrimmageLink(address, ports[0], ports[1], listen, *how)
        except BaseException:
            release()
            raise
