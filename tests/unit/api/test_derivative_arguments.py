"""What the state equation of a motion model can take: whole columns, structural constants, arguments with defaults, its own mass."""

from __future__ import annotations

import numpy as np
import pytest

from tussle.api import InertiaParam, Input, MotionModel, Param, PositiveParam, RigidBodyModel, State
from tussle.errors import ParameterError
from tussle.testing import check_plugin


class Glider(MotionModel):
    """A point that is pushed."""

    mass = PositiveParam(2.0, unit="kg")
    weights = Param((3.0, 4.0), fields="x y")
    other = Param((5.0, 6.0), fields="x z")
    table = Param(((7.0, 1.0), (8.0, 2.0)), fields="a b", ragged=True, structural=True)
    place = State("x v", unit="m m/s")
    first = Input()
    second = Input()
    pushes = Input("push_x push_y")

    @staticmethod
    def derivative(place, mass, weights, z, table, pushes, force, first, second=10.0):
        _, v = place
        total = weights[0] + 10.0 * weights[1] + 100.0 * z + 1000.0 * table[1][0] + 10000.0 * (first + second)
        return v, total / mass + pushes[1] + force[2]

    def active_inputs(self):
        return ["first", "pushes"]

    def from_body(self, body, rows):
        self.place[0, rows], self.place[1, rows] = body.pos[0, rows], body.vel[0, rows]

    def to_body(self, body):
        body.pos[0], body.vel[0] = self.place


def test_a_state_equation_takes_whole_columns_constants_and_defaults():
    assert Glider().body_inputs() == ["force_x", "force_y", "force_z"]  # and not the mass of the block
    path = Glider().rollout([0.0, 0.0], [[1.0, 0.0, 0.5, 0.0, 0.0, 0.25]], dt=1.0)
    total = 3.0 + 40.0 + 600.0 + 8000.0 + 10000.0 * (1.0 + 10.0)
    assert path[1, 1] == pytest.approx(total / 2.0 + 0.75)
    changed = Glider(table=[(0.0, 0.0), (9.0, 0.0)]).rollout(
        [0.0, 0.0], [[1.0, 0.0, 0.5, 0.0, 0.0, 0.25]], dt=1.0
    )
    assert changed[1, 1] - path[1, 1] == pytest.approx(500.0)


def test_a_matrix_is_written_in_rows():
    inertia = InertiaParam((1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0), text_unit="slug*ft^2")
    rows = inertia.convert("[ 2 0 0.5 ]\n [ 0, 3, 0 ] [ 0.5, 0, 4 ]".replace(",", ""))
    assert rows == pytest.approx([1.3558179 * i for i in (2.0, 0.0, 0.5, 0.0, 3.0, 0.0, 0.5, 0.0, 4.0)])
    assert inertia.convert("[1 kg*m^2, 0, 0] [0, 1 kg*m^2, 0] [0, 0, 1 kg*m^2]") == inertia.default
    with pytest.raises(ParameterError, match="is not a row"):
        inertia.convert("[1 0 0] [0 1 0] [0 0 1")


def test_a_positive_parameter_is_positive():
    assert PositiveParam(2.0).convert(1e-9) == 1e-9
    with pytest.raises(ParameterError, match="a finite number in kg > 0"):
        Glider(mass=0.0)


class Brick(RigidBodyModel):
    """A rigid body that falls, and does not know how a quaternion turns."""

    @staticmethod
    def derivative(rigid_body):
        return (
            rigid_body[3],
            rigid_body[4],
            rigid_body[5],
            0.0,
            0.0,
            -9.81,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
            0.0,
        )


def test_a_rigid_body_needs_a_state_equation_only():
    check_plugin(Brick)
    path = Brick().rollout(np.r_[0.0, 0.0, 20.0, 1.0, 0.0, 0.0, 1.0, np.zeros(6)], np.zeros((10, 0)), dt=0.1)
    assert path[-1, :3] == pytest.approx([1.0, 0.0, 20.0 - 0.5 * 9.81])
