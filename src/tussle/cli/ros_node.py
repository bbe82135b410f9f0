"""`tussle ros-node`: an autonomy in a node of ROS 1, without a simulator."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle.cli.interrupt import Interrupt
from tussle.cli.options import check_positive, option, read_settings
from tussle.cli.terminal import out
from tussle.errors import MissionError


@dataclass(frozen=True, kw_only=True)
class RosNodeOptions:
    """Run an autonomy in a node of ROS 1: each odom of a robot is answered with a cmd_vel, until Ctrl-C."""

    plugin: str = option("NAME|FILE", "An autonomy, or a Python file that defines one.", default=...)
    namespace: str = option("NAME", "Namespace of odom and cmd_vel.", shows_default=True, default="entity1")
    dt: float = option("SECONDS", "Time between two odoms.", shows_default=True, default=0.1)
    seed: int = option("N", "Seed of its random numbers.", min=0, shows_default=True, default=1)
    settings: list[str] = option(
        "NAME=VALUE", "Set a parameter of the autonomy. Can be repeated.", "--set", default=list
    )

    def __post_init__(self) -> None:
        check_positive(dt=self.dt)
        read_settings(self.settings)


def ros_node(options: RosNodeOptions) -> int:
    """Answer odoms until a signal.

    Returns:
        The exit code.

    Raises:
        MissionError: There is no such autonomy.
        RosError: The master is not there or has gone.
    """
    from tussle.api import Autonomy
    from tussle.cli.bridges.ros_node import AutonomyHost, serve
    from tussle.mission import Catalogue
    from tussle.mission.plugin_files import load_plugin_file

    path = Path(options.plugin)
    cls: Any
    if path.suffix == ".py":
        found = [cls for cls in load_plugin_file(path).values() if issubclass(cls, Autonomy)]
        if len(found) != 1:
            raise MissionError(f"{path}: defines {len(found)} autonomies; --plugin takes a file with one")
        cls = found[0]
    else:
        cls = Catalogue().load(options.plugin)
        if not issubclass(cls, Autonomy):
            raise MissionError(f"{options.plugin} is no autonomy but a {cls.kind}")
    host = AutonomyHost(cls(**read_settings(options.settings)), options.dt, options.seed)
    with Interrupt() as interrupt:
        n = serve(host, options.namespace, lambda: bool(interrupt.code))
    out().print(f"answered {n} odoms")
    return interrupt.code
