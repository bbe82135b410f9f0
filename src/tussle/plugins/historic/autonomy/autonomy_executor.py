"""AutonomyExecutor as in SCRIMMAGE."""

from __future__ import annotations

from tussle.api import Autonomy, Children, HistoricAttributes
from tussle.plugins.historic.autonomy.straight import Straight
from tussle.plugins.stock.autonomy import autonomy_executor


class AutonomyExecutor(autonomy_executor.AutonomyExecutor):
    """AutonomyExecutor that runs Straight where no autonomies are given; in tussle it does nothing."""

    historic_attributes = HistoricAttributes()
    autonomies = Children(
        Autonomy, by_state=True, shares_channels=True, default=(Straight(),), doc="The autonomies."
    )
