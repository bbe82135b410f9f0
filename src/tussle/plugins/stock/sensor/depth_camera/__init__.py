"""DepthCamera: small depth and segmentation images."""

from tussle.plugins.stock.sensor.depth_camera.plugin import DepthCamera

__all__ = ["DepthCamera"]
