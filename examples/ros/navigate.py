"""A navigation client of ROS 1: it drives one robot to goals through a world that it knows only from its lidar.

    python3 navigate.py __ns:=/entity1 _goals:="[[66, 66]]"

It knows nothing of the simulator. In the namespace it hears odom and base_scan, builds a map, plans a path with A* and follows it by
cmd_vel, a speed and a steering angle. It plans again when the lidar sees something in the way. Goals come from the parameter goals or from
the topic move_base_simple/goal; the map is published on map (nav_msgs/OccupancyGrid). Each odom is answered with a cmd_vel.
"""

import heapq
import math
import threading

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped, Twist
from nav_msgs.msg import OccupancyGrid, Odometry
from sensor_msgs.msg import LaserScan

FREE, UNKNOWN, OCCUPIED = 0, -1, 100
SCAN_AGE = 1.0  # [s] a robot whose newest scan is older stands still
STEPS = [(i, j, math.hypot(i, j)) for i in (-1, 0, 1) for j in (-1, 0, 1) if i or j]


class Grid:
    """What the lidar has seen: log odds of each cell, (n, n), by row (y) and column (x).

    Args:
        half_width: Half the width of the square about the origin [m].
        cell: Width of a cell [m].
    """

    def __init__(self, half_width: float, cell: float) -> None:
        self.half_width, self.cell, self.n = half_width, cell, math.ceil(2.0 * half_width / cell)
        self.odds = np.zeros((self.n, self.n), np.int8)

    def cells(self, points: np.ndarray) -> np.ndarray:
        """Rows and columns of points [m], (..., 2), within the grid."""
        index = np.floor((points[..., ::-1] + self.half_width) / self.cell).astype(int)
        return np.clip(index, 0, self.n - 1)

    def point(self, cell: tuple[int, int]) -> tuple[float, float]:
        """Centre of a cell [m]."""
        row, column = cell
        return (column + 0.5) * self.cell - self.half_width, (row + 0.5) * self.cell - self.half_width

    def add(
        self, pos: np.ndarray, angles: np.ndarray, ranges: np.ndarray, least: float, limit: float
    ) -> None:
        """Add a scan from pos [m], (2,): angles in the world frame [rad] and ranges [m] by REP 117.

        A range of `limit` [m] or more met nothing, -inf met something nearer than `least` [m], and nan is unknown.
        """
        ranges = np.where(np.isneginf(ranges), least, ranges)
        rays = np.stack([np.cos(angles), np.sin(angles)], axis=-1)
        along = np.arange(0.0, limit, 0.5 * self.cell)
        seen = along[None, :] < ranges[:, None] - self.cell
        free = self.cells((pos + along[None, :, None] * rays[:, None, :])[seen])
        hit = ranges < limit
        struck = self.cells(pos + (ranges[hit] + 0.1 * self.cell)[:, None] * rays[hit])
        change = np.zeros_like(self.odds)
        change[free[:, 0], free[:, 1]] = -1
        change[struck[:, 0], struck[:, 1]] = 3
        self.odds = np.clip(self.odds + change, -6, 12)

    def costs(self, radius: float) -> np.ndarray:
        """Cost factor of each cell, (n, n): infinite within `radius` [m] of what is occupied, and high up to twice that."""
        clearance = np.full(self.odds.shape, 2.0 * radius)
        occupied = self.odds > 0
        reach = math.ceil(2.0 * radius / self.cell)
        for i in range(-reach, reach + 1):
            for j in range(-reach, reach + 1):
                distance = math.hypot(i, j) * self.cell
                if distance < 2.0 * radius:
                    near = _shifted(occupied, i, j)
                    clearance[near] = np.minimum(clearance[near], distance)
        costs = 1.0 + 8.0 * (2.0 - clearance / radius)
        costs[clearance < radius] = math.inf
        return costs

    def message(self, frame: str, stamp: rospy.Time) -> OccupancyGrid:
        """The map as a message."""
        grid = OccupancyGrid()
        grid.header.frame_id, grid.header.stamp = frame, stamp
        grid.info.resolution, grid.info.width, grid.info.height = self.cell, self.n, self.n
        grid.info.origin.position.x = grid.info.origin.position.y = -self.half_width
        grid.info.origin.orientation.w = 1.0
        values = np.where(self.odds > 0, OCCUPIED, np.where(self.odds < 0, FREE, UNKNOWN))
        grid.data = values.ravel().tolist()
        return grid


def _shifted(mask: np.ndarray, rows: int, columns: int) -> np.ndarray:
    """The mask moved by some rows and columns; what comes in is false."""
    moved, (n, m) = np.zeros_like(mask), mask.shape
    to_r, to_c = slice(max(rows, 0), n + min(rows, 0)), slice(max(columns, 0), m + min(columns, 0))
    from_r, from_c = slice(max(-rows, 0), n - max(rows, 0)), slice(max(-columns, 0), m - max(columns, 0))
    moved[to_r, to_c] = mask[from_r, from_c]
    return moved


