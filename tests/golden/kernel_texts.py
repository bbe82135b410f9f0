"""Prints a digest of all source texts that tussle generates and runs, by kind of function, as it plays the golden missions for one step.

`python tests/golden/kernel_texts.py --keep` writes kernel_texts.json anew.
"""

import builtins
import hashlib
import json
import sys
from collections import defaultdict
from pathlib import Path

FILE = Path(__file__).with_suffix(".json")
KINDS = {"columns": "columns", "derivative": "derivative", "row_kernel": "rows", "walk": "walk"}
"""Name of a generated function -> its kind; all others are laws in lanes. The texts of aircraft are those of an installed package."""


def digests() -> dict[str, str]:
    """Digest of the distinct texts of each kind."""
    texts: defaultdict[str, set[str]] = defaultdict(set)
    run = builtins.compile

    def noting(text, *rest, **more):  # type: ignore[no-untyped-def]
        if sys._getframe(1).f_globals["__name__"] == "tussle.numeric.source":
            name = text[4 : text.index("(")]
            if name not in ("step", "start"):
                texts[KINDS.get(name, "lanes")].add(text)
        return run(text, *rest, **more)

    builtins.compile = noting
    from missions import NAMES, mission

    from tussle import Simulation

    for name in NAMES:
        with Simulation(mission(name)) as simulation:
            simulation.step()
    return {
        kind: f"{len(each)} texts, {hashlib.blake2b(''.join(sorted(each)).encode(), digest_size=16).hexdigest()}"
        for kind, each in sorted(texts.items())
    }


if __name__ == "__main__":
    text = json.dumps(digests(), indent=1) + "\n"
    if "--keep" in sys.argv[1:]:
        FILE.write_text(text, encoding="utf-8")
    print(text, end="")
