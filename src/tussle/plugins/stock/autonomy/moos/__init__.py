"""An autonomy that takes its commands from a community of MOOS."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from tussle.api import Autonomy, GroupView, Handle, HistoricAttributes, Output, Param, State
from tussle.errors import MissingFileError, ParameterError
from tussle.plugins.stock.autonomy.moos import wire
from tussle.plugins.stock.autonomy.moos.vessel import Vessel, community_of

NAVIGATION = ("NAV_X", "NAV_Y", "NAV_HEADING", "NAV_SPEED", "NAV_DEPTH")
MAX_PORT = 65535
LAUNCH = "launch.sh"
"""Script beside the missions of MOOS that writes them from templates and starts the communities."""


class Communities(dict[tuple[str, int], str]):
    """Host and port of each community of a simulation -> its vehicle: no two share one."""

    def end(self) -> None:
        """Forget them."""
        self.clear()


class MOOSAutonomy(Autonomy):
    """A helm of MOOS-IvP steers the vehicle: each vehicle is a client of the MOOSDB of its own community.

    It publishes NAV_X, NAV_Y, NAV_HEADING, NAV_SPEED, NAV_DEPTH and NODE_REPORT_LOCAL of the vehicle, and NODE_REPORT of each other
    entity. It obeys DESIRED_HEADING, DESIRED_SPEED and DESIRED_DEPTH; until they come, the vehicle holds its first heading and
    altitude at 0 m/s. Headings are in degrees clockwise from North, x is East, y is North, depths are positive down. A step waits
    for the clock, `MOOSTimeWarp` times as fast as it is; with `lockstep` it waits until the helm has answered TUSSLE_STEP with
    TUSSLE_STEP_DONE. MOOSDB and helm are started by you: see the page "A helm of MOOS-IvP".

    Differences from the existing system: NODE_REPORT_LOCAL is sent; the time warp is that of MOOS's mission file; commands are used
    from their first message on (there, 0 m/s and North until then); a MOOSDB or helm that fails ends the world, unless `on_loss` says
    that it waits for a MOOSDB that comes back, or goes on until then.

    Raises:
        ParameterError: The mission file of MOOS cannot be read, or two vehicles have one community.
        PluginError: MOOSDB or helm do not answer, end, send garbage or too much, or two helms steer.
    """

    grade = "external"
    awaits = "a community of MOOS-IvP with MOOSDB and helm"
    historic_attributes = HistoricAttributes(unread=("moos_script", "enable_actuator_control"))

    moos_mission_file = Param(
        "", doc="Mission file of MOOS, for ServerHost, ServerPort, Community and MOOSTimeWarp; may be empty."
    )
    moos_host = Param("", doc="Where the MOOSDB is; empty for that of the file, or 127.0.0.1.")
    moos_port = Param(0, structural=True, ge=0, le=MAX_PORT, doc="Its port; 0 for that of the file, or 9000.")
    port_step = Param(
        0, structural=True, ge=0, le=MAX_PORT, doc="The port is higher by this for each id above 1."
    )
    world_step = Param(0, structural=True, ge=0, le=MAX_PORT, doc="The same for each world of a stack.")
    moos_community = Param("", doc="Name that the community must have; empty for that of the file, or any.")
    moos_time_warp = Param(
        0.0, structural=True, ge=0.0, le=1000.0, doc="Simulated time over time; 0 for that of the file, or 1."
    )
    moos_app_name = Param("tussle", doc="Name of the client, before the id of the entity.")
    lockstep = Param(
        False, structural=True, doc="Wait in each step for the helm's answer, not for the clock."
    )
    contact_period = Param(
        0.0, structural=True, unit="s", ge=0.0, doc="Time between reports of contacts; 0 for each step."
    )
    timeout = Param(10.0, structural=True, unit="s", gt=0.0, doc="Longest wait for MOOSDB and helm.")
    on_loss = Param(
        "end",
        choices=("end", "wait", "go_on"),
        structural=True,
        doc="When the MOOSDB ends: the world ends, waits until it is back (at most timeout), or goes on with the last commands until then.",
    )
    losses = State(dtype=int, doc="How often the connection was lost.")
    vessel = Handle(doc="The connection with the community.")
    desired_heading = Output(unit="rad", doc="From DESIRED_HEADING, counter-clockwise from East.")
    desired_speed = Output(unit="m/s", doc="DESIRED_SPEED.")
    desired_altitude = Output(unit="m", doc="From DESIRED_DEPTH.")

    @classmethod
    def with_files(cls, given: Mapping[str, str], find: Callable[[str], Path]) -> dict[str, str]:
        """Return the path of the mission file of MOOS; none if it is not there, since MOOS's launch scripts write theirs."""
        name = given.get("moos_mission_file", "")
        if not name or Path(name).is_file():
            return {}
        with suppress(MissingFileError):
            return {"moos_mission_file": str(find(name))}
        with suppress(MissingFileError):  # where its script will write it
            folder = find(f"{Path(name).parent.name}/{LAUNCH}").parent
            return {"moos_mission_file": str(folder / Path(name).name)}
        find(name)
        return {}

    @property
    def awaited(self) -> str:
        """The community, and its mission file if it is not there."""
        path = Path(self.values["moos_mission_file"])
        has_file = not path.name or path.is_file()
        return (
            self.awaits
            if has_file
            else f"{path.name}, which {LAUNCH} in {path.parent} writes, and {self.awaits}"
        )

    def open_one(self, row: Any) -> Vessel:
        """Connect to the community of an entity, without waiting.

        Raises:
            ParameterError: The mission file cannot be read, or the community belongs to another vehicle.
        """
        values = row.plugin.values
        found = community_of(values)
        port = found.port + values["port_step"] * (row.id - 1) + values["world_step"] * row.world
        place, owners = (found.host, port), row.shared("MOOS", Communities)
        if place in owners or port > MAX_PORT:
            whose = f"is the community of {owners[place]}" if place in owners else f"is above {MAX_PORT}"
            raise ParameterError(
                f"port {port} of {found.host} {whose}; each vehicle has a community of its own: give each its mission file "
                f"of MOOS or its moos_port, or set port_step and, for several worlds, world_step"
            )
        owners[place] = f"entity {row.id} of world {row.world}"
        name = f"{values['moos_app_name']}_{row.id}"
        return Vessel(
            replace(found, port=port), name, values["timeout"], values["lockstep"], values["on_loss"],
            release=lambda: owners.pop(place, None),
        )  # fmt: skip

    def close_one(self, vessel: Vessel) -> None:
        """End the connection."""
        vessel.close()

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Hold heading and altitude."""
        self.desired_heading[rows] = g.column("yaw", rows)
        self.desired_altitude[rows] = g.pos[2, rows]

    def step(self, g: GroupView) -> None:
        """Tell the communities where all are, and do as their helms say."""
        vessels: list[Any] = list(self.vessel)
        limit = time.monotonic() + self.timeout
        for vessel in vessels:
            vessel.await_helm(limit)
        if not self.lockstep:
            for vessel in vessels:
                vessel.await_clock(float(g.t[0]), g.dt)
        self._publish(g, vessels)
        if self.lockstep:
            limit = time.monotonic() + self.timeout
            for vessel in vessels:
                vessel.await_answer(limit)
        for row, vessel in enumerate(vessels):
            if vessel.failure:
                g.fail(row, vessel.failure)
            self.losses[row] = vessel.client.n_lost
            self._obey(row, vessel.commands())

    def _obey(self, row: int, commands: dict[str, float]) -> None:
        """Write the commands of a helm to the channels."""
        if "DESIRED_HEADING" in commands:
            angle = math.radians(90.0 - commands["DESIRED_HEADING"])
            self.desired_heading[row] = math.remainder(angle, 2.0 * math.pi)
        if "DESIRED_SPEED" in commands:
            self.desired_speed[row] = commands["DESIRED_SPEED"]
        if "DESIRED_DEPTH" in commands:
            self.desired_altitude[row] = -commands["DESIRED_DEPTH"]

    def _publish(self, g: GroupView, vessels: list[Any]) -> None:
        """Send each vehicle's state and its contacts to its community."""
        states = _navigation(g.pos, g.vel, g.yaw).T.tolist()
        t, steps, worlds, ids, teams = (x.tolist() for x in (g.t, g.step_count, g.world, g.id, g.team))
        contacts: dict[int, dict[int, bytes]] = {}
        for row, vessel in enumerate(vessels):
            now = t[row] if self.lockstep else vessel.moos_time
            numbers = [wire.encode_tail(k, x, now) for k, x in zip(NAVIGATION, states[row], strict=True)]
            local = _report(ids[row], teams[row], states[row], now)
            reports = [wire.encode_tail("NODE_REPORT_LOCAL", local, now)]
            if t[row] - vessel.reported >= self.contact_period - 1e-9:
                vessel.reported, world = t[row], worlds[row]
                if world not in contacts:
                    contacts[world] = _contacts(g, world, now)
                reports += [tail for other, tail in contacts[world].items() if other != ids[row]]
            vessel.publish(numbers, reports, steps[row], now)