def plan(costs: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> list[tuple[int, int]]:
    """The cheapest path of cells from start to goal by A* (Hart, Nilsson and Raphael 1968); empty without one.

    A start that is too near to an obstacle may be left: the cells about it cost much, but not infinitely.
    """
    cost = costs.copy()
    row, column = start
    about = (slice(max(row - 4, 0), row + 5), slice(max(column - 4, 0), column + 5))
    cost[about] = np.minimum(cost[about], 100.0)
    best, came, done = {start: 0.0}, {start: start}, set()
    heap = [(0.0, start)]
    while heap:
        _, cell = heapq.heappop(heap)
        if cell == goal:
            path = [cell]
            while path[-1] != start:
                path.append(came[path[-1]])
            return path[::-1]
        if cell in done:
            continue
        done.add(cell)
        for i, j, length in STEPS:
            to = cell[0] + i, cell[1] + j
            if not (0 <= to[0] < len(cost) and 0 <= to[1] < len(cost)) or math.isinf(cost[to]):
                continue
            total = best[cell] + length * float(cost[to])
            if total < best.get(to, math.inf):
                best[to], came[to] = total, cell
                heapq.heappush(heap, (total + math.hypot(to[0] - goal[0], to[1] - goal[1]), to))
    return []


class Navigator:
    """Drives one robot: map, planner and follower, by the node's parameters."""

    def __init__(self) -> None:
        get = rospy.get_param
        self.grid = Grid(get("~half_width", 105.0), get("~cell", 1.5))
        self.radius, self.speed = get("~radius", 5.0), get("~speed", 6.0)
        self.wheelbase, self.steering = get("~wheelbase", 2.62), get("~max_steering", 0.6)
        self.lookahead, self.tolerance = get("~lookahead", 7.0), get("~tolerance", 4.0)
        self.goals: list[tuple[float, float]] = [(float(x), float(y)) for x, y in get("~goals", [])]
        self.path: list[tuple[int, int]] = []
        self.costs = self.grid.costs(self.radius)
        self.pose: tuple[np.ndarray, float] | None = None
        self.frame, self.n_scans, self.scan_time = "odom", 0, -math.inf
        self.lock = threading.Lock()
        self.map = rospy.Publisher("map", OccupancyGrid, queue_size=1, latch=True)
        self.command = rospy.Publisher("cmd_vel", Twist, queue_size=1, tcp_nodelay=True)
        rospy.Subscriber("move_base_simple/goal", PoseStamped, self.take_goal)
        rospy.Subscriber("base_scan", LaserScan, self.take_scan, queue_size=1)
        rospy.Subscriber("odom", Odometry, self.take_odom, queue_size=1, tcp_nodelay=True)

    def take_goal(self, message: PoseStamped) -> None:
        """Drive to this place instead."""
        with self.lock:
            self.goals, self.path = [(message.pose.position.x, message.pose.position.y)], []

    def take_scan(self, message: LaserScan) -> None:
        """Add a scan to the map, and drop the path if it is blocked."""
        with self.lock:
            if self.pose is None:
                return
            pos, yaw = self.pose
            ranges = np.array(message.ranges)
            angles = yaw + message.angle_min + message.angle_increment * np.arange(len(ranges))
            self.grid.add(pos, angles, ranges, message.range_min, message.range_max)
            self.costs = self.grid.costs(self.radius)
            self.n_scans, self.scan_time = self.n_scans + 1, message.header.stamp.to_sec()
            if any(math.isinf(self.costs[cell]) for cell in self.path[4:]):
                self.path = []
            if self.n_scans % 50 == 1:
                self.map.publish(self.grid.message(self.frame, message.header.stamp))

    def take_odom(self, message: Odometry) -> None:
        """Answer a state with a command."""
        p, q = message.pose.pose.position, message.pose.pose.orientation
        yaw = math.atan2(2.0 * (q.w * q.z + q.x * q.y), 1.0 - 2.0 * (q.y * q.y + q.z * q.z))
        with self.lock:
            self.pose, self.frame = (np.array([p.x, p.y]), yaw), message.header.frame_id
            command = Twist()
            if message.header.stamp.to_sec() - self.scan_time < SCAN_AGE:
                command.linear.x, command.angular.z = self.drive(*self.pose)
        self.command.publish(command)

    def drive(self, pos: np.ndarray, yaw: float) -> tuple[float, float]:
        """Speed [m/s] and steering angle [rad] by pure pursuit (Coulter 1992) of the path to the current goal."""
        if self.goals and math.dist(pos, self.goals[0]) < self.tolerance:
            print(f"{rospy.get_namespace()} reached {self.goals[0]}", flush=True)
            self.goals, self.path = self.goals[1:], []
        if not self.goals:
            return 0.0, 0.0
        here = tuple(self.grid.cells(pos).tolist())
        if not self.path:
            self.path = plan(self.costs, here, tuple(self.grid.cells(np.array(self.goals[0])).tolist()))
        if not self.path:
            return 0.0, 0.0
        points = np.array([self.grid.point(cell) for cell in self.path])
        nearest = int(np.argmin(np.hypot(*(points - pos).T)))
        self.path, points = self.path[nearest:], points[nearest:]
        away = np.hypot(*(points - pos).T)
        ahead = int(np.argmax(away > self.lookahead)) if (away > self.lookahead).any() else len(points) - 1
        east, north = points[ahead] - pos
        bearing = math.remainder(math.atan2(north, east) - yaw, math.tau)
        curve = 2.0 * math.sin(bearing) / max(math.hypot(east, north), 1.0)
        angle = math.atan(self.wheelbase * curve)
        if abs(bearing) > 0.5 * math.pi:  # what lies behind is reached by the tightest turn
            angle = math.copysign(self.steering, bearing)
        angle = min(max(angle, -self.steering), self.steering)
        return self.speed * (1.0 - 0.7 * abs(angle) / self.steering), angle


if __name__ == "__main__":
    rospy.init_node("navigate", anonymous=True)
    navigator = Navigator()
    rospy.spin()
