"""Absence leaves out entities of a block, and nothing else changes."""

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.errors import ParameterError
from tussle.stock import Absence, NoisyState, Straight, Unicycle, UnicyclePID


@pytest.mark.parametrize("numbers", [(2, 5), (1,), ()])
def test_the_others_start_fly_and_draw_as_they_would_anyway(numbers):
    block = Block(
        name="a", count=6, variance=(1e4, 1e4, 0), autonomy=Straight(speed=3.0),
        controller=UnicyclePID(), motion=Unicycle(), sensor=NoisyState(),
    )  # fmt: skip
    whole = Mission(blocks=[block], end=2.0)
    fewer = whole.replace(interactions=[Absence(block="a", numbers=numbers)])
    is_left = np.array([bool(numbers) and n not in numbers for n in range(1, 7)])
    with Simulation(whole, [1, 2]) as all_, Simulation(fewer, [1, 2]) as some:
        for _ in range(15):
            assert (some.read("a.pos")[1] == is_left).all()
            for path in ("a.pos", "a.id", "a.NoisyState.belief_pos"):
                np.testing.assert_array_equal(all_.read(path)[0][:, is_left], some.read(path)[0][:, is_left])
            all_.step()
            some.step()


@pytest.mark.parametrize("number", [0, -1, 2.5])
def test_what_is_no_number_of_an_entity_is_refused(number):
    with pytest.raises(ParameterError, match="it takes whole numbers from 1"):
        Absence(block="a", numbers=(1, number))
