"""A step is played whole: after an interrupt, and with several threads, a game ends as it does without, or says why it cannot."""

import os
import signal
import threading

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import EasyAutonomy, Output, State
from tussle.errors import PluginError, SnapshotError, TussleError
from tussle.stock import SingleIntegrator

AT = []
"""What happens in a step, as functions of the entity."""


class Counts(EasyAutonomy):
    velocity = Output("velocity_x velocity_y velocity_z", unit="m/s")
    n = State(dtype=int)

    def step_one(self, me):
        me.n += 1
        me.velocity = [float(me.n), 0.0, 0.0]
        if AT and me.step_count == 5 and me.id == 2:
            AT.pop()(me)


MISSION = Mission(blocks=[Block(name="b", count=3, autonomy=Counts(), motion=SingleIntegrator())], end=2)


def press(_=None):
    os.kill(os.getpid(), signal.SIGINT)


def leave(_):
    raise KeyboardInterrupt


@pytest.fixture(scope="module")
def whole():
    return Simulation(MISSION).run()[0].state_hash


@pytest.fixture(autouse=True)
def nothing_left():
    before = signal.getsignal(signal.SIGINT)
    yield
    AT.clear()
    assert signal.getsignal(signal.SIGINT) is before


@pytest.mark.parametrize("play", [Simulation.run, lambda sim: sim.run_until(lambda s: s.is_over)])
def test_ctrl_c_waits_for_the_end_of_the_step_and_the_game_goes_on_from_there(play, whole):
    simulation = Simulation(MISSION)
    AT.append(press)
    with pytest.raises(KeyboardInterrupt):
        play(simulation)
    assert simulation.steps.tolist() == [6]
    assert simulation.read("b.Counts.n")[0].tolist() == [[6, 6, 6]]
    play(simulation)
    assert simulation.state_hash() == whole


def test_a_second_ctrl_c_ends_the_step():
    simulation = Simulation(MISSION)
    AT.append(lambda _: (press(), press()))
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    assert simulation.steps.tolist() == [5]
    with pytest.raises(SnapshotError, match="world 0 was interrupted in the middle of a step"):
        simulation.run()


def test_a_step_that_was_cut_off_is_not_continued_before_a_reset_or_restore(whole):
    simulation = Simulation(MISSION)
    start = simulation.snapshot()
    for renew in (lambda: simulation.reset([0]), lambda: simulation.restore(start)):
        AT.append(leave)
        with pytest.raises(KeyboardInterrupt):
            simulation.step(9)
        for _ in range(2):
            with pytest.raises(SnapshotError, match="reset the world or restore a snapshot"):
                simulation.step()
        renew()
        assert simulation.run()[0].state_hash == whole
        simulation.reset([0])


def test_a_reset_renews_its_own_world_only():
    simulation = Simulation(MISSION, seeds=[1, 2])
    AT.append(leave)
    with pytest.raises(KeyboardInterrupt):
        simulation.run()
    simulation.reset([0])
    with pytest.raises(SnapshotError, match="world 1 was interrupted"):
        simulation.step()


def test_a_step_within_a_step_is_refused_and_changes_nothing(whole):
    """By another thread, and by a plugin."""
    simulation, refused = Simulation(MISSION), []

    def step():
        try:
            simulation.step()
        except TussleError as error:
            refused.append(str(error))

    def from_a_thread(_):
        thread = threading.Thread(target=step)
        thread.start()
        thread.join()

    AT.append(from_a_thread)
    simulation.step(6)
    simulation.step()
    assert len(refused) == 1
    assert "one thread may step a simulation at a time" in refused[0]
    assert simulation.run()[0].state_hash == whole
    AT.append(lambda _: simulation.step())
    simulation.reset([0])
    with pytest.raises(PluginError, match="a step is under way"):
        simulation.run()


def test_a_thread_runs_a_game_without_touching_signals(whole):
    found = []
    thread = threading.Thread(target=lambda: found.append(Simulation(MISSION).run()[0].state_hash))
    thread.start()
    thread.join()
    assert found == [whole]
