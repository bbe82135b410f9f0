"""TakeFlag: runs for a flag and brings it home."""

from tussle.stock.autonomy.take_flag.plugin import TakeFlag

__all__ = ["TakeFlag"]
