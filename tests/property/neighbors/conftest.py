"""Lets the tests import neighbor_stacks and law_plugins."""

import sys
from pathlib import Path

for folder in ("neighbors", "api"):
    sys.path.insert(0, str(Path(__file__).parents[2] / "unit" / folder))
