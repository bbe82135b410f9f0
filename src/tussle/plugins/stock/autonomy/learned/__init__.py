"""Learned: a policy from an ONNX file flies."""

from tussle.plugins.stock.autonomy.learned.plugin import Learned

__all__ = ["Learned"]
