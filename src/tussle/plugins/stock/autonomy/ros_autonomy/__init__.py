"""Robots that are driven by nodes of ROS 1, and what those of ROS 2 share with them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np

from tussle.api import Autonomy, GroupView, Handle, Input, Output, Param, State
from tussle.numeric.quaternion import (
    quat_conjugate,
    quat_from_euler,
    quat_multiply,
    quat_rotate,
    quat_rotate_inverse,
)
from tussle.plugins.links.ros.link import RosLink
from tussle.plugins.links.ros.robot import AT_ORIGIN, RobotTopics, height_above_floor, on_floor
from tussle.plugins.links.ros.steps import NodeLink


class CommandedByROS(Autonomy):
    """Columns and methods of robots that follow cmd_vel; abstract."""

    grade = "external"
    awaits = "ROS"
    link_type: ClassVar[type[NodeLink]] = RosLink
    """What connects it to ROS."""
    publishes: ClassVar[bool] = False
    """Whether it publishes the states of robots."""

    watchdog_timeout = Param(
        0.0,
        unit="s",
        ge=0.0,
        doc="Simulated time after which a robot stops without a new command; 0 for never.",
    )
    stamped_commands = Param(
        False, structural=True, doc="Whether cmd_vel is a TwistStamped; otherwise it is a Twist."
    )
    speed = Output(unit="m/s", doc="linear.x of the last command.")
    turn_rate = Output(unit="rad/s", doc="angular.z.")
    steering = Output(unit="rad", doc="angular.z, for cars, whose steering angle it is.")
    pitch_rate = Output(unit="rad/s", doc="-angular.y: nose up positive.")
    roll_rate = Output(unit="rad/s", doc="angular.x.")
    velocity = Output(
        "velocity_x velocity_y velocity_z",
        unit="m/s",
        doc="linear, turned by the heading to the world frame.",
    )
    robot = Handle(max_worlds=1, doc="Topics of the robot.")

    def namespace(self, row: Any) -> str:
        """Return the namespace of the robot of a handle's row."""
        raise TypeError(f"{type(self).__name__} has no namespace")

    def open_one(self, row: Any) -> RobotTopics:
        """Subscribe to the commands.

        Raises:
            MissingExtraError: rospy or Cyclone DDS is not installed.
            RosError: The master does not answer, or the domain cannot be joined.
            ParameterError: The namespace is no name of ROS.
        """
        link, is_stamped = self.link_type.of(row.shared), row.plugin.values["stamped_commands"]
        robot = RobotTopics(link, self.namespace(row), self.publishes, is_stamped)
        if self.publishes:
            link.namespaces[row.id] = robot.namespace
        return robot

    def close_one(self, robot: RobotTopics) -> None:
        """Take no more commands."""
        robot.link.unsubscribe(robot.inbox.subscriber)

    def await_peers(self, g: GroupView) -> None:
        """Wait for nodes before the first step; only robots that publish do, in lockstep."""

    def publish_state(self, g: GroupView) -> list[Any]:
        """Publish the states of all robots, and return their transforms; only robots that publish do."""
        return []

    def begin_odometry(self, g: GroupView, rows: np.ndarray) -> None:
        """Begin the odometry of newborn rows; only robots that publish have any."""

    def spawn(self, g: GroupView, rows: np.ndarray) -> None:
        """Let the link publish the states of this group."""
        self.begin_odometry(g, rows)
        robots: Any = self.robot
        for robot in [robots[row] for row in rows]:
            robot.link.groups[id(self)] = self, g
            if self.publishes and "scan_pattern" in g.services:
                robot.advertise_scan()

    def step(self, g: GroupView) -> None:
        """Publish the states, and write the newest commands to the channels."""
        robots: Any = self.robot
        if not g.n:  # no master
            return
        link: NodeLink = robots[0].link
        link.begin_step(g)
        self._await_commands(g)
        commands = np.empty((6, g.n))
        for row, (robot, t, timeout) in enumerate(zip(robots, g.t, self.watchdog_timeout, strict=True)):
            if fault := robot.inbox.fault or link.lost:
                g.fail(row, fault)
            commands[:, row] = robot.inbox.at(t, timeout)
        self.speed[:], self.turn_rate[:], self.steering[:] = commands[0], commands[5], commands[5]
        self.roll_rate[:], self.pitch_rate[:] = commands[3], -commands[4]
        # By the heading only: a body that pitches or banks when it moves would otherwise climb or sink.
        self.velocity[:] = quat_rotate(quat_from_euler(0.0 * g.yaw, 0.0 * g.yaw, g.yaw), commands[:3])

    def _await_commands(self, g: GroupView) -> None:
        """Wait for the commands of this step; only robots that publish do, in lockstep."""


