"""Components of flight control, each as the lines that compute its output from its inputs."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from itertools import pairwise

from tussle.aircraft.code import Code
from tussle.aircraft.functions import expression, only, table
from tussle.aircraft.node import Element
from tussle.errors import clipped, listed

IGNORED = ("description", "documentation", "limitation", "output")
OPERATORS = {"eq": "==", "==": "==", "ne": "!=", "!=": "!=", "gt": ">", ">": ">", "ge": ">=", ">=": ">=", "lt": "<", "<": "<",
             "le": "<=", "<=": "<="}  # fmt: skip
MAX_DELAY, MAX_STEP_RATE = 10_000, 240
INTEGRALS = {
    "rect": "{x}", "trap": "0.5 * ({x} + {x1})", "ab2": "1.5 * {x} - 0.5 * {x1}", "ab3": "(23.0 * {x} - 16.0 * {x1} + 5.0 * {x2}) / 12.0",
}  # fmt: skip
EARTH = {"FT": 21144000.0, "M": 21144000.0 * 0.3048}
"""Radius that JSBSim's waypoints use by default."""


def property_of(node: Element) -> str:
    """The property of a component's name."""
    name = node.get("name")
    if not name:
        raise node.error("a component needs a name")
    return name if "/" in name else "fcs/" + re.sub(r"[ \\]", "-", name).lower()


