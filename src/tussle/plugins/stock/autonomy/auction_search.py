"""An autonomy that distributes areas to search by auctions."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, EntityRef, Field, GroupView, Message, Param, Publish, State, Subscribe
from tussle.declare.messages import TextMessage, Waypoint
from tussle.numeric.ways import closest_approach

NO_BID = 1e300


class AreaOffer(Message):
    """The sender auctions an area."""

    area = Field(dtype=int, doc="Number of the area.")
    pos = Field("x y z", unit="m", doc="Its center.")


class AreaBid(Message):
    """Cost of searching an area, for the sender; the lowest bid wins."""

    auctioneer = EntityRef(doc="Auctioneer that receives the bid.")
    area = Field(dtype=int, doc="Number of the area.")
    cost = Field(doc="The bid.")


class AreaAward(Message):
    """The auction of an area is over."""

    winner = EntityRef(doc="Entity with the lowest bid.")
    pos = Field("x y z", unit="m", doc="Center of the area.")


def length(v: np.ndarray) -> np.ndarray:
    """Lengths, (n,), of vectors, (3, n)."""
    return np.asarray(np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]))


class AuctionSearch(Autonomy):
    """Auctions areas among all entities that receive its offers, and visits the areas that it wins.

    Sequential single-item auctions (Lagoudakis and others 2005, "Auction-based multi-robot routing", Robotics: Science and Systems):
    an entity with `areas` offers one after another, for `duration` each. The lowest bid wins; on ties, that of the smallest id. An area
    without bids is offered again. The rule `path` (MINIMAX in the paper) bids the length of the own route extended by the area, so that
    the longest route is short. The rule `nearest` bids the distance to the area, `random` a random number.

    The goal is published as a `Waypoint` on LocalNetwork, for a `GoTo` or `MoveToGoalMS`. On the topic `Event` of that network, for a
    `GraphvizFSM`, the text "search" is published when the entity wins its first area, and "done" when it has visited all.
    """

    grade = "portable"

    areas = Param((), fields="x y z", unit="m", ragged=True, doc="Centers of the areas that it auctions.")
    start_time = Param(0.0, unit="s", ge=0.0, doc="Time of the first auction.")
    duration = Param(1.0, unit="s", gt=0.0, doc="Time from an offer to its award.")
    rule = Param("path", choices=("path", "nearest", "random"), doc="Rule of the bids.")
    does_bid = Param(True, doc="Whether it bids.")
    tolerance = Param(10.0, unit="m", gt=0.0, doc="Distance at which an area is visited.")
    network_name = Param("CommsNetwork", doc="Network of the auctions.")
    offered = State(dtype=int, doc="Number of the area that is auctioned.")
    deadline = State(unit="s", default=-1.0, doc="End of the auction; negative if there is none.")
    best_cost = State(default=NO_BID, doc="Lowest bid received.")
    best_bidder = EntityRef(doc="Entity that made the lowest bid.")
    route = State("x y z", unit="m", ragged=True, doc="Areas won and not visited, in order.")
    n_visited = State(dtype=int, doc="Areas visited.")
    offers = Publish(AreaOffer, network_param="network_name")
    bids = Publish(AreaBid, network_param="network_name")
    awards = Publish(AreaAward, network_param="network_name")
    goals = Publish(Waypoint, network="LocalNetwork")
    events = Publish(TextMessage, network="LocalNetwork", topic="Event")
    heard_offers = Subscribe(AreaOffer, network_param="network_name")
    heard_bids = Subscribe(AreaBid, network_param="network_name")
    heard_awards = Subscribe(AreaAward, network_param="network_name")

    def step(self, g: GroupView) -> None:
        had_route = self.route.count > 0
        if self.heard_awards:
            self._extend(g)
        self._visit(g, had_route)
        if self.heard_offers:
            self._bid(g)
        if self.heard_bids:
            self._collect(g)
        self._auction(g)

    def _extend(self, g: GroupView) -> None:
        """Append the areas that were won to the routes."""
        rows, messages = self.heard_awards.pairs()
        for k in np.flatnonzero(messages.winner == g.id[rows]):
            self.route[rows[k]] = np.concatenate([self.route[rows[k]], messages.pos[:, k : k + 1]], axis=1)

    def _visit(self, g: GroupView, had_route: np.ndarray) -> None:
        """Publish the first area of each route, after removal of areas that the entity has reached."""
        rows = np.flatnonzero(self.route.count)
        way = (
            g.vel[:, rows] * g.dt
        )  # that of the last step: an area is visited when it comes within the tolerance
        offset = g.pos[:, rows] - way - self.route.data[:, self.route.start[rows]]
        there = closest_approach(offset, way)[1] <= self.tolerance[rows]
        self.n_visited[rows[there]] += 1
        for row in rows[there]:
            self.route[row] = self.route[row][:, 1:]
        has_route = self.route.count > 0
        rows = np.flatnonzero(has_route)
        self.goals.publish(rows, pos=self.route.data[:, self.route.start[rows]])
        changed = np.flatnonzero(has_route != had_route)
        self.events.publish(changed, text=["search" if has_route[row] else "done" for row in changed])

    def _bid(self, g: GroupView) -> None:
        """Bid in the auctions that were announced by messages."""
        rows, messages = self.heard_offers.pairs()
        bids = self.does_bid[rows]
        rows, messages = rows[bids], messages.take(np.flatnonzero(bids))
        count, end = self.route.count[rows], self.route.start[1:][rows] - 1
        if self.rule == "random":
            rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
            cost = g.uniform("bid", int(rank.max(initial=0)) + 1)[rank, rows]
        elif self.rule == "nearest":
            cost = length(messages.pos - g.pos[:, rows])
        else:
            at = g.pos[:, rows].copy()
            at[:, count > 0] = self.route.data[:, end[count > 0]]
            cost = self._lengths(g)[rows] + length(messages.pos - at)
        self.bids.publish(rows, auctioneer=messages.sender, area=messages.area, cost=cost)

    def _lengths(self, g: GroupView) -> np.ndarray:
        """Length of each route [m], from the entity on, (n,)."""
        data, row = self.route.data, self.route.row
        is_first = np.zeros(len(row), bool)
        is_first[self.route.start[:-1][self.route.count > 0]] = True
        before = np.where(is_first, g.pos[:, row], np.roll(data, 1, axis=1))
        return np.asarray(self.route.sum(length(data - before)))

    def _collect(self, g: GroupView) -> None:
        """Keep the lowest bid of each auctioneer."""
        rows, messages = self.heard_bids.pairs()
        own = (messages.auctioneer == g.id[rows]) & (messages.area == self.offered[rows])
        own &= self.deadline[rows] >= 0.0
        order = np.lexsort((messages.sender, messages.cost, rows))
        order = order[own[order]]
        rows, first = np.unique(rows[order], return_index=True)
        best = order[first]
        lower = messages.cost[best] < self.best_cost[rows]
        self.best_cost[rows[lower]] = messages.cost[best[lower]]
        self.best_bidder[rows[lower]] = messages.sender[best[lower]]

    def _auction(self, g: GroupView) -> None:
        """Award the areas whose time is over, and offer the next ones."""
        now = g.t + 1e-6 * g.dt
        ends = (self.deadline >= 0.0) & (now >= self.deadline)
        sold = np.flatnonzero(ends & (self.best_cost < NO_BID))
        at = self.areas.start[sold] + self.offered[sold]
        self.awards.publish(sold, winner=self.best_bidder[sold], pos=self.areas.data[:, at])
        self.offered[sold] += 1
        self.best_cost[sold], self.best_bidder[sold] = NO_BID, 0
        self.deadline[ends] = -1.0
        opens = (self.deadline < 0.0) & (now >= self.start_time) & (self.offered < self.areas.count)
        opens = np.flatnonzero(opens)
        self.deadline[opens] = g.t[opens] + self.duration[opens]
        at = self.areas.start[opens] + self.offered[opens]
        self.offers.publish(opens, area=self.offered[opens], pos=self.areas.data[:, at])
