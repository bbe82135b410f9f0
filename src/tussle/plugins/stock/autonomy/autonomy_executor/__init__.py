"""AutonomyExecutor: switches between autonomies by the state of the entity."""

from tussle.plugins.stock.autonomy.autonomy_executor.plugin import AutonomyExecutor

__all__ = ["AutonomyExecutor"]
