"""Lets the tests of this folder import its modules, and skips them where there are no recordings."""

import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
if str(HERE) not in sys.path:
    sys.path.insert(0, str(HERE))


def pytest_collection_modifyitems(items):
    import recordings

    if recordings.folder() is None:
        skip = pytest.mark.skip(
            reason=f"no recordings: {recordings.VARIABLE} names no folder, and none lies beside the repository"
        )
        for item in items:
            if HERE in item.path.parents:
                item.add_marker(skip)
