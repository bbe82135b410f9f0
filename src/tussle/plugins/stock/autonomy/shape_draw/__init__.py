"""ShapeDraw: draws each kind of shape."""

from tussle.plugins.stock.autonomy.shape_draw.plugin import ShapeDraw

__all__ = ["ShapeDraw"]
