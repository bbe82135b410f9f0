"""TakeFlag: fetches a flag and brings it to a region."""

from tussle.plugins.stock.autonomy.take_flag.plugin import TakeFlag

__all__ = ["TakeFlag"]
