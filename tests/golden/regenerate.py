"""Writes golden.json anew: `python tests/golden/regenerate.py`. With `--check` it writes nothing and fails where a hash differs.

Only where a plugin's numbers are meant to have changed. Says which missions differ from what was kept; name these in the changelog.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from golden_runs import FILE, examples, golden, kept_examples, play_all, play_examples

ABOUT = (
    "hashes: state hash of each world by mission and seed, after half of the mission's steps and after all; examples: after their "
    "first steps, by folder of the plugin. Written by regenerate.py."
)


def main() -> None:
    """Play all missions and say what differs."""
    before = golden() | kept_examples() if FILE.exists() else {}
    hashes, shown = play_all(), play_examples()
    changed = [name for name, now in (hashes | shown).items() if now != before.get(name)]
    print("changed:", ", ".join(changed) if changed else "nothing")
    if "--check" in sys.argv[1:]:
        sys.exit(bool(changed))
    if left_out := {*kept_examples()} - {*examples()}:
        print("not played, since a package is missing:", ", ".join(sorted(left_out)))
    kept = {"about": ABOUT, "hashes": hashes, "examples": dict(sorted((kept_examples() | shown).items()))}
    FILE.write_text(json.dumps(kept, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
