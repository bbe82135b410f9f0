"""One step with each numeric parameter at its extremes is finite, or the mission is refused."""

from __future__ import annotations

import pytest

from tussle.errors import ParameterError
from tussle.plugins import stock
from tussle.stock import Boundary
from tussle.testing.game import build
from tussle.testing.limits import check_extremes

PARTNERS = {"MultirotorControllerPID": ["Multirotor"], "MultirotorControllerOmega": ["Multirotor"]}
"""Companions without which a plugin cannot be played."""
OUTSIDE = ("MapGen2D", "GraphInteraction", "Learned", "JSBSimControl", "JSBSimModel", "JSBSimCompiled")
"""Plugins that need a file or a program."""

STIFF = (
    "RigidBody6DOF", "Multirotor", "FixedWing6DOF", "FixedWing6DOF-A-4D", "FixedWing6DOF-Rascal", "FixedWing6DOFRascal",
)  # fmt: skip
"""Rigid bodies under forces: with masses and inertias near 0 no step is short enough, see `PositiveParam`. Most of these are refused when
the mission is built, see `tussle.engine.stiffness`; not those of which only an input tells: thrust, the torque on an inertia near 0,
coefficients of surfaces of 1e30."""


def playable() -> list[str]:
    """Plugins that the kit can play without anything from outside."""
    return [n for n in stock.manifest() if n not in OUTSIDE + STIFF and stock.load(n).grade != "external"]


@pytest.mark.slow
@pytest.mark.parametrize("name", playable())
def test_one_step_at_the_extremes_is_finite_or_refused(name):
    plugin = stock.load(name)()
    regions = [
        Boundary(name=f"region {i:g}", boundary_id=int(i), team=1, lengths=(90.0, 90.0, 90.0))
        for i in plugin.named_regions()
    ]
    check_extremes(build(plugin, [*regions, *(stock.load(each)() for each in PARTNERS.get(name, ()))]))


@pytest.mark.parametrize("value", [1e300, -1e300])
@pytest.mark.parametrize("name", stock.manifest())
def test_numbers_with_which_nothing_can_be_computed_are_refused(name, value):
    cls = stock.load(name)
    for key, param in cls.params().items():
        if param.is_row_data and param.dtype is float and not param.choices:
            whole = tuple(value for _ in param.fields) if param.fields else value
            with pytest.raises(ParameterError, match="is not allowed"):
                cls(**{key: whole})
