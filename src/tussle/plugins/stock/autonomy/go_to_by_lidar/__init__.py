"""GoToByLidar: flies to a goal between obstacles that a lidar sees."""

from tussle.plugins.stock.autonomy.go_to_by_lidar.plugin import GoToByLidar

__all__ = ["GoToByLidar"]
