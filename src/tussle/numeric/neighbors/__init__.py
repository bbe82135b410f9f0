"""Range and nearest-neighbour queries over all worlds of a stack, and blocks of queries for kernels.

How a law becomes machine code
------------------------------
An author writes a law as a function of one pair, such as

    def push(offset_x, distance, space):
        if distance < space:
            return offset_x / distance

and declares with `@neighbor_law` a radius and how its results are reduced: `east="sum"`. Until the first step, these things happen:

1. `tussle.api.laws` matches the arguments by name to the pair, to columns of the row and to columns of the neighbour (`other_...`). The
   result is a `Law` (law.py), which knows nothing of plugins. Laws of a plugin that have the same candidates share one walk.
2. `lane_code` parses the source of the function and writes it anew for eight pairs at once: a number becomes a vector of eight
   numbers, a comparison a mask, an `if` both of its branches and a selection. A `return` that is not reached leaves the pair out.
   The operations and their order stay, so each lane has the bits of a call for one pair.
3. `WalkText` (walk_text.py) writes the source of the loop around it: blocks of agents that are near each other, the candidates of
   a block found once, one accumulator in a register for each result. `make_walk` (walk.py) defines it as a function by
   `tussle.numeric.source` and gives it a signature. It writes two: with eight agents in the lanes, which share candidates, and with
   eight neighbours of one agent, for worlds that play one agent at a time.
4. On the first call, `Kernel` (kernel.py) makes a key of everything that the machine code depends on: bytecode and constants of all
   functions that are reached, the signature, versions, the processor (fingerprint.py). It loads the code of that key from the folder
   of the cache, or lets Numba compile and keeps it there (store.py). `lanes_codegen` tells Numba what vectors and masks are in LLVM.

The text of step 3 is in no file; `tests/golden/kernel_texts.py` shows how to catch it. With NUMBA_DISABLE_JIT=1,
`walk_python` calls the author's function for one pair after another instead, in a debugger too, and has the same bits.

Where to look for what: index.py and kernels.py sort entities into cells and cut them into blocks; search.py and queries.py answer
questions of NumPy code; nearest_lanes.py finds the k nearest.
"""

from tussle.numeric.neighbors.index import Blocks, Index
from tussle.numeric.neighbors.lane_count import LANES
from tussle.numeric.neighbors.queries import PairArrays, nearest, pairs

__all__ = ["LANES", "Blocks", "Index", "PairArrays", "nearest", "pairs"]
