"""A column of vehicles and its guards, which communicate by radio."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, EntityRef, Field, GroupView, Message, Param, Publish, Subscribe, unit
from tussle.declare.messages import CaptureEntity, Waypoint
from tussle.numeric.ways import closest_approach


class ConvoyReport(Message):
    """Position of a vehicle of a convoy."""

    pos = Field("x y z", unit="m")


class IntruderAlarm(Message):
    """Position of an intruder that a vehicle of a convoy sees."""

    pos = Field("x y z", unit="m")


def seen(g: GroupView, team: np.ndarray, sight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return rows that see an entity of `team`, (n,), within `sight` [m], (n,), and the row of the nearest one in the body table."""
    nearest = g.nearest(teams=team)
    rows = np.flatnonzero((nearest.other[0] >= 0) & (nearest.distance[0] <= sight))
    return rows, nearest.other[0, rows]


def first_of(rows: np.ndarray, key: np.ndarray) -> np.ndarray:
    """Return the index of the item with the smallest key of each row; on ties, the first."""
    order = np.lexsort((key, rows))
    return np.asarray(order[np.unique(rows[order], return_index=True)[1]])


class Convoy(Autonomy):
    """Follows the vehicle ahead in a column, and reports intruders, both by radio.

    In every step each vehicle sends its position, and that of the nearest intruder within `sight`. Of the vehicles whose reports it
    receives, a vehicle follows the one with the next lower id: it publishes a `Waypoint`, `gap` behind that vehicle, for a `GoTo` after
    it. The first vehicle follows the waypoints of its own `GoTo`. A vehicle that receives no reports goes to
    its last waypoint and waits there.
    """

    grade = "portable"
    named_teams = ("intruder_team",)

    gap = Param(30.0, unit="m", ge=0.0, doc="Distance of the goal behind the vehicle ahead.")
    sight = Param(250.0, unit="m", ge=0.0, doc="Distance below which intruders are seen.")
    intruder_team = Param(2, doc="Team of the intruders.")
    network_name = Param("CommsNetwork", doc="Network of the reports and alarms.")
    ahead = EntityRef(doc="Vehicle that is followed.")
    reports = Publish(ConvoyReport, network_param="network_name")
    alarms = Publish(IntruderAlarm, network_param="network_name")
    goals = Publish(Waypoint, network="LocalNetwork")
    heard = Subscribe(ConvoyReport, network_param="network_name")

    def step(self, g: GroupView) -> None:
        rows, messages = self.heard.pairs()
        is_ahead = np.flatnonzero((messages.sender < g.id[rows]) & (messages.sender > 0))
        last = is_ahead[first_of(rows[is_ahead], -messages.sender[is_ahead])]
        rows = rows[last]
        self.ahead[rows] = messages.sender[last]
        ahead = messages.pos[:, last]
        self.goals.publish(rows, pos=ahead - self.gap[rows] * unit(ahead - g.pos[:, rows]))
        self.reports.publish(np.arange(g.n), pos=g.pos)
        rows, others = seen(g, self.intruder_team, self.sight)
        self.alarms.publish(rows, pos=g.bodies.pos[:, others])


class Escort(Autonomy):
    """Guards a convoy: flies to the nearest intruder that is reported or seen, otherwise to the middle of the convoy.

    It publishes the goal as a `Waypoint` for a `GoTo` after it. The middle is the mean of the positions that are reported in a step. It
    claims the nearest intruder if it is within `capture_range`, or comes there during the step; `SimpleCapture` decides the claims.
    Without reports it keeps its goal.
    """

    grade = "portable"
    named_teams = ("intruder_team",)

    sight = Param(60.0, unit="m", ge=0.0, doc="Distance below which its own sensor sees intruders.")
    capture_range = Param(10.0, unit="m", ge=0.0, doc="Distance below which an intruder is claimed.")
    intruder_team = Param(2, doc="Team of the intruders.")
    network_name = Param("CommsNetwork", doc="Network of the reports and alarms.")
    goals = Publish(Waypoint, network="LocalNetwork")
    captures = Publish(CaptureEntity)
    reports = Subscribe(ConvoyReport, network_param="network_name")
    alarms = Subscribe(IntruderAlarm, network_param="network_name")

    def step(self, g: GroupView) -> None:
        goal, has_goal = np.zeros((3, g.n)), np.zeros(g.n, bool)
        if self.reports:
            rows, messages = self.reports.pairs()
            count = np.bincount(rows, minlength=g.n)
            for total, part in zip(goal, messages.pos, strict=True):
                np.add.at(total, rows, part)
            goal /= np.maximum(count, 1)
            has_goal |= count > 0
        if self.alarms:
            rows, messages = self.alarms.pairs()
            x, y, z = messages.pos - g.pos[:, rows]
            first = first_of(rows, x * x + y * y + z * z)
            goal[:, rows[first]], has_goal[rows[first]] = messages.pos[:, first], True
        nearest = g.nearest(teams=self.intruder_team)
        others = nearest.other[0]
        rows = np.flatnonzero((others >= 0) & (nearest.distance[0] <= self.sight))
        goal[:, rows], has_goal[rows] = g.bodies.pos[:, others[rows]], True
        self.goals.publish(np.flatnonzero(has_goal), pos=goal[:, has_goal])
        _, least = closest_approach(nearest.offset[:, 0], g.dt * (g.bodies.vel[:, others] - g.vel))
        rows = np.flatnonzero((others >= 0) & (least <= self.capture_range))
        self.captures.publish(rows, target=g.bodies.id[others[rows]])
