"""Every plugin that ships meets the contract."""

from __future__ import annotations

import pytest

from tussle import stock
from tussle.testing import check_plugin

COMPANIONS = {
    # Those that hear of something only when somebody tells them; the kit cannot make up a shape.
    "Straight": ["Boundary"],
    "SimpleCaptureMetrics": ["SimpleCapture"],
    "SimpleCapture": ["SimpleCaptureMetrics"],
    "SimpleCollisionMetrics": ["SimpleCollision", "GroundCollision"],
    "WaypointDispatcher": ["WaypointGenerator"],
    "MoveToGoalMS": ["WaypointDispatcher"],
    # Those that are flown by a controller, which works between the substeps.
    "SimpleAircraft": ["SimpleAircraftControllerPID"],
    "Unicycle": ["UnicyclePID"],
    "SimpleQuadrotor": ["SimpleQuadrotorControllerLQR"],
}


@pytest.mark.parametrize("name", stock.manifest())
def test_plugin_meets_the_contract(name: str) -> None:
    check_plugin(stock.load(name))


@pytest.mark.parametrize("name", COMPANIONS)
def test_plugin_meets_the_contract_in_the_company_of_others(name: str) -> None:
    check_plugin(stock.load(name), companions=[stock.load(other)() for other in COMPANIONS[name]])
