"""Writes golden.json anew: `python tests/golden/regenerate.py`. With `--check` it writes nothing and fails where a hash differs.

Only where a plugin's numbers are meant to have changed. Says which missions differ from what was kept; name these in the changelog.
"""

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from golden_runs import FILE, golden, play_all

ABOUT = "State hash of each world by mission and seed, after half of the mission's steps and after all; written by regenerate.py."


def main() -> None:
    """Play all missions and say what differs."""
    before = golden() if FILE.exists() else {}
    hashes = play_all()
    changed = [name for name in hashes if hashes[name] != before.get(name)]
    print("changed:", ", ".join(changed) if changed else "nothing")
    if "--check" in sys.argv[1:]:
        sys.exit(bool(changed))
    FILE.write_text(json.dumps({"about": ABOUT, "hashes": hashes}, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
