"""DepthCamera: small images of depth, and of what the pixels show."""

from tussle.stock.sensor.depth_camera.plugin import DepthCamera

__all__ = ["DepthCamera"]
