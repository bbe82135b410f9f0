"""The ROS node of this process: import of rospy, search for the master, start."""

from __future__ import annotations

import atexit
import importlib
import os
import re
import sys
import warnings
import xmlrpc.client
from functools import cache
from http.client import HTTPException
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from tussle.errors import MissingExtraError, ParameterError, RosError

DEBIAN = "/usr/lib/python3/dist-packages"
"""Folder in which Debian and Ubuntu install rospy."""
DEFAULT_URI = "http://localhost:11311"
MASTER_TIMEOUT = 2.0
"""Longest wait for an answer of the master [s]."""
MESSAGES = {
    "geometry_msgs.msg": "TransformStamped Twist TwistStamped",
    "nav_msgs.msg": "Odometry",
    "rosgraph_msgs.msg": "Clock",
    "sensor_msgs.msg": "Imu LaserScan MagneticField",
    "std_msgs.msg": "Float64MultiArray",
    "std_srvs.srv": "SetBool Trigger",
    "tf2_msgs.msg": "TFMessage",
    "visualization_msgs.msg": "Marker MarkerArray",
}
"""Module of ROS -> the types that are used."""
PACKAGES = "python3-rospy python3-nav-msgs python3-sensor-msgs python3-std-srvs python3-tf2-msgs python3-visualization-msgs"


class _Transport(xmlrpc.client.Transport):
    """Calls that end after a while."""

    def make_connection(self, host: Any) -> Any:
        """Open a connection."""
        connection = super().make_connection(host)
        connection.timeout = MASTER_TIMEOUT
        return connection


def master_uri() -> str:
    """Address of the ROS master, from the environment."""
    return os.environ.get("ROS_MASTER_URI") or DEFAULT_URI


def master_fault() -> str:
    """Why the ROS master does not answer; empty if it does."""
    try:
        with xmlrpc.client.ServerProxy(master_uri(), transport=_Transport()) as master:
            master.getPid("/tussle")
    except (OSError, HTTPException, xmlrpc.client.Error, ValueError) as error:
        return getattr(error, "strerror", None) or str(error) or type(error).__name__
    return ""


@cache
def load_rospy() -> SimpleNamespace:
    """Import rospy and the message types; `rospy`, `Time` and the types are attributes.

    Packages of Debian are found while rospy is imported only, and after those of this environment: `sys.path` is as before afterwards.

    Raises:
        MissingExtraError: They are not installed.
    """
    sys.path.append(DEBIAN)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            rospy = importlib.import_module("rospy")
            types = {
                name: getattr(importlib.import_module(module), name)
                for module, names in MESSAGES.items()
                for name in names.split()
            }
    except ImportError as error:
        raise MissingExtraError(
            f"ROS 1 needs rospy and its messages for Python {sys.version_info.major}.{sys.version_info.minor} ({error}): "
            f"apt-get install {PACKAGES}, or source the setup.bash of your ROS"
        ) from None
    finally:
        sys.path.remove(DEBIAN)
    return SimpleNamespace(rospy=rospy, Time=rospy.Time, **types)


def started_node() -> SimpleNamespace:
    """Start the node of this process unless it runs already, and return what `load_rospy` does.

    rospy allows one node per process, which cannot be started again; it ends with the process.

    Raises:
        MissingExtraError: rospy is not installed.
        RosError: The master does not answer.
    """
    ros = load_rospy()
    if fault := master_fault():
        raise RosError(
            f"no ROS master answers at {master_uri()} ({fault}); start roscore, or set ROS_MASTER_URI"
        )
    if not ros.rospy.core.is_initialized():
        config = "ROS_PYTHON_LOG_CONFIG_FILE"
        os.environ.setdefault(config, str(Path(__file__).with_name("logging.yaml")))
        # Anonymous, since the master ends a node when another one takes its name. Signals are handled by whoever runs the simulation.
        ros.rospy.init_node(
            "tussle",
            argv=["tussle"],
            anonymous=True,
            disable_signals=True,
            disable_rostime=True,
            disable_rosout=True,
        )
        atexit.register(ros.rospy.signal_shutdown, "the process ends")
    return ros


def checked_namespace(name: str) -> str:
    """Return the name of a namespace without outer slashes.

    Raises:
        ParameterError: It is no name of ROS.
    """
    if not re.fullmatch(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*/?", name, re.ASCII):
        raise ParameterError(
            f"{name!r} is no name of ROS; it takes letters, digits, _ and /, and begins with a letter"
        )
    return name.strip("/")
