"""A frame is what is in a world, ordered by id, and stays as it was."""

import numpy as np
import pytest
from missions import mission
from recorded_games import hunt

from tussle import Simulation
from tussle.view import frame_of
from tussle.view.frame import FrameReader


def columns_of(sim, world):
    """What a frame is to hold, by another way: each block's columns by path."""
    found = {}
    for number, name in enumerate(sim.state.context.block_names):
        ids, alive = sim.read(f"{name}.id")
        for place in np.flatnonzero(alive[world]):
            found[int(ids[world, place])] = (
                number,
                int(sim.read(f"{name}.team")[0][world, place]),
                *(sim.read(f"{name}.{c}")[0][world, place] for c in ("pos", "quat", "vel", "health")),
            )
    return found


@pytest.mark.parametrize("name", ["chase_synchronous", "chase_sequential", "births_and_radio"])
def test_a_frame_holds_the_states_of_its_world_by_id(name):
    sim = Simulation(mission(name), seeds=[1, 2, 3])
    for _ in range(3):
        sim.step(7)
        for world in range(3):
            frame, expected = frame_of(sim, world), columns_of(sim, world)
            assert frame.step == sim.steps[world]
            assert frame.t == sim.t[world]
            assert frame.id.tolist() == sorted(expected)
            for row, who in enumerate(frame.id):
                block, team, pos, quat, vel, health = expected[int(who)]
                assert (frame.block[row], frame.team[row], frame.health[row]) == (block, team, health)
                np.testing.assert_array_equal(frame.pos[row], pos)
                np.testing.assert_array_equal(frame.quat[row], quat)
                np.testing.assert_array_equal(frame.vel[row], vel)


def test_a_frame_does_not_change_when_the_game_goes_on_and_cannot_be_changed():
    sim = Simulation(hunt())
    reader = FrameReader(sim)
    sim.step(3)
    frame = reader.frame()
    kept = frame.pos.copy()
    sim.step(10)
    np.testing.assert_array_equal(frame.pos, kept)
    assert (reader.frame().pos[: len(kept)] != kept).any()
    with pytest.raises(ValueError, match="read-only"):
        frame.pos[0, 0] = 1.0


def test_a_lens_sees_who_has_come_and_gone_and_the_end_of_a_world():
    sim = Simulation(hunt(n_prey=3, end=30.0), seeds=[1, 3])
    readers = [FrameReader(sim, world) for world in range(2)]
    counts = set()
    while not sim.is_over:
        sim.step()
        for world, reader in enumerate(readers):
            frame = reader.frame()
            counts.add(len(frame))
            np.testing.assert_array_equal(frame.id, frame_of(sim, world).id)
            assert len(frame) == sum(sim.result()[world].alive.values())
    assert len(counts) > 3
    assert sim.steps[0] != sim.steps[1]
    assert [reader.frame().step for reader in readers] == sim.steps.tolist()