class ControlPart:
    """One component.

    Args:
        code: Where it is emitted.
        node: Its element.
        rate: Frames per run of its channel; the time step of its dynamics is as many frames.
    """

    def __init__(self, code: Code, node: Element, rate: int = 1) -> None:
        self.code, self.node = code, node
        self.name = property_of(node)
        self.dt = "frozen_dt" if rate == 1 else f"({rate}.0 * frozen_dt)"
        self.inputs = [code.value(each.text, each) for each in node.find_all("input")]

    @property
    def input(self) -> str:
        """The first input.

        Raises:
            AircraftError: There is none.
        """
        if not self.inputs:
            raise self.node.error("it needs an <input>")
        return self.inputs[0]

    def parameter(self, tag: str, default: str = "") -> str:
        """The expression of a number or property in a child.

        Raises:
            AircraftError: There is none, and no default.
        """
        found = self.node.find(tag)
        if found is None:
            return default or repr(self.node.need(tag).number())
        return self.code.value(found.text, found)

    def state(self, what: str, initial: float = 0.0) -> str:
        """A piece of state of this component."""
        return self.code.state(f"{self.name}/{what}", initial)

    def emit(self) -> None:
        """Emit it: its output, delay, limits, and the properties that take it."""
        node, code = self.node, self.code
        result = COMPONENTS[node.tag](self)
        out = code.temporary(result)
        if node.tag not in ("actuator", "sensor"):
            self.delay(out)
        self.clip(out)
        for each in node.find_all("output"):
            sign = "-" if each.text.startswith("-") else ""
            code.write(each.text.removeprefix("-"), sign + out)
        code.write(self.name, out)

    def delay(self, out: str) -> None:
        """Emit a delay by whole frames."""
        found = self.node.find("delay")
        if found is None:
            return
        amount, code = found.number(), self.code
        is_time = found.get("type", "time") != "frames"
        most = amount * MAX_STEP_RATE if is_time else amount
        if not 0.0 <= most <= MAX_DELAY:
            raise found.error(
                f"a delay of {amount:g} is not allowed; it is at most {MAX_DELAY} frames of 1/{MAX_STEP_RATE} s"
            )
        # JSBSim's ring of n outputs delays by n - 1 frames.
        ring, place = code.ring(int(most) + 2), self.state("delay")
        n = code.temporary(
            f"min(math.floor({amount!r} / {self.dt}), {int(most)}.0)"
            if is_time
            else f"{float(int(amount))!r}"
        )
        with code.block(f"if {n} > 0.0"):
            code.line(f"x[{ring} + int({place}), row] = {out}")
            code.line(f"{place} = 0.0 if {place} >= {n} - 1.0 else {place} + 1.0")
            code.line(f"{out} = x[{ring} + int({place}), row]")

    def clip(self, out: str) -> None:
        """Emit the limits."""
        found = self.node.find("clipto")
        if found is None:
            return
        low, high = (self.code.value(each.text, each) for each in (found.need("min"), found.need("max")))
        if found.get("type") == "cyclic":
            self.code.line(f"{out} = remainder({out} - {low}, {high} - {low}) + {low}")
            with self.code.block(f"if {out} < {low}"):
                self.code.line(f"{out} += {high} - {low}")
        else:
            self.code.line(f"{out} = min(max({out}, {low}), {high})")

    # -- one for each tag -----------------------------------------------------------------------------------------------------

    def summer(self) -> str:
        bias = self.node.find("bias")
        return " + ".join([*self.inputs, *([repr(bias.number())] if bias else [])]) or "0.0"

    def pure_gain(self) -> str:
        return f"{self.parameter('gain', '1.0')} * {self.input}"

    def scheduled_gain(self) -> str:
        return f"{self.parameter('gain', '1.0')} * {table(self.code, self.node.need('table'))} * {self.input}"

    def aerosurface_scale(self) -> str:
        domain, limits = self.node.find("domain"), self.node.need("range")
        low, high = (domain.value("min", -1.0), domain.value("max", 1.0)) if domain else (-1.0, 1.0)
        least, most = limits.value("min", 0.0), limits.value("max", 0.0)
        centered, gain = self.node.find("zero_centered"), self.parameter("gain", "1.0")
        if centered is not None and centered.text in ("0", "false"):
            if high == low:
                raise self.node.error("its domain is empty")
            return f"({least!r} + (({self.input} - {low!r}) / {high - low!r}) * {most - least!r}) * {gain}"
        x = self.code.temporary(self.input)
        above = f"{x} / {high!r} * {most!r}" if high else "0.0"
        below = f"{x} / {low!r} * {least!r}" if low else "0.0"
        return f"({above} if {x} > 0.0 else {below}) * {gain}"

    def kinematic(self) -> str:
        settings = self.node.need("traverse").find_all("setting")
        places = [each.need("position").number() for each in settings]
        times = [each.need("time").number() for each in settings]
        if len(places) < 2 or any(not a <= b for a, b in pairwise(places)):
            raise self.node.error("a traverse needs two or more settings with positions that do not fall")
        scale = "" if self.node.find("noscale") is not None else f" * {places[-1]!r}"
        outputs = self.node.find_all("output")
        now = self.code.read(outputs[0].text if outputs else self.name, self.node)
        at = self.code.constant(places + times)
        self.code.initial.setdefault(self.name, 0.0)
        for each in outputs:
            self.code.initial.setdefault(each.text, 0.0)
        return f"kinematic({self.input}{scale}, {now}, {self.dt}, tables, {at}, {len(places)})"

    def fcs_function(self) -> str:
        value = expression(self.code, only(self.node.need("function")))
        return f"{value} * {self.inputs[0]}" if self.inputs else value

    def _filter(self, formula: Callable[[str, str, str], str]) -> str:
        """A filter of first order: output from input, last input and last output; as in JSBSim, its first run ignores the input."""
        code = self.code
        x, y = code.temporary(self.input), code.temporary("0.0")
        x1, y1, begun = (self.state(each) for each in ("input", "output", "begun"))
        with code.block(f"if {begun} != 0.0"):
            code.line(f"{y} = {formula(x, x1, y1)}")
            code.line(f"{x1} = {x}")
            code.line(f"{y1} = {y}")
        code.line(f"{begun} = 1.0")
        return y

    def lag_filter(self) -> str:
        c, dt = self.code.short(self.parameter("c1")), self.dt
        return self._filter(lambda x, x1, y1: lag(x, x1, y1, c, dt))

    def washout_filter(self) -> str:
        c, dt = self.parameter("c1"), self.dt
        return self._filter(
            lambda x, x1, y1: (
                f"({x} - {x1}) * (2.0 / (2.0 + {dt} * {c})) + {y1} * ((2.0 - {dt} * {c}) / (2.0 + {dt} * {c}))"
            )
        )

    def lead_lag_filter(self) -> str:
        a, b, c, d = (self.parameter(f"c{k}") for k in (1, 2, 3, 4))
        dt = self.dt
        return self._filter(
            lambda x, x1, y1: (
                f"({x} * (2.0 * {a} + {dt} * {b}) + {x1} * ({dt} * {b} - 2.0 * {a})"
                f" + {y1} * (2.0 * {c} - {dt} * {d})) / (2.0 * {c} + {dt} * {d})"
            )
        )

    def second_order_filter(self) -> str:
        code, dt = self.code, self.dt
        a, b, c, d, e, f = (self.parameter(f"c{k}") for k in range(1, 7))
        x, y = code.temporary(self.input), code.temporary("0.0")
        x1, x2, y1, y2, begun = (
            self.state(each) for each in ("input", "input before", "output", "output before", "begun")
        )
        with code.block(f"if {begun} != 0.0"):
            scale = code.temporary(f"4.0 * {d} + 2.0 * {e} * {dt} + {f} * {dt} * {dt}")
            code.line(
                f"{y} = ({x} * (4.0 * {a} + 2.0 * {b} * {dt} + {c} * {dt} * {dt}) + {x1} * (2.0 * {c} * {dt} * {dt} - 8.0 * {a})"
                f" + {x2} * (4.0 * {a} - 2.0 * {b} * {dt} + {c} * {dt} * {dt}) - {y1} * (2.0 * {f} * {dt} * {dt} - 8.0 * {d})"
                f" - {y2} * (4.0 * {d} - 2.0 * {e} * {dt} + {f} * {dt} * {dt})) / {scale}"
            )
            for line in (f"{y2} = {y1}", f"{y1} = {y}", f"{x2} = {x1}", f"{x1} = {x}"):
                code.line(line)
        code.line(f"{begun} = 1.0")
        return y

    def pid(self) -> str:
        code, dt = self.code, self.dt
        x, x1, x2, total = (
            code.temporary(self.input),
            self.state("input"),
            self.state("input before"),
            self.state("integral"),
        )
        is_pid = self.node.tag == "pid"
        kp = self.parameter("kp", "0.0") if is_pid else "0.0"
        kd = self.parameter("kd", "0.0") if is_pid else "0.0"
        gain = self.node.find("ki" if is_pid else "c1")
        ki = code.value(gain.text, gain) if gain is not None else "0.0"
        kind = (gain.get("type") if gain is not None else "") or "ab2"
        if kind not in INTEGRALS:
            raise self.node.error(f"integration {clipped(kind)!r} is not known; {listed(INTEGRALS)}")
        dot = self.node.find("pvdot")
        rate = code.value(dot.text, dot) if dot is not None else f"({x} - {x1}) / {dt}"
        trigger = self.parameter("trigger", "0.0")
        test = code.temporary(trigger)
        with code.block(f"if abs({test}) < 0.000001"):
            code.line(f"{total} += {ki} * {dt} * ({INTEGRALS[kind].format(x=x, x1=x1, x2=x2)})")
        with code.block(f"if {test} < 0.0"):
            code.line(f"{total} = 0.0")
        if self.node.get("type") == "standard":
            y = code.temporary(f"{kp} * ({x} + {total} + {kd} * ({rate}))")
        else:
            y = code.temporary(f"{kp} * {x} + {total} + {kd} * ({rate})")
        code.line(f"{x2} = 0.0 if {test} < 0.0 else {x1}")
        code.line(f"{x1} = {x}")
        return y

    def deadband(self) -> str:
        half, gain = self.code.temporary(f"0.5 * {self.parameter('width')}"), self.parameter("gain", "1.0")
        x = self.code.temporary(self.input)
        return f"({x} + {half}) * {gain} if {x} < -{half} else (({x} - {half}) * {gain} if {x} > {half} else 0.0)"

    def switch(self) -> str:
        code = self.code
        default = self.node.find("default")
        y = code.temporary(code.value(default.get("value"), default) if default is not None else "0.0")
        for k, test in enumerate(self.node.find_all("test")):
            value = code.value(test.get("value"), test)
            with code.block(f"{'elif' if k else 'if'} {condition(code, test)}"):
                code.line(f"{y} = {value}")
        return y

    def actuator(self) -> str:
        code = self.code
        y, begun = code.temporary(self.input), self.state("begun")
        slow = self.node.find("lag")
        if slow is not None:
            c = code.value(slow.text, slow)
            x, x1, y1 = code.temporary(y), self.state("lag input"), self.state("lag output")
            with code.block(f"if {begun} != 0.0"):
                code.line(f"{y} = {lag(x, x1, y1, c, self.dt)}")
            code.line(f"{x1} = {x}")
            code.line(f"{y1} = {y}")
        self._limit_rate(y, begun)
        width = self.node.find("deadband_width")
        if width is not None:
            half = 0.5 * width.number()
            code.line(
                f"{y} = {y} + {half!r} if {y} < {-half!r} else ({y} - {half!r} if {y} > {half!r} else 0.0)"
            )
        play = self.node.find("hysteresis_width")
        if play is not None:
            half, y1 = 0.5 * play.number(), self.state("hysteresis")
            with code.block(f"if {begun} != 0.0"):
                code.line(
                    f"{y} = max({y1}, {y} - {half!r}) if {y} > {y1} else (min({y1}, {y} + {half!r}) if {y} < {y1} else {y})"
                )
            code.line(f"{y1} = {y}")
        bias = self.node.find("bias")
        if bias is not None:
            code.line(f"{y} += {bias.number()!r}")
        self.delay(y)
        code.line(f"{begun} = 1.0")
        return y

    def _limit_rate(self, y: str, begun: str) -> None:
        code, limits = self.code, self.node.find_all("rate_limit")
        if not limits:
            return
        y1 = self.state("rate limit")
        change = code.temporary(f"{y} - {y1}")
        with code.block(f"if {begun} != 0.0"):
            for each in limits:
                rate, sense = code.value(each.text, each), each.get("sense")[:4]
                if sense != "decr":
                    with code.block(f"if {change} > {self.dt} * {rate}"):
                        code.line(f"{y} = {y1} + {rate} * {self.dt}")
                if sense != "incr":
                    with code.block(f"if {change} < -{self.dt} * {rate}"):
                        code.line(f"{y} = {y1} - {rate} * {self.dt}")
        code.line(f"{y1} = {y}")

    def sensor(self) -> str:
        code = self.code
        y = code.temporary(self.input)
        slow = self.node.find("lag")
        if slow is not None:
            c, x = code.value(slow.text, slow), code.temporary(y)
            x1, y1 = self.state("input"), self.state("output")
            code.line(f"{y} = {lag(x, x1, y1, c, self.dt)}")
            code.line(f"{x1} = {x}")
            code.line(f"{y1} = {y}")
        noise, drift = self.node.find("noise"), self.node.find("drift_rate")
        if noise is not None:
            draws = self.state("draws")
            call = "noise_uniform" if noise.get("distribution") == "UNIFORM" else "noise_normal"
            seed = code.read("simulation/randomseed")
            value = code.temporary(f"{noise.number()!r} * {call}({seed}, {draws}, {len(code.names)})")
            code.line(f"{draws} += 1.0")
            code.line(f"{y} += {value}" if noise.get("variation") == "ABSOLUTE" else f"{y} *= 1.0 + {value}")
        if drift is not None:
            drifted = self.state("drift")
            code.line(f"{drifted} += {drift.number()!r} * {self.dt}")
            code.line(f"{y} += {drifted}")
        gain, bias, grain = self.node.find("gain"), self.node.find("bias"), self.node.find("quantization")
        if gain is not None:
            code.line(f"{y} *= {gain.number()!r}")
        if bias is not None:
            code.line(f"{y} += {bias.number()!r}")
        self.delay(y)
        if grain is not None:
            low, high, bits = grain.value("min", 0.0), grain.value("max", 0.0), grain.value("bits", 0.0)
            if not (1 <= bits <= 60 and low < high):
                raise grain.error("it needs bits from 1 to 60 and min < max")
            step = (high - low) / 2.0**bits
            code.line(
                f"{y} = math.floor((min(max({y}, {low!r}), {high!r}) - {low!r}) / {step!r}) * {step!r} + {low!r}"
            )
        return y

    def angle(self) -> str:
        code, factors = self.code, []
        for tag in ("source_angle", "target_angle"):
            each = self.node.need(tag)
            scale = math.pi / 180.0 if each.get("unit").upper() == "DEG" else 1.0
            factors.append(code.temporary(f"{code.value(each.text, each)} * {scale!r}"))
        source, target = factors
        cosine = f"cos({source}) * cos({target}) + sin({source}) * sin({target})"
        size = code.temporary(f"acos(min(max({cosine}, -1.0), 1.0))")
        y = f"{size} if cos({source}) * sin({target}) >= cos({target}) * sin({source}) else -{size}"
        return f"({y}) * {180.0 / math.pi!r}" if self.node.get("unit").upper() == "DEG" else f"({y})"

    def _places(self) -> tuple[str, str, str, str]:
        """Latitudes and longitudes of target and source [rad]."""
        found = []
        for tag in ("target_latitude", "target_longitude", "source_latitude", "source_longitude"):
            each = self.node.need(tag)
            factor = math.pi / 180.0 if each.get("unit").upper() == "DEG" else 1.0
            found.append(self.code.temporary(f"{self.code.value(each.text, each)} * {factor!r}"))
        return found[0], found[1], found[2], found[3]

    def waypoint_heading(self) -> str:
        code = self.code
        lat, lon, lat0, lon0 = self._places()
        y = f"sin({lon} - {lon0}) * cos({lat})"
        x = f"cos({lat0}) * sin({lat}) - sin({lat0}) * cos({lat}) * cos({lon} - {lon0})"
        heading = code.temporary(f"heading({y}, {x})")
        return f"{heading} * {180.0 / math.pi!r}" if self.node.get("unit").upper() == "DEG" else heading

    def waypoint_distance(self) -> str:
        code = self.code
        lat, lon, lat0, lon0 = self._places()
        unit = self.node.get("unit").upper() or "FT"
        radius = self.node.value("radius", EARTH.get(unit, EARTH["FT"]))
        a = code.temporary(f"sin(0.5 * ({lat} - {lat0}))")
        b = code.temporary(f"sin(0.5 * ({lon} - {lon0}))")
        h = code.temporary(f"{a} * {a} + cos({lat}) * cos({lat0}) * {b} * {b}")
        return f"{2.0 * radius!r} * atan2(math.sqrt({h}), math.sqrt(1.0 - {h}))"


