"""The coverage of specifications is that of the task, while all robots are linked."""

from types import SimpleNamespace

import numpy as np

from tussle import Simulation
from tussle.rl import Coverage
from tussle.rl.robots import covered, linked
from tussle.stress import Monitor, Specification

TEXT = "always (coverage_now(robot, area -100 -100 100 100 by 10 m, 25 m) > 0)"


def test_coverage_is_that_of_the_task():
    sim = Simulation(Coverage.mission, [1, 2, 3])
    monitor = Monitor(Specification.parse(TEXT, sim.mission), sim)
    for _ in range(60):
        sim.step()
        now = SimpleNamespace(pos=sim.read("robot.pos")[0], alive=np.ones((3, 12), bool))
        assert linked(now).all()
        for world, share in enumerate(covered(now)[:, 0].tolist()):
            (trace,) = monitor.trace(world).values()
            assert trace[-1] == share
    assert share > 0.15
