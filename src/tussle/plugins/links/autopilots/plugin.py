"""The base class of autonomies that leave a vehicle to an autopilot."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable
from functools import partial
from typing import Any

import numpy as np

from tussle.api import Autonomy, GroupView, Handle, Output, Param, State
from tussle.api.channel_map import CHANNEL_UNITS, channel_outputs, write_channels
from tussle.plugins.links.autopilots.frames import vehicle_states
from tussle.plugins.links.autopilots.link import MAX_PORT, AutopilotLink, OwnedPorts, StepClock, await_links


class Autopilot(Autonomy):
    """An autonomy whose commands come from an autopilot in another process; abstract."""

    grade = "external"

    lockstep = Param(
        True, structural=True, doc="Wait in each step for the autopilot's answer, not for the clock."
    )
    time_warp = Param(
        1.0, structural=True, gt=0.0, le=1000.0, doc="Simulated time over time, without lockstep."
    )
    timeout = Param(30.0, structural=True, unit="s", gt=0.0, doc="Longest wait for the autopilot, wall time.")
    world_step = Param(
        0, structural=True, ge=0, le=MAX_PORT, doc="Ports are higher by this for each world of a stack."
    )
    for _channel, _unit in CHANNEL_UNITS.items():
        vars()[f"{_channel}_out"] = Output(_channel, unit=_unit, doc="Command.")
    unanswered = State(
        doc="Steps in lockstep that went on with the commands before, without an answer.", dtype=int
    )
    restarts = State(doc="How often the autopilot has started anew.", dtype=int)
    last_vel = State("x y z", unit="m/s", doc="Velocity at the last step, world frame.")
    link = Handle(doc="The connection with the autopilot.")

    @abstractmethod
    def channel_map(self) -> str:
        """The rows that map the autopilot's outputs to channels."""

    @abstractmethod
    def open_one(self, row: Any) -> AutopilotLink:
        """Open the sockets of a vehicle."""

    def offered_outputs(self) -> list[str]:
        """Return the channels of the map."""
        return channel_outputs(self.channel_map())

    def claim(self, row: Any, ports: Iterable[int], advice: str) -> Callable[[], None]:
        """Reserve ports for the vehicle of a handle's row; see `OwnedPorts.claim`."""
        owner = f"entity {row.id} of world {row.world}"
        more = f"{advice}, and for several worlds world_step"
        return row.shared("autopilots", OwnedPorts).claim(owner, ports, more)  # type: ignore[no-any-return]

    def close_one(self, link: AutopilotLink) -> None:
        """Close the sockets."""
        link.close()

    def begin(self, g: GroupView, rows: np.ndarray) -> None:
        """Begin with newborn rows; by default nothing."""

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Start without acceleration."""
        self.begin(g, rows)
        self.last_vel[:, rows] = g.bodies.vel[:, g.first + rows]

    def draws(self, g: GroupView) -> np.ndarray:
        """Standard normal numbers for the sensors of each row, (k, n)."""
        return np.empty((0, g.n))

    def restart(self, g: GroupView, row: int) -> None:
        """An autopilot has started anew; by default its vehicle goes on."""

    def step(self, g: GroupView) -> None:
        """Tell the autopilots where their vehicles are, and do as they say."""
        links: list[Any] = list(self.link)
        is_interrupted = g.context.is_interrupted
        if links and not self.lockstep:
            clock = g.context.share(("autopilots' clock", self.time_warp), partial(StepClock, self.time_warp))
            clock.pace.hold(float(g.t[0]), g.dt, is_interrupted)
        states, draws = vehicle_states(g, self.last_vel), self.draws(g).T.tolist()
        for link, state, own in zip(links, states, draws, strict=True):
            link.begin(state, own)
        self.last_vel[:] = g.bodies.vel[:, g.first : g.last]
        await_links(links, is_interrupted)
        for row, link in enumerate(links):
            link.leave()
            self.unanswered[row] += link.is_unanswered
            self.restarts[row] += link.has_restarted
            if link.has_restarted:
                self.restart(g, row)
            link.is_unanswered = link.has_restarted = False
            if link.failure:
                g.fail(row, link.failure)
            elif link.commands is not None:
                write_channels(self, self.channel_map(), row, link.commands)
