import numpy as np

from tussle.numeric.quaternion import quat_from_euler, quat_multiply
from tussle.plugins.stock.sensor.noisy_contacts import kernels as contacts
from tussle.plugins.stock.sensor.noisy_state import kernels as state


def table(n, seed=7):
    draw = np.random.default_rng(seed)
    quat = quat_from_euler(*draw.uniform(-1.0, 1.0, (3, n)))
    return draw.normal(size=(3, n)), draw.normal(size=(3, n)), quat


def pairs(n, mean, sd):
    return [np.repeat(np.array([[mean + i], [sd + i]], float), n, axis=1) for i in range(9)]


def believed(pos, vel, quat, noise, draws):
    n = pos.shape[1]
    out = np.empty((3, n)), np.empty((3, n)), np.empty((4, n))
    state.blur((*pos, *vel, *quat), tuple(noise[:3]), tuple(noise[3:6]), tuple(noise[6:]), tuple(draws), *out)
    return out


def test_no_noise_is_the_truth():
    pos, vel, quat = table(20)
    draws = np.random.default_rng(8).normal(size=(3, 3, 20))
    out = believed(pos, vel, quat, [np.zeros((2, 20))] * 9, draws)
    assert np.array_equal(out[0], pos)
    assert np.array_equal(out[1], vel)
    assert np.array_equal(out[2], quat)


def test_every_component_has_its_own_mean_and_deviation():
    pos, vel, quat = table(20)
    draws = np.random.default_rng(8).normal(size=(3, 3, 20))
    noise = pairs(20, 0.1, 0.01)
    out = believed(pos, vel, quat, noise, draws)
    for axis in range(3):
        assert np.allclose(out[0][axis] - pos[axis], 0.1 + axis + (0.01 + axis) * draws[0, axis])
        assert np.allclose(out[1][axis] - vel[axis], 3.1 + axis + (3.01 + axis) * draws[1, axis])


def test_attitude_turns_about_x_then_y_then_z_of_the_body():
    pos, vel, quat = table(20)
    draws = np.random.default_rng(8).normal(size=(3, 3, 20))
    noise = pairs(20, 0.1, 0.01)
    out = believed(pos, vel, quat, noise, draws)
    about = [noise[6 + i][0] + noise[6 + i][1] * draws[2, i] for i in range(3)]
    zero = np.zeros(20)
    turned = quat
    for axis in range(3):
        angles = [zero, zero, zero]
        angles[axis] = about[axis]
        turned = quat_multiply(turned, quat_from_euler(*angles))
    assert np.abs(out[2] - turned).max() < 1e-14


def test_contacts_are_the_others_with_the_noise_of_the_one_who_measures():
    pos, vel, quat = table(6)
    ids, teams = np.arange(10, 16), np.array([1, 1, 2, 2, 3, 3])
    row, other = np.array([0, 0, 1]), np.array([4, 5, 0])
    noise = [np.array([[0.0, 1.0], [0.0, 2.0]])] * 9
    draws = np.random.default_rng(9).normal(size=(3, 3, 3))
    columns = ids[None, other], teams[None, other], pos[:, other], vel[:, other], quat[:, other]
    data = np.ascontiguousarray(np.concatenate(columns))
    contacts.blur(row, tuple(noise[:3]), tuple(noise[3:6]), tuple(noise[6:]), tuple(draws), data)
    assert data[0].tolist() == [14, 15, 10]
    assert data[1].tolist() == [3, 3, 1]
    assert np.array_equal(data[2:5, :2], pos[:, [4, 5]])
    assert np.array_equal(data[5:8, :2], vel[:, [4, 5]])
    assert np.array_equal(data[8:, :2], quat[:, [4, 5]])
    assert np.allclose(data[2:5, 2], pos[:, 0] + 1.0 + 2.0 * draws[0, :, 2])
    assert np.allclose(data[5:8, 2], vel[:, 0] + 1.0 + 2.0 * draws[1, :, 2])
