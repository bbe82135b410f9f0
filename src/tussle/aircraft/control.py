"""Flight control, systems and autopilots: channels of components, emitted in order."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import nullcontext

from tussle.aircraft.code import Code
from tussle.aircraft.components import COMPONENTS, IGNORED, ControlPart
from tussle.aircraft.functions import emit_function
from tussle.aircraft.mass import indexed
from tussle.aircraft.node import Element
from tussle.errors import listed, nearest_name

Find = Callable[[Element, str, str], Element]
PASSED = {"throttle": 0.0, "mixture": 0.0, "advance": 0.0, "feather": 0.0}
"""Commands of each engine that become positions unchanged, and their first values."""
COMMANDS = (
    "aileron", "elevator", "rudder", "flap", "speedbrake", "spoiler", "pitch-trim", "roll-trim", "yaw-trim", "steer",
)  # fmt: skip
SURFACES = ("elevator", "left-aileron", "right-aileron", "rudder", "flap", "speedbrake", "spoiler")


def offer_commands(code: Code, n_engines: int) -> None:
    """Declare the commands and stored positions that JSBSim itself has, with their first values."""
    for name in COMMANDS:
        code.inputs.add(f"fcs/{name}-cmd-norm")
    code.inputs.add("simulation/randomseed")
    for side in ("left", "right", "center"):
        code.inputs.add(f"fcs/{side}-brake-cmd-norm")
    for name in SURFACES:
        for unit in ("rad", "deg", "norm"):
            code.initial.setdefault(f"fcs/{name}-pos-{unit}", 0.0)
        code.initial.setdefault(f"fcs/mag-{name}-pos-rad", 0.0)
    for name, value in {"gear/gear-cmd-norm": 1.0, "gear/gear-pos-norm": 1.0, "gear/tailhook-pos-norm": 0.0,
                        "fcs/wing-fold-pos-norm": 0.0, "fcs/steer-pos-deg": 0.0}.items():  # fmt: skip
        code.initial.setdefault(name, value)
        code.inputs.add(name)
    for k in range(n_engines):
        for name, value in PASSED.items():
            command = indexed(f"fcs/{name}-cmd-norm", k)
            code.initial.setdefault(command, value)
            code.inputs.add(command)


def emit_control(code: Code, aircraft: Element, find: Find, n_engines: int) -> None:
    """Emit all systems, autopilots and the flight control of an aircraft.

    Raises:
        AircraftError: A component is not supported or invalid.
    """
    for k in range(n_engines):
        for name in PASSED:
            code.write(indexed(f"fcs/{name}-pos-norm", k), code.read(indexed(f"fcs/{name}-cmd-norm", k)))
    channels: list[Element] = []
    before: list[Element] = []
    after: list[Element] = []
    for tag in ("system", "autopilot", "flight_control"):
        for node in aircraft.find_all(tag):
            for part in (find(node, node.get("file"), "system"), node) if node.get("file") else (node,):
                for each in part:
                    if each.tag == "property":
                        declare(code, each)
                    elif each.tag == "function":
                        (after if each.get("type") == "post" else before).append(each)
                    elif each.tag == "channel":
                        channels.append(each)
                    elif each.tag not in IGNORED:
                        raise each.error(
                            "it is not supported in a system; there are: channel, function, property"
                        )
    for each in before:
        emit_function(code, each)
    for channel in channels:
        for each in channel:
            if each.tag == "property":
                declare(code, each)
        _emit_channel(code, channel)
    for each in after:
        emit_function(code, each)


def declare(code: Code, node: Element) -> None:
    """Declare a <property> of the aircraft, which may be set from outside."""
    name = node.text.removeprefix("-")
    code.initial[name.replace("[0]", "")] = node.attribute_number("value", 0.0)
    code.inputs.add(name.replace("[0]", ""))


def _emit_channel(code: Code, channel: Element) -> None:
    rate = max(1, int(channel.attribute_number("execrate", 1.0)))
    conditions = []
    if channel.get("execute"):
        conditions.append(f"{code.read(channel.get('execute'), channel)} != 0.0")
    if rate > 1:
        count = code.state("frames", float(rate))
        with code.block("if dt != 0.0"):
            code.line(f"{count} = 1.0 if {count} >= {rate}.0 else {count} + 1.0")
        conditions.append(f"{count} >= {rate}.0")
    code.line(f"# Channel {channel.get('name')[:60]!a}")
    with code.block(f"if {' and '.join(conditions)}") if conditions else nullcontext():
        for each in channel:
            if each.tag in IGNORED or each.tag == "property":
                continue
            if each.tag not in COMPONENTS:
                raise each.error(
                    f"component not supported{nearest_name(each.tag, COMPONENTS)}; {listed(COMPONENTS)}"
                )
            ControlPart(code, each, rate).emit()
