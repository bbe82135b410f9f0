"""A run as a rosbag2: the topics of `ROS2Autonomy`, which `ros2 bag play` publishes."""

from __future__ import annotations

import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np

from tussle.errors import MissingExtraError, ParameterError, ViewError
from tussle.numeric.quaternion import quat_rotate_inverse
from tussle.plugins.links.ros.messages import clock_bytes, odometry_bytes, transforms_bytes
from tussle.plugins.links.ros.robot import AT_ORIGIN, FRAMES, ROOT, height_above_floor, on_floor
from tussle.plugins.links.ros.steps import NANO, Transform
from tussle.view.export.whole_file import unwritable
from tussle.view.frame import Frame
from tussle.view.page.recorded import frames_to_write
from tussle.view.recording import Recording
from tussle.world.scene import Scene

VERSION: Literal[8] = 8
"""Version of the format: the oldest that the package rosbags writes."""
MAX_TIME = 2.0**31
"""Stamps of ROS are less [s]."""
METADATA = "metadata.yaml"
STORAGES = {"mcap": ".mcap", "sqlite3": ".db3"}
"""Formats of the file of messages, by the names of `ros2 bag`, and the ends of its name."""


@dataclass
class BagReport:
    """A bag that was written.

    Attributes:
        path: Its file of messages.
        n_frames: States in it.
        n_messages: Messages in it.
        notes: What the user should know, one line each.
    """

    path: Path
    n_frames: int = 0
    n_messages: int = 0
    notes: list[str] = field(default_factory=list)


def write_rosbag2(
    recording: Recording,
    path: str | Path,
    *,
    period: float | None = None,
    prefix: str = "entity",
    storage: str = "mcap",
    show: Callable[[int, int], None] | None = None,
) -> BagReport:
    """Write a run, complete or not, as a folder of rosbag2.

    Topics: /clock, /tf, and base_pose_ground_truth of each entity. Angular velocities are not recorded, and 0.

    Args:
        recording: The run.
        path: The folder; an existing bag is replaced.
        period: Time between states that are written [s]; None writes all.
        prefix: Beginning of the namespaces; the id follows.
        storage: Format of its file of messages, one of STORAGES.
        show: Called after each state with the numbers of states written and to write.

    Raises:
        ViewError: There is nothing to write, the bag cannot be written, or a time does not fit.
        ParameterError: The format is none of STORAGES, or the period is not allowed.
        MissingExtraError: rosbags is not installed.
    """
    try:
        from rosbags.rosbag2 import StoragePlugin, Writer
    except ImportError:
        raise MissingExtraError(
            "rosbag2 needs rosbags, which is not installed: pip install 'tussle[ros2]'"
        ) from None
    if storage not in STORAGES:
        raise ParameterError(f"storage = {storage!r} is not allowed; allowed are {', '.join(STORAGES)}")
    target, kept = Path(path), frames_to_write(recording, period)
    if target.exists() and not (target / METADATA).is_file():
        raise unwritable(target, "it exists and is no rosbag2")
    scene = recording.mission.scene if recording.mission else Scene()
    report = BagReport(target / f"{target.name}{STORAGES[storage]}", len(kept))
    shift = max(0, -math.floor(float(recording.t[0])))
    if shift:
        report.notes.append(f"t = 0 is {shift} s in the bag, since stamps of ROS are not negative")
    if float(recording.t[-1]) + shift >= MAX_TIME:
        raise ViewError(f"{recording.path}: {recording.t[-1]:g} s is no stamp of ROS, which takes 68 years")
    part = target.with_name(f".{target.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        plugin = StoragePlugin[storage.upper()]
        with Writer(part / target.name, version=VERSION, storage_plugin=plugin) as writer:
            bag = _Bag(writer, prefix, scene)
            for n, i in enumerate(kept, 1):
                bag.put(recording.frame(int(i)), shift)
                if show is not None:
                    show(n, len(kept))
        shutil.rmtree(target, ignore_errors=True)
        (part / target.name).replace(target)
    except OSError as error:
        raise unwritable(target, error) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)
    report.n_messages = bag.n_messages
    return report


class _Bag:
    """Writer of an open rosbag2."""

    def __init__(self, writer: Any, prefix: str, scene: Scene) -> None:
        from rosbags.typesys import Stores, get_typestore

        self._writer, self._prefix, self._scene, self.n_messages = writer, prefix, scene, 0
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._clock = self._topic("/clock", "rosgraph_msgs/msg/Clock")
        self._tf = self._topic("/tf", "tf2_msgs/msg/TFMessage")
        self._robots: dict[int, tuple[Any, Any, list[str]]] = {}

    def _topic(self, name: str, type_: str) -> Any:
        return self._writer.add_connection(name, type_, typestore=self._store)

    def _robot(self, who: int) -> tuple[Any, Any, list[str]]:
        if who not in self._robots:
            frames = [f"{self._prefix}{who}/{frame}" for frame in FRAMES[:3]]
            topic = self._topic(f"/{self._prefix}{who}/base_pose_ground_truth", "nav_msgs/msg/Odometry")
            self._robots[who] = topic, odometry_bytes(ROOT, frames[2]), frames
        return self._robots[who]

    def _put(self, topic: Any, when: int, data: bytes) -> None:
        self._writer.write(topic, when, data)
        self.n_messages += 1

    def put(self, frame: Frame, shift: int) -> None:
        """Add the state of all entities at one time."""
        when = round((frame.t + shift) * NANO)
        stamp = divmod(when, NANO)
        self._put(self._clock, when, clock_bytes(stamp))
        turned = quat_rotate_inverse(frame.quat.T, frame.vel.T).T
        states = np.concatenate([frame.pos, frame.quat, turned, np.zeros_like(turned)], axis=1).tolist()
        pos = frame.pos.T
        poses = on_floor(pos, frame.quat.T, height_above_floor(self._scene, pos))
        transforms: list[Transform] = []
        for who, state, *own in zip(frame.id.tolist(), states, *poses, strict=True):
            topic, pack, frames = self._robot(who)
            self._put(topic, when, pack(stamp, state, None))
            for parent, child, pose in zip([ROOT, *frames], frames, [AT_ORIGIN, *own], strict=False):
                transforms.append(Transform(parent, child, stamp, pose))
        if transforms:
            self._put(self._tf, when, transforms_bytes(transforms))
