"""A small game for the interfaces."""

import pytest

pytest.importorskip("gymnasium")
pytest.importorskip("pettingzoo")

from flee import Flee, mission


@pytest.fixture
def task():
    return Flee()


@pytest.fixture
def solo():
    return Flee(mission=mission(prey=1))
