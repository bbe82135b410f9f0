"""Lets the tests of this folder import the golden missions."""

import sys
from pathlib import Path

place = str(Path(__file__).parents[2] / "golden")
if place not in sys.path:
    sys.path.insert(0, place)
