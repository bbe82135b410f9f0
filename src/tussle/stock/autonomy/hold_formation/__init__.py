"""Flying in formation."""

from tussle.stock.autonomy.hold_formation.plugin import HoldFormation

__all__ = ["HoldFormation"]
