"""Prints the hashes of all golden missions and examples, and the processor compiled for, as JSON. Run by test_portability."""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from golden_runs import play_all, play_examples
from numba.core.registry import cpu_target
from numpy._core._multiarray_umath import __cpu_features__

if __name__ == "__main__":
    processor = [sum(__cpu_features__.values()), *cpu_target.target_context.codegen().magic_tuple()]
    print(json.dumps({"hashes": play_all(), "examples": play_examples(), "processor": processor}))
