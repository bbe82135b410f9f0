"""Range and nearest-neighbour queries over all worlds of a stack, and the block loop for kernels."""

from tussle.neighbors.index import Blocks, Index
from tussle.neighbors.lanes import LANES

__all__ = ["LANES", "Blocks", "Index"]
