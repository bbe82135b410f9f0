import math

import numpy as np
import pytest

from tussle.numeric.quaternion import quat_from_euler, quat_rotate
from tussle.plugins.stock.motion.single_integrator import SingleIntegrator, kernels

AS_COMMANDED = -1.0


def flown(command, max_speed=AS_COMMANDED, x0=None, dt=0.1, substeps=1, heading=None):
    x = np.zeros((8, 1)) if x0 is None else np.array(x0, float).reshape(8, 1)
    u = np.array([*command] if heading is None else [*command, heading], float)[:, None]
    kernels.advance(x, u, np.array([[max_speed]]), dt, substeps)
    return x[:, 0]


def published(x):
    out = np.full((10, x.shape[1]), np.nan)
    kernels.to_body(np.ascontiguousarray(x), out, 0)
    return out[:3], out[6:], out[3:6]


@pytest.mark.parametrize("substeps", [1, 5, 12])
def test_held_velocity_is_exact_whatever_the_substeps(substeps):
    x = flown((3.0, -4.0, 12.0), substeps=substeps)
    assert x[:6].tolist() == [3.0 * 0.1, -4.0 * 0.1, 12.0 * 0.1, 3.0, -4.0, 12.0]


def test_max_speed_is_a_limit():
    assert flown((3.0, 0.0, 4.0), max_speed=10.0)[3:6].tolist() == [3.0, 0.0, 4.0]
    assert flown((6.0, 0.0, 8.0), max_speed=10.0)[3:6].tolist() == [6.0, 0.0, 8.0]
    assert flown((30.0, 0.0, 40.0), max_speed=10.0)[3:6].tolist() == [6.0, 0.0, 8.0]
    assert flown((0.0, 0.0, 0.0), max_speed=10.0)[:6].tolist() == [0.0] * 6
    assert flown((3.0, 0.0, 4.0), max_speed=0.0)[3:6].tolist() == [0.0] * 3


def test_nose_points_where_it_goes_and_up_in_a_climb():
    x = flown((1.0, 1.0, math.sqrt(2.0)))
    assert x[6] == pytest.approx(math.pi / 4)
    assert x[7] == pytest.approx(math.pi / 4)
    pos, quat, vel = published(x[:, None])
    assert np.array_equal(pos[:, 0], x[:3])
    assert np.array_equal(vel[:, 0], x[3:6])
    assert np.allclose(quat_rotate(quat, np.array([[1.0], [0.0], [0.0]])), vel / 2.0)


def test_attitude_is_kept_at_rest_and_heading_in_a_vertical_climb():
    before = [0.0] * 6 + [2.0, 0.5]
    assert flown((0.0, 0.0, 0.0), x0=before)[6:].tolist() == [2.0, 0.5]
    assert flown((0.0, 0.0, -3.0), x0=before)[6:].tolist() == [2.0, -math.pi / 2]


def test_commanded_heading_wins_over_the_course():
    x = flown((0.0, 5.0, 0.0), heading=1.0)
    assert x[6] == 1.0
    assert x[1] == 0.5
    assert SingleIntegrator(override_heading=True).input_channels()[-1] == "desired_heading"
    assert "desired_heading" not in SingleIntegrator().input_channels()


def test_attitude_is_yaw_then_elevation():
    x = np.zeros((8, 5))
    x[6] = [0.0, 1.0, -2.0, 3.0, 100.0]
    x[7] = [0.0, 0.5, -0.5, 1.5, 0.1]
    assert np.abs(published(x)[1] - quat_from_euler(0.0 * x[6], -x[7], x[6])).max() < 1e-15