def _navigation(pos: np.ndarray, vel: np.ndarray, yaw: np.ndarray) -> np.ndarray:
    """Values of NAVIGATION, (5, n): x, y [m], heading [deg] clockwise from North in [0, 360), speed [m/s], depth [m]."""
    speed = np.sqrt(vel[0] * vel[0] + vel[1] * vel[1] + vel[2] * vel[2])
    return np.stack([pos[0], pos[1], np.degrees(0.5 * np.pi - yaw) % 360.0, speed, 0.0 - pos[2]])


def _contacts(g: GroupView, world: int, time_: float) -> dict[int, bytes]:
    """Messages that report the entities of a world, by id."""
    bodies = g.bodies
    rows = np.flatnonzero(bodies.world == world)
    states = _navigation(bodies.pos[:, rows], bodies.vel[:, rows], bodies.yaw[rows]).T.tolist()
    heads = zip(bodies.id[rows].tolist(), bodies.team[rows].tolist(), states, strict=True)
    return {
        id_: wire.encode_tail("NODE_REPORT", _report(id_, team, state, time_), time_)
        for id_, team, state in heads
    }


def _report(id_: int, team: int, state: list[float], time_: float) -> str:
    """A node report of MOOS-IvP; state: the values of NAVIGATION. GROUP is no number, since MOOS-IvP does not read numbers as groups."""
    x, y, heading, speed, depth = state
    return (
        f"NAME={id_},X={x:.3f},Y={y:.3f},SPD={speed:.3f},HDG={heading:.3f},DEP={depth:.3f},TYPE=KAYAK,GROUP=team_{team},"
        f"MODE=none,TIME={time_:.3f}"
    )
