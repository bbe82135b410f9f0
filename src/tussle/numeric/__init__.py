"""Portable numerics, with the same bits on every machine: elementary functions, quaternions, integration, compiled kernels.

The functions take numbers in compiled code, and numbers or arrays (element-wise) in Python, with the same bits.
"""

from tussle.numeric.functions import acos, asin, atan2, clip, cos, exp, log, sin, sincos, tan, total, wrap

__all__ = ["acos", "asin", "atan2", "clip", "cos", "exp", "log", "sin", "sincos", "tan", "total", "wrap"]
