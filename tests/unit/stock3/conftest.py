"""Lets the tests of this folder import small_worlds."""

import sys
from pathlib import Path

place = str(Path(__file__).parents[1] / "engine")
if place not in sys.path:
    sys.path.insert(0, place)
