"""An autonomy that shares out places to search by auctions."""

from __future__ import annotations

import numpy as np

from tussle.api import Autonomy, EntityRef, Field, GroupView, Message, Param, Publish, State, Subscribe
from tussle.messages import TextMessage, Waypoint

NO_BID = 1e300


class AreaOffer(Message):
    """The sender auctions an area."""

    area = Field(dtype=int, doc="Number of the area.")
    pos = Field("x y z", unit="m", doc="Its center.")


class AreaBid(Message):
    """What it costs the sender to search an area; the lowest bid wins."""

    auctioneer = EntityRef(doc="Auctioneer whom it is for.")
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
    """Auctions areas among all that hear of them, and visits those that it wins.

    Sequential single-item auctions (Lagoudakis and others 2005, "Auction-based multi-robot routing", Robotics: Science and Systems):
    an entity with `areas` offers one after another, for `duration` each; the lowest bid wins, of equal ones that of the smallest id.
    An area for which nobody bids is offered again. The rule `path` (there MINIMAX) bids the length of the own route with the area at
    its end, so that the longest route is short; `nearest` the distance to the area only; `random` a random number.

    The goal is published as a `Waypoint` on LocalNetwork, for a `GoTo` or `MoveToGoalMS`, and the texts "search" and "done" on its
    topic `Event`, for a `GraphvizFSM`, when the entity has the first area and when it has visited all.
    """

    grade = "portable"

    areas = Param((), fields="x y z", unit="m", ragged=True, doc="Centers of the areas that it auctions.")
    start_time = Param(0.0, unit="s", ge=0.0, doc="Time of the first auction.")
    duration = Param(1.0, unit="s", gt=0.0, doc="Time from an offer to its award.")
    rule = Param("path", choices=("path", "nearest", "random"), doc="What is bid.")
    does_bid = Param(True, doc="Whether it bids.")
    tolerance = Param(10.0, unit="m", gt=0.0, doc="Distance at which an area is visited.")
    network_name = Param("CommsNetwork", doc="Network of the auctions.")
    offered = State(dtype=int, doc="Number of the area that is auctioned.")
    deadline = State(unit="s", default=-1.0, doc="End of the auction; negative if there is none.")
    best_cost = State(default=NO_BID, doc="Lowest bid received.")
    best_bidder = EntityRef(doc="Entity that made it.")
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
        rows, heard = self.heard_awards.pairs()
        for k in np.flatnonzero(heard.winner == g.id[rows]):
            self.route[rows[k]] = np.concatenate([self.route[rows[k]], heard.pos[:, k : k + 1]], axis=1)

    def _visit(self, g: GroupView, had_route: np.ndarray) -> None:
        """Publish the first area of each route, or drop it where the entity is there."""
        rows = np.flatnonzero(self.route.count)
        there = length(self.route.data[:, self.route.start[rows]] - g.pos[:, rows]) <= self.tolerance[rows]
        self.n_visited[rows[there]] += 1
        for row in rows[there]:
            self.route[row] = self.route[row][:, 1:]
        has_route = self.route.count > 0
        rows = np.flatnonzero(has_route)
        self.goals.publish(rows, pos=self.route.data[:, self.route.start[rows]])
        changed = np.flatnonzero(has_route != had_route)
        self.events.publish(changed, text=["search" if has_route[row] else "done" for row in changed])

    def _bid(self, g: GroupView) -> None:
        """Bid in the auctions that were heard of."""
        rows, heard = self.heard_offers.pairs()
        bids = self.does_bid[rows]
        rows, heard = rows[bids], heard.take(np.flatnonzero(bids))
        count, end = self.route.count[rows], self.route.start[1:][rows] - 1
        if self.rule == "random":
            rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
            cost = g.uniform("bid", int(rank.max(initial=0)) + 1)[rank, rows]
        elif self.rule == "nearest":
            cost = length(heard.pos - g.pos[:, rows])
        else:
            at = g.pos[:, rows].copy()
            at[:, count > 0] = self.route.data[:, end[count > 0]]
            cost = self._lengths(g)[rows] + length(heard.pos - at)
        self.bids.publish(rows, auctioneer=heard.sender, area=heard.area, cost=cost)

    def _lengths(self, g: GroupView) -> np.ndarray:
        """Length of each route [m], from the entity on, (n,)."""
        data, row = self.route.data, self.route.row
        is_first = np.zeros(len(row), bool)
        is_first[self.route.start[:-1][self.route.count > 0]] = True
        before = np.where(is_first, g.pos[:, row], np.roll(data, 1, axis=1))
        return np.asarray(self.route.sum(length(data - before)))

    def _collect(self, g: GroupView) -> None:
        """Keep the lowest bid of each auctioneer."""
        rows, heard = self.heard_bids.pairs()
        own = (heard.auctioneer == g.id[rows]) & (heard.area == self.offered[rows])
        own &= self.deadline[rows] >= 0.0
        order = np.lexsort((heard.sender, heard.cost, rows))
        order = order[own[order]]
        rows, first = np.unique(rows[order], return_index=True)
        best = order[first]
        lower = heard.cost[best] < self.best_cost[rows]
        self.best_cost[rows[lower]] = heard.cost[best[lower]]
        self.best_bidder[rows[lower]] = heard.sender[best[lower]]

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
