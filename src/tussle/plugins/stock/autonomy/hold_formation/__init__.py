"""Flying in formation."""

from tussle.plugins.stock.autonomy.hold_formation.plugin import HoldFormation

__all__ = ["HoldFormation"]
