"""The message mavros_msgs/Altitude, which Debian and Ubuntu do not package."""

from __future__ import annotations

import importlib
import sys
from functools import cache
from typing import Any

from tussle.plugins.links.ros.node import load_rospy

ALTITUDE = "mavros_msgs/Altitude"
FIELDS = "monotonic amsl local relative terrain bottom_clearance"
"""Fields [m], of MAVLink's message ALTITUDE (https://mavlink.io/en/messages/common.html#ALTITUDE)."""


@cache
def altitude_type() -> Any:
    """The type, made from its definition: nodes that have it from MAVROS receive it as theirs.

    Raises:
        MissingExtraError: rospy is not installed.
    """
    load_rospy()
    before = list(sys.path)  # genpy adds a temporary folder
    try:
        dynamic = importlib.import_module("genpy.dynamic")
        lines = [
            "std_msgs/Header header",
            *(f"float32 {name}" for name in FIELDS.split()),
            "=" * 80,
            "MSG: std_msgs/Header",
            "uint32 seq",
            "time stamp",
            "string frame_id",
        ]
        return dynamic.generate_dynamic(ALTITUDE, "\n".join(lines) + "\n")[ALTITUDE]
    finally:
        sys.path[:] = before
