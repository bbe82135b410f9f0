"""ROSShapeViz: markers of RViz, in the viewer and from the simulation."""

from tussle.plugins.stock.interaction.ros_shape_viz.plugin import ROSShapeViz

__all__ = ["ROSShapeViz"]
