"""Skips the tests of this folder where there are no recordings."""

from pathlib import Path

import pytest

HERE = Path(__file__).parent


def pytest_collection_modifyitems(items):
    import recordings

    if recordings.folder() is None:
        skip = pytest.mark.skip(
            reason=f"needs recordings of SCRIMMAGE beside the repository, or {recordings.VARIABLE}"
        )
        for item in items:
            if HERE in item.path.parents:
                item.add_marker(skip)
