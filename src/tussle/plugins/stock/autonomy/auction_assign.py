"""An autonomy that auctions a task among the entities that receive its messages."""

from __future__ import annotations

import numpy as np

from tussle.api import (
    Autonomy,
    EntityRef,
    Field,
    GroupView,
    HistoricAttributes,
    Message,
    Output,
    Param,
    Publish,
    State,
    Subscribe,
)

NO_BID = -1e300


class StartAuction(Message):
    """The sender starts an auction."""


class BidAuction(Message):
    """A bid of the sender."""

    auctioneer = EntityRef(doc="Auctioneer that receives the bid.")
    bid = Field(doc="The bid.")


class ResultAuction(Message):
    """The auction of the sender is over."""

    winner = EntityRef(doc="Entity with the highest bid.")
    bid = Field(doc="Its bid.")


class AuctionAssign(Autonomy):
    """Runs an auction by messages, a method of task assignment for robots (Gerkey and Mataric 2002).

    Each auctioneer starts one auction when it is created. Every entity that receives the start, including the auctioneer, bids a
    uniform random number once. When `duration` has passed, the auctioneer publishes the highest bid; on ties, that of the smallest id.
    An entity out of range of the network neither bids nor receives the result. The entity does not move.
    """

    grade = "portable"
    historic_attributes = HistoricAttributes(unread=("module", "class", "library"))

    auctioneer = Param(True, doc="Whether it starts an auction.")
    duration = Param(5.0, unit="s", ge=0.0, doc="Time from the start of an auction to its result.")
    bid_range = Param((-10.0, 10.0), fields="low high", doc="Limits of the bids.")
    network_name = Param("CommsNetwork", doc="Network of the auctions.")
    deadline = State(
        unit="s", default=-1.0, doc="Time of the own result; negative before the start and after the end."
    )
    has_started = State(dtype=bool, doc="Whether the own auction was started.")
    best_bid = State(default=NO_BID, doc="Highest bid received in the own auction.")
    best_bidder = EntityRef(doc="Entity that made the highest bid.")
    winner = EntityRef(doc="Winner of the auction whose result was received last.")
    starts = Publish(StartAuction, network_param="network_name")
    bids = Publish(BidAuction, network_param="network_name")
    results = Publish(ResultAuction, network_param="network_name")
    heard_starts = Subscribe(StartAuction, network_param="network_name")
    heard_bids = Subscribe(BidAuction, network_param="network_name")
    heard_results = Subscribe(ResultAuction, network_param="network_name")
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s", doc="Zero.")

    def step(self, g: GroupView) -> None:
        if self.heard_results:
            rows, messages = self.heard_results.latest()
            self.winner[rows] = messages.winner
        if self.heard_starts:
            self._bid(g)
        if self.heard_bids:
            self._collect(g)
        opens = np.flatnonzero(self.auctioneer & ~self.has_started)
        self.has_started[opens] = True
        self.deadline[opens] = g.t[opens] + self.duration[opens]
        self.starts.publish(opens)
        is_over = self.has_started & (self.deadline >= 0.0) & (g.t + 1e-6 * g.dt >= self.deadline)
        announced = np.flatnonzero(is_over & (self.best_bid > NO_BID))
        self.deadline[is_over] = -1.0
        self.results.publish(announced, winner=self.best_bidder[announced], bid=self.best_bid[announced])

    def _bid(self, g: GroupView) -> None:
        """Bid in the auctions that were announced by messages."""
        rows, messages = self.heard_starts.pairs()
        rank = np.arange(len(rows)) - np.searchsorted(rows, rows)
        draws = g.uniform("bid", int(rank.max(initial=0)) + 1)[rank, rows]
        low, high = self.bid_range[:, rows]
        self.bids.publish(rows, auctioneer=messages.sender, bid=low + (high - low) * draws)

    def _collect(self, g: GroupView) -> None:
        """Keep the highest bid of each auctioneer."""
        rows, messages = self.heard_bids.pairs()
        order = np.lexsort((messages.sender, -messages.bid, rows))
        order = order[(messages.auctioneer[order] == g.id[rows[order]]) & (self.deadline[rows[order]] >= 0.0)]
        rows, first = np.unique(rows[order], return_index=True)
        best = order[first]
        better = messages.bid[best] > self.best_bid[rows]
        self.best_bid[rows[better]] = messages.bid[best[better]]
        self.best_bidder[rows[better]] = messages.sender[best[better]]
