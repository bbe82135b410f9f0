"""RandomAttrit: random losses of a team."""

from tussle.plugins.stock.interaction.random_attrit.plugin import RandomAttrit

__all__ = ["RandomAttrit"]
