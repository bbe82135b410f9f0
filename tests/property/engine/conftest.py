"""Lets the tests of this folder import small_worlds and design_plugins."""

import sys
from pathlib import Path

for folder in ("engine", "api"):
    place = str(Path(__file__).parents[2] / "unit" / folder)
    if place not in sys.path:
        sys.path.insert(0, place)
