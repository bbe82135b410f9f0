"""An autonomy in a node of ROS does what it does in a simulation."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from tussle import Block, Mission, Simulation
from tussle.api import EasyAutonomy, Output, Param, State
from tussle.cli.bridges.ros_node import AutonomyHost, set_twist, state_of
from tussle.errors import ParameterError, RosError
from tussle.stock import Learned, ShapeDraw, Unicycle

COLUMNS = "pos", "vel", "quat", "omega"


class Wanderer(EasyAutonomy):
    """Wanders about its start, by its state, its memory and its own random numbers."""

    gain = Param(0.3)
    turned = State(unit="rad")
    speed = Output(unit="m/s")
    turn_rate = Output(unit="rad/s")
    pitch_rate = Output(unit="rad/s")

    def step_one(self, me):
        me.turned += me.gain * me.normal() * me.dt
        me.speed = 5.0 + math.hypot(*me.vel) / (1.0 + abs(me.pos[0]))
        me.turn_rate = me.turned - 0.1 * me.yaw
        me.pitch_rate = 0.01 * me.t


def vector(values):
    return SimpleNamespace(**dict(zip("xyz", values, strict=True)))


def odometry(pos, quat, linear, angular):
    w, x, y, z = quat
    pose = SimpleNamespace(position=vector(pos), orientation=SimpleNamespace(w=w, x=x, y=y, z=z))
    twist = SimpleNamespace(linear=vector(linear), angular=vector(angular))
    return SimpleNamespace(pose=SimpleNamespace(pose=pose), twist=SimpleNamespace(twist=twist))


def test_the_outputs_of_a_node_are_those_of_the_simulation_bit_for_bit():
    block = Block(
        name="robot",
        team=1,
        heading="40 deg",
        speed=3.0,
        autonomy=Wanderer(),
        motion=Unicycle(use_pitch=True),
    )
    simulation = Simulation(Mission(blocks=[block], dt=0.05, end=99.0), seeds=7)
    host = AutonomyHost(Wanderer(), 0.05, seed=7)
    for _ in range(40):
        state = {name: simulation.read(f"robot.{name}")[0][0, 0] for name in COLUMNS}
        simulation.step()
        expected = {
            name: simulation.read(f"robot.Wanderer.{name}")[0][0, 0]
            for name in ("speed", "turn_rate", "pitch_rate")
        }
        assert host.step(state) == expected
    assert expected["turn_rate"] != 0.0


def test_a_policy_flies_a_robot_as_it_flies_in_a_simulation(tmp_path):
    rl = pytest.importorskip("tussle.rl", reason="gymnasium is not installed: pip install 'tussle[rl]'")
    for package in ("onnx", "onnxruntime"):
        pytest.importorskip(package, reason=f"{package} is not installed: pip install 'tussle[policy]'")
    task, path = rl.ReachPoint(), tmp_path / "policy.onnx"
    weights = np.random.default_rng(1).normal(size=(2, sum(task.widths["robot"])))
    rl.write_policy(path, [(weights, [0.1, 0.2])], task="tussle/ReachPoint-v0")
    blocks = [task.given.blocks[0].replace(autonomy=Learned(policy=str(path)))]
    simulation = Simulation(task.given.replace(blocks=blocks), seeds=3)
    host = AutonomyHost(Learned(policy=str(path)), task.given.dt)
    for _ in range(20):
        state = {name: simulation.read(f"robot.{name}")[0][0, 0] for name in COLUMNS}
        simulation.step()
        outputs = host.step(state)
        expected = [simulation.read(f"robot.Learned.{name}")[0][0, 0] for name in ("speed", "turn_rate")]
        assert [outputs["speed"], outputs["turn_rate"]] == expected
    twist = SimpleNamespace(linear=vector([0.0] * 3), angular=vector([0.0] * 3))
    set_twist(twist, outputs, state["quat"])
    assert twist.linear.x == expected[0] != 0.0


def test_an_odom_gives_the_state_in_the_world_frame():
    half = math.sqrt(0.5)
    state = state_of(odometry((1.0, 2.0, 3.0), (half, 0.0, 0.0, half), (4.0, 0.0, 1.0), (0.0, 0.5, 0.25)))
    assert state["pos"].tolist() == [1.0, 2.0, 3.0]
    assert state["quat"].tolist() == [half, 0.0, 0.0, half]
    assert state["vel"] == pytest.approx([0.0, 4.0, 1.0])
    assert state["omega"] == pytest.approx([-0.5, 0.0, 0.25])


@pytest.mark.parametrize("quat", [(0.0, 0.0, 0.0, 0.0), (math.nan, 0.0, 0.0, 1.0)])
def test_an_odom_that_is_no_state_is_refused(quat):
    with pytest.raises(RosError, match="is no state of a body"):
        state_of(odometry((0.0,) * 3, quat, (0.0,) * 3, (0.0,) * 3))


def test_velocities_are_turned_into_the_frame_of_the_robot():
    twist = SimpleNamespace(linear=vector((0, 0, 0)), angular=vector((0, 0, 0)))
    half = math.sqrt(0.5)
    outputs = {"velocity_x": 0.0, "velocity_y": 2.0, "velocity_z": 1.0, "turn_rate": 0.5, "pitch_rate": 0.1}
    set_twist(twist, outputs, np.array([half, 0.0, 0.0, half]))
    assert [twist.linear.x, twist.linear.y, twist.linear.z] == pytest.approx([2.0, 0.0, 1.0])
    assert [twist.angular.x, twist.angular.y, twist.angular.z] == [0.0, -0.1, 0.5]


def test_an_autonomy_that_moves_nothing_is_refused():
    with pytest.raises(ParameterError, match="it needs speed or velocity_x"):
        AutonomyHost(ShapeDraw(), 0.1)
