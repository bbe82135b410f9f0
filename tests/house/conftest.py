"""The house's tests read every file once."""

import pytest
from tree import parsed


def pytest_runtest_teardown(item: pytest.Item, nextitem: pytest.Item | None) -> None:
    """Their syntax trees, a million objects, do not stay while the worker plays other tests."""
    if nextitem is None or item.path.parent != nextitem.path.parent:
        parsed.cache_clear()