def lag(x: str, x1: str, y1: str, c: str, dt: str) -> str:
    """A lag c / (s + c) by Tustin's rule: output from input, last input and last output."""
    return (
        f"({x} + {x1}) * ({dt} * {c} / (2.0 + {dt} * {c})) + {y1} * ((2.0 - {dt} * {c}) / (2.0 + {dt} * {c}))"
    )


def condition(code: Code, node: Element) -> str:
    """Expression of a <test>: lines `property operator value`, and tests in it.

    Raises:
        AircraftError: A line is not understood.
    """
    logic = f" {(node.get('logic') or 'and').lower()} "
    if logic not in (" and ", " or "):
        raise node.error(f"logic {clipped(logic.strip())!r} is not known; there are: AND, OR")
    parts = []
    for line in filter(None, (line.strip() for chunk in node.chunks for line in chunk.splitlines())):
        words = line.split()
        if len(words) != 3 or words[1].lower() not in OPERATORS:
            raise node.error(
                f"{clipped(line)!r} is no condition: property, operator, value; {listed(OPERATORS)}"
            )
        parts.append(
            f"{code.value(words[0], node)} {OPERATORS[words[1].lower()]} {code.value(words[2], node)}"
        )
    parts += [f"({condition(code, each)})" for each in node.find_all("test", "condition")]
    if not parts:
        raise node.error("it has no condition")
    return logic.join(parts)


COMPONENTS: dict[str, Callable[[ControlPart], str]] = {
    "summer": ControlPart.summer, "pure_gain": ControlPart.pure_gain, "scheduled_gain": ControlPart.scheduled_gain,
    "aerosurface_scale": ControlPart.aerosurface_scale, "kinematic": ControlPart.kinematic, "kinemat": ControlPart.kinematic,
    "fcs_function": ControlPart.fcs_function, "lag_filter": ControlPart.lag_filter, "washout_filter": ControlPart.washout_filter,
    "lead_lag_filter": ControlPart.lead_lag_filter, "second_order_filter": ControlPart.second_order_filter, "pid": ControlPart.pid,
    "integrator": ControlPart.pid, "deadband": ControlPart.deadband, "switch": ControlPart.switch, "actuator": ControlPart.actuator,
    "sensor": ControlPart.sensor, "angle": ControlPart.angle, "waypoint_heading": ControlPart.waypoint_heading,
    "waypoint_distance": ControlPart.waypoint_distance,
}  # fmt: skip
