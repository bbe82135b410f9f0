"""Prints the hashes of the golden missions named as arguments (all by default) as JSON. Run in subprocesses by test_portability."""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from golden_runs import play_all
from missions import NAMES

from tussle.numeric.kernel import stats

if __name__ == "__main__":
    hashes = play_all(sys.argv[1:] or NAMES)
    print(json.dumps({"hashes": hashes, "compiled": stats.compiled, "loaded": stats.loaded}))
