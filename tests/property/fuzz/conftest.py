"""Lets the tests of this folder import the random missions."""

import sys
from pathlib import Path

place = str(Path(__file__).parent)
if place not in sys.path:
    sys.path.insert(0, place)
