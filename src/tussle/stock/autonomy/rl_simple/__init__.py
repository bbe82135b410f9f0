"""RLSimple: earns rewards near the origin, with actions of an actor."""

from tussle.stock.autonomy.rl_simple.plugin import RLSimple, adapted

__all__ = ["RLSimple", "adapted"]
