"""Lets the tests of this folder import the recorded games, the golden missions and what lies beside them."""

import sys
from pathlib import Path

here = Path(__file__).parent
for folder in (here, here.parent / "record", here.parents[1] / "golden"):
    if str(folder) not in sys.path:
        sys.path.insert(0, str(folder))
