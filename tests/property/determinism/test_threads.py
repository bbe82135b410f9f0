"""Threads serve motion models and the laws of stock plugins, and change no bit."""

import pytest

from tussle import Block, Mission, Simulation
from tussle.api import MotionModel, Param, State
from tussle.numeric import sincos
from tussle.stock import Boids, SingleIntegrator, Straight, Unicycle

N = 9000  # enough rows for two threads


class Pendulum(MotionModel):
    """Swings; integrated by the shared driver, with a parameter of its own for each row."""

    grade = "portable"
    stiffness = Param(1.0, unit="1/s^2")
    x = State("angle rate", unit="rad rad/s")

    @staticmethod
    def derivative(angle, rate, stiffness):
        return rate, -stiffness * sincos(angle)[0]

    def from_body(self, body, rows):
        self.x[0, rows], self.x[1, rows] = body.pos[0, rows], 0.0

    def to_body(self, body):
        body.pos[0] = self.x[0]


def played(threads, autonomy, motion):
    crowd = Block(name="crowd", count=N, variance=(1e7, 1e7, 1e3), autonomy=autonomy, motion=motion)
    with Simulation(Mission(blocks=[crowd], end=10.0, motion_multiplier=2), threads=threads) as sim:
        sim.step(3)
        return sim.state_hash(0), sim.state.context._pool is not None


def test_motion_models_are_split_over_threads():
    alone, together = (played(threads, Straight(), Pendulum()) for threads in (1, 2))
    assert together == (alone[0], True)
    assert not alone[1]


@pytest.mark.parametrize("motion", [Unicycle(vel_max=20.0), SingleIntegrator()])
def test_boids_are_the_same_in_threads(motion):
    alone, together = (played(threads, Boids(), motion) for threads in (1, 2))
    assert together[0] == alone[0]
