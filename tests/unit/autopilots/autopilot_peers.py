"""Peers of tests: processes that fly vehicles, and threads that answer as a test says."""

from __future__ import annotations

import contextlib
import importlib
import itertools
import os
import selectors
import socket
import struct
import subprocess
import sys
import threading
from pathlib import Path

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples" / "autopilots"
LONG = 300.0
"""A wait that ends with what is waited for."""


def example(name):
    """A module of the examples."""
    sys.path.insert(0, str(EXAMPLES))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(EXAMPLES))


def open_sockets():
    """Open sockets of this process."""
    folder, found = "/proc/self/fd", set()
    for name in os.listdir(folder):  # noqa: PTH208
        with contextlib.suppress(OSError):
            target = os.readlink(f"{folder}/{name}")  # noqa: PTH115
            if target.startswith("socket:"):
                found.add(target)
    return found


FIRST_PORT, PORTS_EACH = 20_000, 1_000
"""Ports of tests, below those that systems give to clients, and their number for each worker of pytest."""
COUNTER = itertools.count(os.getpid() % PORTS_EACH)


def free_ports(n=1, step=1, kind=socket.SOCK_DGRAM):
    """The first of n free ports, each `step` after the one before; others than those of the calls before."""
    worker = int(os.environ.get("PYTEST_XDIST_WORKER", "gw0")[2:])
    length = (n - 1) * step + 1
    while True:
        first = FIRST_PORT + worker * PORTS_EACH + next(COUNTER) % (PORTS_EACH - length)
        with contextlib.ExitStack() as stack:
            try:
                for port in range(first, first + length, step):
                    made = stack.enter_context(socket.socket(socket.AF_INET, kind))
                    made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, kind == socket.SOCK_STREAM)
                    made.bind(("127.0.0.1", port))
            except OSError:
                continue
        for _ in range(length):
            next(COUNTER)
        return first


class Process:
    """A peer in a process of its own, which has said that it is ready."""

    def __init__(self, script, *arguments):
        path = script if Path(script).is_absolute() else EXAMPLES / script
        environment = {**os.environ, "PYTHONPATH": str(EXAMPLES)}
        self.process = subprocess.Popen(
            [sys.executable, path, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
            text=True, env=environment,
        )  # fmt: skip
        assert self.process.stdout.readline() == "ready\n", self.process.stderr.read()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.kill()
        self.process.communicate()


class Thread:
    """Runs a function of this object's sockets until the block ends; abstract. While `is_quiet`, it sends nothing."""

    is_quiet = False

    def __enter__(self):
        self.is_over = threading.Event()
        self.thread = threading.Thread(target=self.run, daemon=True)
        self.thread.start()
        return self

    def __exit__(self, *_):
        self.is_over.set()
        self.thread.join()
        self.close()


class JsonServant(Thread):
    """Answers states by numbered frames: one ArduPilot per port.

    Args:
        ports: Ports of the simulator.
        act: Returns the pulses for a packet with a state, or none for no answer; by default all are 1500 us.
        first: Number of the first frame.
    """

    def __init__(self, *ports, act=lambda port, data: [1500] * 16, first=1):
        self.act, self.states = act, {port: [] for port in ports}
        self.selector = selectors.DefaultSelector()
        self.frames = dict.fromkeys(ports, self.frame(first, [1000] * 16))
        self.numbers = dict.fromkeys(ports, first)
        for port in ports:
            made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            made.bind(("127.0.0.1", 0))
            made.settimeout(LONG)
            self.selector.register(made, selectors.EVENT_READ, port)

    @staticmethod
    def frame(number, pulses):
        magic = 18458 if len(pulses) == 16 else 29569
        return struct.pack(f"<HHI{len(pulses)}H", magic, 400, number, *pulses)

    def run(self):
        while not self.is_over.is_set():
            found = self.selector.select(0.02)
            for key, _ in found:
                data, _ = key.fileobj.recvfrom(65536)
                self.states[key.data].append(data)
                pulses = self.act(key.data, data)
                if pulses is not None and not self.is_quiet:
                    self.numbers[key.data] += 1
                    self.frames[key.data] = self.frame(self.numbers[key.data], pulses)
                    key.fileobj.sendto(self.frames[key.data], ("127.0.0.1", key.data))
            if not (found or self.is_quiet):  # as ArduPilot does after some seconds: the last frame again
                for key in self.selector.get_map().values():
                    key.fileobj.sendto(self.frames[key.data], ("127.0.0.1", key.data))

    def close(self):
        for key in [*self.selector.get_map().values()]:
            key.fileobj.close()
        self.selector.close()


class ScrimmageServant(Thread):
    """Answers each state at (port) by servo pulses to a port of the simulator: `ports` are pairs of both."""

    def __init__(self, *ports, act=lambda port, data: struct.pack("<16H", *[1500] * 16)):
        self.act, self.selector = act, selectors.DefaultSelector()
        self.states = {}
        for to, back in ports:
            made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            made.bind(("127.0.0.1", to))
            self.selector.register(made, selectors.EVENT_READ, back)
            self.states[back] = []

    def run(self):
        while not self.is_over.is_set():
            for key, _ in self.selector.select(0.02):
                data, _ = key.fileobj.recvfrom(65536)
                self.states[key.data].append(data)
                answer = self.act(key.data, data)
                if answer is not None and not self.is_quiet:
                    key.fileobj.sendto(answer, ("127.0.0.1", key.data))

    close = JsonServant.close


class Px4Crowd(Thread):
    """A PX4 for each of some ports, which connects again whenever the simulator has closed the connection."""

    def __init__(self, *ports):
        self.px4, self.free = example("px4_peer"), set(ports)
        self.selector = selectors.DefaultSelector()

    def run(self):
        while not self.is_over.is_set():
            for port in [*self.free]:
                made = socket.socket()
                if made.connect_ex(("127.0.0.1", port)):
                    made.close()
                else:
                    self.free.discard(port)
                    self.selector.register(made, selectors.EVENT_READ, (port, bytearray()))
            for key, _ in self.selector.select(0.005):
                if not self.served(key.fileobj, key.data[1]):
                    self.selector.unregister(key.fileobj)
                    key.fileobj.close()
                    self.free.add(key.data[0])

    def served(self, connection, received):
        try:
            data = connection.recv(65536)
            received += data
            for number, payload in self.px4.take_messages(received):
                if number == self.px4.HIL_SENSOR:
                    time_us = int.from_bytes(payload[:8].ljust(8, b"\0"), "little")
                    answer = self.px4.CONTROLS.pack(time_us, 1, *[0.5] * 16, 129)
                    connection.sendall(self.px4.packet(self.px4.HIL_CONTROLS, 0, answer))
        except OSError:
            return False
        return bool(data)

    close = JsonServant.close
