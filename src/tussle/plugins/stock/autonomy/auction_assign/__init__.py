"""AuctionAssign: auctions a task."""

from tussle.plugins.stock.autonomy.auction_assign.plugin import (
    AuctionAssign,
    BidAuction,
    ResultAuction,
    StartAuction,
)

__all__ = ["AuctionAssign", "BidAuction", "ResultAuction", "StartAuction"]
