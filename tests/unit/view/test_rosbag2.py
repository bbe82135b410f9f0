"""A bag holds what the run's tables hold, as read by rosbags."""

from __future__ import annotations

import itertools
import sys

import numpy as np
import pytest
from recorded_games import hunt, record

from tussle import load_run
from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.numeric.quaternion import quat_multiply, quat_rotate
from tussle.view import Recording
from tussle.view.export.rosbag2 import write_rosbag2

NANO = 1_000_000_000
COLUMNS = ["x", "y", "z", "qw", "qx", "qy", "qz", "vx", "vy", "vz"]


@pytest.fixture(scope="module")
def hunted(tmp_path_factory):
    """Births in the middle of it, captures, deaths."""
    return Recording(record(hunt(n_prey=8, end=12.0), tmp_path_factory.mktemp("runs") / "run", (5,)))


def messages(path):
    """Topic, time and message of each."""
    reading, typesys = pytest.importorskip("rosbags.rosbag2"), pytest.importorskip("rosbags.typesys")
    store = typesys.get_typestore(typesys.Stores.ROS2_JAZZY)
    with reading.Reader(path) as reader:
        for topic, when, data in reader.messages():
            yield topic.topic, when, store.deserialize_cdr(data, topic.msgtype)


def stamp_of(stamp):
    return stamp.sec * NANO + stamp.nanosec


def numbers(at):
    return [at.x, at.y, at.z]


def attitude(q):
    return [q.w, q.x, q.y, q.z]


@pytest.mark.parametrize(("storage", "file"), [("mcap", "bag.mcap"), ("sqlite3", "bag.db3")])
def test_a_bag_holds_the_states_of_the_tables(hunted, tmp_path, storage, file):
    seen = []
    report = write_rosbag2(
        hunted, tmp_path / "bag", storage=storage, show=lambda done, of: seen.append((done, of))
    )
    assert report.path == tmp_path / "bag" / file
    assert report.path.is_file()
    table = load_run(hunted.path, frames="pandas").trajectory
    states = table[["t", "id", *COLUMNS]].to_numpy(float)
    expected = {(round(t * NANO), int(who)): state for t, who, *state in states.tolist()}
    odometry, transforms, clocks, n = {}, {}, [], 0
    for topic, when, message in messages(tmp_path / "bag"):
        n += 1
        if topic == "/clock":
            assert stamp_of(message.clock) == when
            clocks.append(when)
        elif topic == "/tf":
            for one in message.transforms:
                assert stamp_of(one.header.stamp) == when
                transforms[when, one.child_frame_id] = one
        else:
            who = int(topic.removeprefix("/entity").removesuffix("/base_pose_ground_truth"))
            assert message.header.frame_id == "world"
            assert message.child_frame_id == f"entity{who}/base_link"
            assert stamp_of(message.header.stamp) == when
            odometry[when, who] = message
    assert clocks == [round(t * NANO) for t in hunted.t.tolist()]
    assert seen[-1] == (hunted.n_frames, hunted.n_frames) == (report.n_frames, report.n_frames)
    assert n == report.n_messages
    assert odometry.keys() == expected.keys()
    assert len({who for _, who in expected}) > 8
    for (when, who), state in expected.items():
        pose, chain = odometry[when, who].pose.pose, []
        for parent, child in itertools.pairwise(
            ["world", *(f"entity{who}/{frame}" for frame in ("odom", "base_footprint", "base_link"))]
        ):
            chain.append(transforms[when, child])
            assert chain[-1].header.frame_id == parent
        _, footprint, base = (one.transform for one in chain)
        assert footprint.translation.z == 0.0
        assert attitude(footprint.rotation)[1:3] == [0.0, 0.0]  # level
        at = numbers(footprint.translation)
        turn = np.array(attitude(footprint.rotation))
        place = at + quat_rotate(turn, np.array(numbers(base.translation)))
        whole = quat_multiply(turn, np.array(attitude(base.rotation)))
        assert place == pytest.approx(state[:3], abs=1e-9)
        assert abs(whole @ state[3:7]) == pytest.approx(1.0, abs=1e-12)
        linear = numbers(odometry[when, who].twist.twist.linear)
        assert numbers(pose.position) == state[:3]
        assert attitude(pose.orientation) == state[3:7]
        assert quat_rotate(np.array(state[3:7]), np.array(linear)) == pytest.approx(state[7:], abs=1e-9)


def test_a_period_and_an_existing_bag(hunted, tmp_path):
    write_rosbag2(hunted, tmp_path / "bag")
    report = write_rosbag2(hunted, tmp_path / "bag", period=1.0, prefix="robot")
    topics = {topic for topic, _, _ in messages(tmp_path / "bag")}
    assert "/robot1/base_pose_ground_truth" in topics
    assert report.n_frames < hunted.n_frames / 2
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == ["bag.mcap", "metadata.yaml"]
    assert [path.name for path in tmp_path.iterdir()] == ["bag"]


def test_a_format_that_is_none_is_refused(hunted, tmp_path):
    with pytest.raises(ParameterError, match="storage = 'bz2' is not allowed; allowed are mcap, sqlite3"):
        write_rosbag2(hunted, tmp_path / "bag", storage="bz2")
    assert list(tmp_path.iterdir()) == []


def test_what_is_no_bag_is_not_replaced(hunted, tmp_path):
    (tmp_path / "kept").write_text("kept")
    with pytest.raises(ViewError, match="it exists and is no rosbag2"):
        write_rosbag2(hunted, tmp_path)
    assert (tmp_path / "kept").read_text() == "kept"
    with pytest.raises(ViewError, match="cannot be written"):
        write_rosbag2(hunted, tmp_path / "kept" / "bag")


def test_without_rosbags_the_error_names_the_extra(hunted, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(MissingExtraError, match=r"pip install 'tussle\[ros2\]'"):
        write_rosbag2(hunted, tmp_path / "bag")
