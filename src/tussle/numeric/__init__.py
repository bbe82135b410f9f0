"""Arithmetic with the same bits on every machine: elementary functions, quaternions, integration, and the kernels that use them.

The functions work inside jitted code on numbers and from Python on numbers and arrays, element by element, with the same bits.
"""

from tussle.numeric.functions import acos, asin, atan2, cos, exp, log, sin, sincos, tan, wrap

__all__ = ["acos", "asin", "atan2", "cos", "exp", "log", "sin", "sincos", "tan", "wrap"]
