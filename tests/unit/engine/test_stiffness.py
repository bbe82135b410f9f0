"""A rigid body that changes faster than a substep can follow is refused when its mission is built."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tussle import Simulation
from tussle.errors import MissionError
from tussle.mission import Mission, read_mission
from tussle.plugins import stock

TINY = tuple(1e-9 * np.eye(3).ravel())


def example(name: str, **values) -> Mission:
    """The example of a motion model with other values of its parameters."""
    mission = read_mission(stock.examples()[name]).mission
    block = mission.blocks[0]
    return mission.replace(blocks=[block.replace(motion=block.motion.replace(**values))])


def build(name: str, parameter: str, value, **more):
    Simulation(example(name, **{parameter: value}).replace(**more), 1).close()


@pytest.mark.parametrize(
    ("name", "parameter", "value"),
    [
        ("Multirotor", "mass", 1e-9),
        ("FixedWing6DOF", "mass", 1e-9),
        ("FixedWing6DOF", "inertia_matrix_slug_ft_sq", TINY),
    ],
)
def test_a_body_that_is_too_light_is_refused_with_the_value_that_it_takes(name, parameter, value):
    with pytest.raises(
        MissionError,
        match=rf"{name} of block '\w+' changes too fast .* by {parameter} = 1e-09.* \(its start alone takes ",
    ) as refused:
        build(name, parameter, value)
    numbers = re.search(r"alone takes ([^,]*),", str(refused.value))
    assert numbers
    nearest = tuple(1.02 * float(number) for number in numbers[1].split())  # written with three digits
    build(name, parameter, nearest if len(nearest) > 1 else nearest[0])


def test_shorter_substeps_follow_a_lighter_body():
    with pytest.raises(MissionError, match=r"substeps of 0\.025 s"):
        build("Multirotor", "mass", 1e-3)
    build("Multirotor", "mass", 1e-3, dt=0.001, motion_multiplier=1)


def test_of_a_stack_only_the_world_with_such_a_body_ends():
    mission = example("Multirotor")
    path = f"{mission.blocks[0].name}.Multirotor.mass"
    with Simulation(mission, [1, 2, 3], {path: [1.0, 1e-9, 2.0]}, on_error="record") as simulation:
        simulation.step(3)
        ends = [result.end for result in simulation.result()]
        assert "changes too fast" in str(simulation.result()[1].error)
    assert ends[1] == "error"
    assert "error" not in (ends[0], ends[2])