class PublishedByROS(CommandedByROS):
    """Columns and methods of robots that publish their states; abstract."""

    publishes = True
    namespace_prefix = Param("entity", doc="Beginning of the namespace; the id follows.")
    lockstep = Param(
        0.0, unit="s", ge=0.0, structural=True,
        doc="Longest wait in each step, in wall time, for a command to each robot; 0: take those that are there.",
    )  # fmt: skip
    odometry_time = State(unit="s", doc="Time of the last odometry.")
    drift = State("x y z", unit="m", doc="Error of the position of odometry: the sum of those of velocities.")
    drift_variance = State("x y z", unit="m^2", doc="Variance of the drift.")
    measured_vel = State("x y z", unit="m/s", doc="Velocity of the last odometry, world frame.")
    measured_for = State(unit="s", doc="Time for which the measured velocity has been the same.")
    points = Input(
        "raytrace", fields="x y z range in_range", unit="m m m m 1", ragged=True, optional=True, doc="Scan."
    )

    def namespace(self, row: Any) -> str:
        """Return the namespace of the robot of a handle's row."""
        return f"{row.plugin.values['namespace_prefix']}{row.id}"

    def begin_odometry(self, g: GroupView, rows: np.ndarray) -> None:
        """Begin the odometry of newborn rows, without an error."""
        self.odometry_time[rows], self.measured_vel[:, rows] = g.t[rows], g.vel[:, rows]

    def publish_state(self, g: GroupView) -> list[Any]:
        """Publish the states of all robots, and return their transforms."""
        robots: Any = self.robot
        link: NodeLink = robots[0].link
        bodies, rows = g.bodies, slice(g.first, g.last)
        pos, quat, vel, omega = (
            np.asarray(getattr(bodies, name)[:, rows]) for name in ("pos", "quat", "vel", "omega")
        )
        covariances = self._dead_reckon(g, quat, vel)
        actual = _body_states(pos, quat, vel, omega)
        odometry = _body_states(pos + self.drift, quat, g.vel, omega)
        height = height_above_floor(g.scene, pos)
        poses = [self._anchors(g, pos + self.drift, quat), *on_floor(pos + self.drift, quat, height)]
        stamp = link.stamp(float(g.t[0]))
        pattern = g.call("scan_pattern") if "scan_pattern" in g.services else None
        transforms: list[Any] = []
        for row, robot in enumerate(robots):
            robot.n_before = robot.inbox.n_received  # before publishing: the answer may be quick
            robot.publish_odometry(
                stamp, odometry[row], None if covariances is None else covariances[row], actual[row]
            )
            own = [pose[row] for pose in poses]
            if pattern is not None:
                about = pattern(row)
                own.append([*about.pos.tolist(), *about.quat.tolist()])
                self._publish_scan(g, row, robot, about)
            transforms += robot.transforms(own, stamp)
        return transforms

    def _dead_reckon(self, g: GroupView, quat: np.ndarray, vel: np.ndarray) -> np.ndarray | None:
        """Let the odometry drift, as one that adds up measured velocities; returns its covariances, (n, 2, 36), if it has any.

        Args:
            g: The robots.
            quat: True attitudes, (4, n).
            vel: True velocities, world frame [m/s], (3, n).
        """
        if not g.belief:
            return None
        dt = g.t - self.odometry_time
        self.odometry_time[:] = g.t
        is_held = (g.vel == self.measured_vel).all(axis=0)
        self.measured_vel[:] = g.vel
        self.measured_for[:] = np.where(is_held, self.measured_for, 0.0) + dt
        self.drift[:] += (g.vel - vel) * dt
        if "velocity_noise" not in g.services:
            return None
        variance = g.call("velocity_noise") ** 2
        # In the time T for which an error is held, it grows to T times the error: its variance to T^2 times that of the velocity.
        self.drift_variance[:] += variance * dt * (2.0 * self.measured_for - dt)
        covariances = np.zeros((g.n, 2, 6, 6))
        axes = np.stack([
            quat_rotate_inverse(quat, np.repeat(axis[:, None], g.n, axis=1)) for axis in np.eye(3)
        ])  # fmt: skip
        covariances[:, 1, :3, :3] = np.einsum("kin,kn,kjn->nij", axes, variance, axes)
        for axis in range(3):
            covariances[:, 0, axis, axis] = self.drift_variance[axis]
        return covariances.reshape(g.n, 2, 36)

    def _anchors(self, g: GroupView, pos: np.ndarray, quat: np.ndarray) -> list[list[float]]:
        """Poses of odom in the root, where the robots, at `pos` [m] and `quat` in odom, believe themselves to be."""
        if not g.belief:
            return [AT_ORIGIN] * g.n
        turn = quat_multiply(g.quat, quat_conjugate(quat))
        anchors: list[list[float]] = np.concatenate([g.pos - quat_rotate(turn, pos), turn]).T.tolist()
        return anchors

    def _publish_scan(self, g: GroupView, row: int, robot: RobotTopics, about: Any) -> None:
        """Publish the scan of a row if it is new."""
        points: Any = self.points
        begin, end = points.start[row : row + 2]
        if about.n_elevations > 1:
            g.fail(
                row,
                f"/{robot.namespace}/base_scan takes one elevation; RayTrace has num_rays_vert = {about.n_elevations}",
            )
        elif end > begin and about.time != robot.last_scan:
            robot.last_scan = about.time
            robot.publish_scan(points.data[3, begin:end], about, robot.link.stamp(about.time))

    def await_peers(self, g: GroupView) -> None:
        """Wait before the first step in lockstep until each robot has a node that reads its state and can answer."""
        robots: Any = self.robot
        if self.lockstep and not all(robot.inbox.n_received for robot in robots):
            why = "nobody has subscribed to /{0}/odom and publishes /{0}/cmd_vel"
            self._await(g, RobotTopics.has_peer, why)
            link: NodeLink = robots[0].link
            link.wait_for(lambda: False, link.settling_time, g.context.is_interrupted)

    def _await_commands(self, g: GroupView) -> None:
        def has_news(robot: RobotTopics) -> bool:
            return robot.inbox.n_received > robot.n_before or bool(robot.inbox.fault)

        if self.lockstep:
            self._await(g, has_news, "no message on /{0}/cmd_vel")

    def _await(self, g: GroupView, is_there: Callable[[RobotTopics], bool], why: str) -> None:
        """Wait until something holds for all robots; end the world if that takes too long."""
        robots: Any = self.robot
        link, is_interrupted = robots[0].link, g.context.is_interrupted
        if not link.wait_for(lambda: all(map(is_there, robots)), self.lockstep, is_interrupted):
            for row, robot in enumerate(robots):
                if not (is_there(robot) or link.lost or is_interrupted()):
                    limit = f"within {self.lockstep:g} s, as lockstep needs"
                    g.fail(row, f"{why.format(robot.namespace)} {limit}")


