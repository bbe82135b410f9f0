"""After each test of autopilots, no socket is open that was not before."""

import pytest
from autopilot_peers import open_sockets


@pytest.fixture(autouse=True)
def nothing_is_left():
    before = open_sockets()
    yield
    assert open_sockets() == before
