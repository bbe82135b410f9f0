"""TrajectoryRecordPlayback: flies a recorded trajectory."""

from tussle.plugins.stock.autonomy.trajectory_record_playback.plugin import TrajectoryRecordPlayback

__all__ = ["TrajectoryRecordPlayback"]
