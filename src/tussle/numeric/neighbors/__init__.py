"""Range and nearest-neighbour queries over all worlds of a stack, and blocks of queries for kernels."""

from tussle.numeric.neighbors.index import Blocks, Index
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.queries import PairArrays, nearest, pairs

__all__ = ["LANES", "Blocks", "Index", "PairArrays", "nearest", "pairs"]
