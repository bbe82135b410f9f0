"""Plugins without a mission."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import Autonomy, GroupView, Output, Subscribe
from tussle.engine.host import Host
from tussle.errors import ParameterError, WiringError
from tussle.messages import CaptureEntity, Waypoint
from tussle.stock import Boids, Predator, Unicycle, UnicyclePID


def test_a_hosted_predator_turns_to_its_prey_and_claims_what_is_near() -> None:
    host = Host(autonomy=Predator(max_speed=35.0), n=2, n_others=2, team=2)
    host.pos[:, 1] = 100.0, 0.0, 0.0
    host.pos[:, 2] = 3.0, 0.0, 0.0
    host.pos[:, 3] = 100.0, 50.0, 0.0
    host.team[host.others] = 1
    host.step()
    assert host.channel("speed").tolist() == [35.0, 35.0]
    assert host.channel("turn_rate") == pytest.approx([0.0, math.pi / 2.0])
    claims = host.sent(CaptureEntity)
    assert (claims.sender.tolist(), claims.target.tolist()) == ([1], [3])
    assert host.sent(CaptureEntity).n == 0


def test_hosted_flight_is_the_missions_flight() -> None:
    block = Block(
        name="prey",
        count=3,
        placement="uniform",
        half_width=(30, 30, 10),
        autonomy=Boids(),
        motion=Unicycle(vel_max=30.0),
    )
    sim = Simulation(Mission(blocks=[block], dt=0.1, end=2.0), seeds=3)
    host = Host(autonomy=Boids(), motion=Unicycle(vel_max=30.0), n=3, team=0, seed=3)
    host.pos[:] = sim.read("prey.pos")[0][0].T
    sim.run()
    for _ in range(20):
        host.step()
    assert host.pos.T.tobytes() == np.ascontiguousarray(sim.read("prey.pos")[0][0]).tobytes()
    assert host.t == pytest.approx(2.0)


def test_controllers_stand_between_the_autonomy_and_what_is_read() -> None:
    host = Host(autonomy=Boids(), controller=UnicyclePID(), n=2)
    host.pos[:, 1] = 10.0, 0.0, 5.0
    host.step()
    assert np.isfinite(host.channel("turn_rate")).all()
    with pytest.raises(ParameterError, match=r"nobody writes channel 'turn_rat'.*turn_rate"):
        host.channel("turn_rat")


class Listener(Autonomy):
    """Steers by what it hears."""

    waypoints = Subscribe(Waypoint)
    speed = Output(unit="m/s")

    def step(self, g: GroupView) -> None:
        rows, heard = self.waypoints.pairs()
        self.speed[rows] = heard.pos[0]


def test_delivered_messages_are_heard_once() -> None:
    host = Host(autonomy=Listener(), n=2)
    host.deliver(Waypoint, pos=np.array([[7.0], [0.0], [0.0]]))
    host.step()
    assert host.channel("speed").tolist() == [7.0, 7.0]
    host.group.table.arrays[float][:] = 0.0
    host.step()
    assert host.channel("speed").tolist() == [0.0, 0.0]


def test_plugins_that_do_not_fit_are_refused() -> None:
    with pytest.raises(WiringError, match="desired_altitude"):
        Host(autonomy=Predator(), controller=UnicyclePID())
    with pytest.raises(ParameterError, match="n = 0"):
        Host(autonomy=Boids(), n=0)
