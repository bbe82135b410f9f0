"""A rigid body that changes faster than a substep can follow is refused when its mission is built; other models are noted."""

from __future__ import annotations

import math
import re

import numpy as np
import pytest

from tussle import Simulation
from tussle.api import MotionModel, Param, State
from tussle.errors import MissionError
from tussle.mission import Block, Mission, read_mission
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


class Spiral(MotionModel):
    """z' = (decay + frequency i) z, of which a step multiplies z by the polynomial of Runge and Kutta."""

    place = State("x y", unit="m")
    decay = Param(0.0)
    frequency = Param(0.0)

    @staticmethod
    def derivative(x, y, decay, frequency):
        return decay * x - frequency * y, frequency * x + decay * y

    def from_body(self, body, rows):
        self.place[:, rows] = 1.0

    def to_body(self, body):
        body.pos[:2] = self.place


@pytest.mark.parametrize("frequency", [0.0, 3.0, 25.0, 30.0, 60.0, 1e3, 1e6])
@pytest.mark.parametrize("decay", [-1e6, -1e3, -60.0, -30.0, -25.0, -3.0, 0.0, 3.0, 50.0])
def test_a_model_of_ones_own_that_diverges_by_its_step_is_noted(decay, frequency):
    def mission(multiplier):
        spiral = Block(name="a", motion=Spiral(decay=decay, frequency=frequency))
        return Mission(blocks=[spiral], dt=0.1, end=1.0, motion_multiplier=multiplier)

    z = 0.1 * complex(decay, frequency)
    factor = abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24)
    if factor <= 1.1 * max(1.0, math.exp(min(z.real, 700.0))):
        Simulation(mission(1)).close()  # a warning is an error
        return
    with pytest.warns(
        RuntimeWarning, match=r"Spiral of block 'a' is too stiff for substeps of 0.1 s .* by a factor of"
    ) as found:
        Simulation(mission(1)).close()
    enough = re.search(r"(\d+) times as large a motion_multiplier is enough", str(found[0].message))
    assert enough or abs(z) > 40
    if enough:
        Simulation(mission(int(enough[1]))).close()


def test_dry_friction_is_not_stiff():
    class Sledge(Spiral):
        @staticmethod
        def derivative(x, y, decay, frequency):
            return y, -3.0 if y > 0.0 else (3.0 if y < 0.0 else 0.0)

        def from_body(self, body, rows):
            self.place[:, rows] = 0.0

    Simulation(Mission(blocks=[Block(name="a", motion=Sledge())], dt=0.1)).close()
