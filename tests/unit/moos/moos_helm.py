"""A helm for tests that steers vehicles along waypoints, as pHelmIvP does with BHV_Waypoint.

    python moos_helm.py FILE.moos        steers the vehicle of a mission file until it is killed

It posts IVPHELM_STATE four times a second, waits for DEPLOY and MOOS_MANUAL_OVERRIDE, and then posts DESIRED_HEADING and DESIRED_SPEED
whenever a packet of NAV_X and NAV_Y comes. It also answers TUSSLE_STEP, which pHelmIvP does not know.
"""

from __future__ import annotations

import contextlib
import math
import re
import selectors
import socket
import sys
import threading
import time
from pathlib import Path

from moos_database import MAGIC, message, packet, packets, parse, said

READS = ("NAV_X", "NAV_Y", "DEPLOY", "MOOS_MANUAL_OVERRIDE", "TUSSLE_STEP")
POINTS = ((60.0, -40.0), (60.0, -90.0))
HEARTBEAT = 0.25


class Link:
    """A helm's connection to one community."""

    def __init__(self, port, name, points, speed, radius):
        self.name, self.points, self.speed, self.radius = name, list(points), speed, radius
        self.values, self.community = {}, ""
        while not self.is_welcome(
            port
        ):  # a MOOSDB may not have noticed yet that a helm of this name has gone
            self.socket.close()
            time.sleep(0.05)
        self.socket.sendall(packet(*(message("R", key, 0.0, name, self.community) for key in READS)))

    def is_welcome(self, port):
        """Connect and introduce the helm; returns whether the MOOSDB takes it."""
        self.socket, self.received = connected(port), bytearray()
        self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.socket.sendall(MAGIC + packet(message("i", "asynchronous", self.name)))
        (((kind, _, _, _, self.community, _),),) = self.receive()
        return kind == "W"

    def receive(self):
        """The messages of at least one packet."""
        while True:
            data = self.socket.recv(1 << 16)
            if not data:
                raise ConnectionError("the MOOSDB is gone")
            self.received += data
            if found := packets(self.received):
                return [parse(one) for one in found]

    def post(self, **values):
        """Set variables."""
        now = time.time()
        self.socket.sendall(
            packet(*(message("N", key, v, self.name, self.community, now) for key, v in values.items()))
        )

    @property
    def state(self):
        is_on = self.values.get("DEPLOY") == "true" and self.values.get("MOOS_MANUAL_OVERRIDE") == "false"
        return "DRIVE" if is_on else "PARK"

    def steer(self):
        """Post what is desired, and the answer to a step."""
        for messages in self.receive():
            new = {key: value for kind, key, value, *_ in messages if kind == "N"}
            self.values.update(new)
            if "NAV_X" in new and self.state == "DRIVE":
                self.post(**self.desired())
            if "TUSSLE_STEP" in new:
                self.post(TUSSLE_STEP_DONE=new["TUSSLE_STEP"])

    def desired(self):
        x, y = self.values["NAV_X"], self.values["NAV_Y"]
        while self.points and math.dist((x, y), self.points[0]) < self.radius:
            self.points.pop(0)
        if not self.points:
            return {"DESIRED_SPEED": 0.0, "MISSION": "complete"}
        east, north = self.points[0][0] - x, self.points[0][1] - y
        heading = math.degrees(math.atan2(east, north)) % 360.0
        return {"DESIRED_HEADING": heading, "DESIRED_SPEED": self.speed, "DESIRED_DEPTH": 2.0}


class MoosHelm:
    """Helms of one or several communities, in one thread."""

    def __init__(self, *ports, name="pHelmIvP", points=POINTS, speed=3.0, radius=5.0):
        self.links = [Link(port, name, points, speed, radius) for port in ports]
        self.is_over = False
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.close()

    def close(self):
        """End the connections."""
        self.is_over = True
        self.thread.join()
        for link in self.links:
            link.socket.close()

    def run(self):
        posted = -math.inf
        with selectors.DefaultSelector() as selector:
            for link in self.links:
                selector.register(link.socket, selectors.EVENT_READ, link)
            while not self.is_over and selector.get_map():
                if time.monotonic() > posted + HEARTBEAT:
                    posted = time.monotonic()
                    for link in self.links:
                        with contextlib.suppress(OSError):
                            link.post(IVPHELM_STATE=link.state)
                for key, _ in selector.select(0.05):
                    try:
                        key.data.steer()
                    except OSError:
                        selector.unregister(key.fileobj)


def connected(port):
    """A connection, once the MOOSDB is there."""
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port))
        except ConnectionRefusedError:
            time.sleep(0.05)


def points_of(path):
    """Waypoints, speed and radius of a file of behaviours."""
    values = said(path)
    points = [tuple(map(float, point.split(","))) for point in re.split(r"\s*:\s*", values["points"])]
    return points, float(values["speed"]), float(values["capture_radius"])


if __name__ == "__main__":
    mission = said(sys.argv[1])
    found = points_of(Path(sys.argv[1]).with_name(mission["behaviors"]))
    MoosHelm(int(mission["ServerPort"]), points=found[0], speed=found[1], radius=found[2]).thread.join()
