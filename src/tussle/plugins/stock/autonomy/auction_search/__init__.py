"""AuctionSearch: distributes areas to search by auctions."""

from tussle.plugins.stock.autonomy.auction_search.plugin import AreaAward, AreaBid, AreaOffer, AuctionSearch

__all__ = ["AreaAward", "AreaBid", "AreaOffer", "AuctionSearch"]
