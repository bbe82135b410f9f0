"""AuctionAssign as in SCRIMMAGE."""

from __future__ import annotations

import numpy as np

from tussle.api import GroupView
from tussle.plugins.stock.autonomy import auction_assign


class AuctionAssign(auction_assign.AuctionAssign):
    """AuctionAssign in which only the entity with the id 1 can be the auctioneer; in tussle every entity with `auctioneer` is."""

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        self.has_started[rows] = g.id[rows] != 1
