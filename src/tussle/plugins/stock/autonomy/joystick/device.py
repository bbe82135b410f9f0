"""A joystick of the Linux kernel: a character device of events of eight bytes."""

from __future__ import annotations

import os
import struct

EVENT = struct.Struct("<IhBB")  # time [ms], value, type, number (linux/joystick.h)
BUTTON, AXIS, INITIAL = 1, 2, 0x80
MAX_EVENTS = 64  # per read


class JoystickDevice:
    """An opened joystick.

    Args:
        path: Device, such as /dev/input/js0.

    Attributes:
        axes: Number of an axis -> its last value.
        pressed: Numbers of the pressed buttons.

    Raises:
        OSError: The device cannot be opened.
    """

    def __init__(self, path: str) -> None:
        self.file = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
        self.axes: dict[int, int] = {}
        self.pressed: set[int] = set()

    def poll(self) -> None:
        """Read all events that have occurred.

        Raises:
            OSError: The device is gone.
        """
        while True:
            try:
                data = os.read(self.file, MAX_EVENTS * EVENT.size)
            except BlockingIOError:
                return
            for _, value, kind, number in EVENT.iter_unpack(data[: len(data) // EVENT.size * EVENT.size]):
                if kind & ~INITIAL == AXIS:
                    self.axes[number] = value
                elif kind & ~INITIAL == BUTTON:
                    (self.pressed.add if value else self.pressed.discard)(number)
            if len(data) < MAX_EVENTS * EVENT.size:
                return

    def close(self) -> None:
        """Close the device."""
        os.close(self.file)