class ROSAutonomy(PublishedByROS):
    """Connects a robot to ROS 1 as Stage does: cmd_vel moves it; odom, base_pose_ground_truth, base_scan and tf are published.

    Its topics are in the namespace `namespace_prefix` followed by its id, such as entity1/cmd_vel, and so are its frames, as REP 105 and
    120 have them: odom, base_footprint, base_link, base_laser_link, below `world`, the mission's frame. At the beginning of each step it
    publishes the states at that time and takes the newest command; a robot without any stands still. base_pose_ground_truth is its true
    state. odom is that too where no sensor measures the state. Otherwise it adds up the measured velocities: it drifts but does not
    jump, and the transform from `world` to odom is such that the robot is where it believes to be. base_scan is the scan of a
    `RayTrace` with one elevation. Stamps are simulated time with `ROSClockServer` or the ROS parameter use_sim_time, and the wall
    clock's otherwise. [ROS](../ros.md) tells more.

    With `lockstep`, each step waits until each robot has received a command after its odom of that step.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """


class ROSControl(CommandedByROS):
    """Lets cmd_vel of ROS 1 move a robot, and publishes nothing; see `ROSAutonomy`.

    The existing system writes a desired state of 30 m/s which no controller reads.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: No ROS master answers.
    """

    ros_namespace_prefix = Param("robot", doc="Beginning of the namespace; the id follows.")

    def namespace(self, row: Any) -> str:
        """Return the namespace of the robot of a handle's row."""
        return f"{row.plugin.values['ros_namespace_prefix']}{row.id}"


def _body_states(pos: np.ndarray, quat: np.ndarray, vel: np.ndarray, omega: np.ndarray) -> list[list[float]]:
    """Position, attitude, and both velocities turned into the body frame: 13 numbers of each row."""
    turned = quat_rotate_inverse(quat, vel), quat_rotate_inverse(quat, omega)
    states: list[list[float]] = np.concatenate([pos, quat, *turned]).T.tolist()
    return states
