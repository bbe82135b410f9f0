"""Tanks, and how engines drain them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from tussle.aircraft.code import Code, normal
from tussle.aircraft.constants import POUND_PER_SLUG
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import given, slot
from tussle.errors import clipped, listed, nearest_name

Vector = tuple[float, float, float]
KINDS = ("FUEL", "OXIDIZER")
DENSITIES = {
    "AVGAS": 6.02, "JET-A": 6.74, "JET-A1": 6.74, "JET-B": 6.48, "JP-1": 6.76, "JP-2": 6.38, "JP-3": 6.34, "JP-4": 6.48, "JP-5": 6.81,
    "JP-6": 6.55, "JP-7": 6.61, "JP-8": 6.66, "JP-8+100": 6.66, "RP-1": 6.73, "T-1": 6.88, "ETHANOL": 6.58, "HYDRAZINE": 8.61,
    "F-34": 6.66, "F-35": 6.74, "F-40": 6.48, "F-44": 6.81, "AVTAG": 6.48, "AVCAT": 6.81,
}  # [lb/gal]  # fmt: skip


@dataclass(frozen=True)
class SolidGrain:
    """Solid propellant: length and radius of its bore [in], density [slug/in^3]; without bore it burns at its end."""

    is_cylinder: bool
    length: float
    density: float


@dataclass(frozen=True)
class Tank:
    """A tank.

    Attributes:
        index: Its number, from 0.
        kind: FUEL or OXIDIZER.
        location: Its centre when full, in the structural frame [in].
        drain: Centre of the last of its contents [in].
        radius: Radius [in] of the sphere, or of the grain, that its inertia is that of.
        factor: Factor of the sphere's inertia.
        capacity: [lb]
        contents: At the start [lb].
        density: Of its contents [lb/gal].
        priority: Engines drain tanks of priority 1 first; 0 is not drained.
        grain: Solid propellant, or None.
    """

    index: int
    kind: str
    location: Vector
    drain: Vector
    radius: float
    factor: float
    capacity: float
    contents: float
    density: float
    priority: int
    grain: SolidGrain | None

    @property
    def property(self) -> str:
        """Name of the property of its contents [lb]."""
        return normal(f"propulsion/tank[{self.index}]/contents-lbs")

    def place(self, weight: str) -> tuple[str, str, str]:
        """Expressions of the centre of gravity of its contents [in], of which `weight` is the expression."""
        pairs = zip(self.drain, self.location, strict=True)
        x, y, z = (
            repr(end) if a == end else f"({a!r} + {weight} / {self.capacity!r} * {end - a!r})"
            for a, end in pairs
        )
        return x, y, z

    def inertia(self, weight: str) -> tuple[str, str, str] | None:
        """Expressions of the inertia of its contents about their centre [slug ft^2]; None if it is 0."""
        mass = f"{weight} / {POUND_PER_SLUG!r}"
        if self.grain is None:
            own = 0.4 * (self.radius / 12.0) ** 2 * self.factor
            return None if own == 0.0 else (f"{mass} * {own!r}",) * 3
        r2 = self.radius * self.radius
        if self.grain.is_cylinder:
            bore2 = f"({r2!r} - {mass} / {self.grain.density * math.pi * self.grain.length!r})"
            squares = f"({r2!r} + {bore2}) / 144.0"
            length2 = (self.grain.length / 12.0) ** 2
            across = f"{mass} * (3.0 * {squares} + {length2!r}) / 12.0"
            return f"0.5 * {mass} * {squares}", across, across
        length = f"({mass} / {self.grain.density * math.pi * r2!r})"
        across = f"{mass} * ({3.0 * r2!r} + {length} * {length}) / 1728.0"
        return f"0.5 * {mass} * {r2 / 144.0!r}", across, across


def read_tank(node: Element, index: int) -> Tank:
    """Read a <tank>.

    Raises:
        AircraftError: Its type is unknown, or it has a part that is not supported.
    """
    kind = node.get("type").upper()
    if kind not in KINDS:
        raise node.error(f"type {clipped(kind)!r} is not known{nearest_name(kind, KINDS)}; {listed(KINDS)}")
    for tag in ("unusable-volume",):
        if node.value(tag, 0.0):
            raise node.error(f"<{tag}> is not supported")
    location = node.need("location").vector("IN")
    drain = node.find("drain_location")
    capacity = node.value("capacity", 1e-5, "LBS") or 1e-5
    contents = min(node.value("contents", 0.0, "LBS"), capacity)
    radius = node.value("radius", 0.0, "IN")
    config = node.find("grain_config")
    grain = None if config is None else _grain(config, radius, contents)
    return Tank(
        index=index,
        kind=kind,
        location=location,
        drain=location if drain is None else drain.vector("IN"),
        radius=radius,
        factor=node.value("inertia_factor", 1.0),
        capacity=capacity,
        contents=contents,
        density=_density(node),
        priority=int(node.value("priority", 1.0)),
        grain=grain,
    )


def _density(node: Element) -> float:
    """Density of the contents [lb/gal]: that of a named fuel, or the number given."""
    kind = node.find("type")
    return node.value("density", 6.6, "LBS/GAL") if kind is None else DENSITIES.get(kind.text, 6.6)


def _grain(node: Element, radius: float, contents: float) -> SolidGrain:
    kind, length = node.get("type"), node.value("length", 0.0, "IN")
    bore = node.value("bore_diameter", 0.0, "IN") / 2.0
    if kind not in ("CYLINDRICAL", "ENDBURNING"):
        raise node.error(f"type {clipped(kind)!r} is not supported; there are: CYLINDRICAL, ENDBURNING")
    is_cylinder = kind == "CYLINDRICAL"
    volume = math.pi * length * (radius * radius - (bore * bore if is_cylinder else 0.0))
    if not volume > 0.0 or not contents > 0.0:
        raise node.error("the grain has no volume or no contents")
    return SolidGrain(is_cylinder, length, contents / POUND_PER_SLUG / volume)


# -- feed -------------------------------------------------------------------------------------------------------------------------


def count_fed(code: Code, tanks: Sequence[Tank], n_tanks: int, label: str) -> tuple[str, list[str]]:
    """Emit how many tanks feed an engine now: those with contents and the lowest priority.

    Returns:
        Variable of the count, and for each tank the condition that it feeds the engine.
    """
    contents = [code.read(tank.property) for tank in tanks]
    ranks = [given(code, f"propulsion/tank[{tank.index}]/priority", float(tank.priority)) for tank in tanks]
    fed, level = f"{label}_fed", f"{label}_level"
    if all(rank == "1.0" for rank in ranks):
        tests = [f"{each} > 0.0" for each in contents]
        code.line(f"{fed} = {' + '.join(['0', *(f'({test})' for test in tests)])}")
        return fed, tests
    tests = [f"{each} > 0.0 and {rank} == {level}" for each, rank in zip(contents, ranks, strict=True)]
    code.line(f"{level} = 1.0")
    code.line(f"{fed} = 0")
    with code.block(f"while {fed} == 0 and {level} <= {float(n_tanks)!r}"):
        code.line(f"{fed} = {' + '.join(['0', *(f'({test})' for test in tests)])}")
        with code.block(f"if {fed} == 0"):
            code.line(f"{level} += 1.0")
    return fed, tests


def drain(code: Code, tanks: Sequence[Tank], tests: Sequence[str], need: str, fed: str) -> None:
    """Emit the shares of the tanks in an engine's need [lb]."""
    for tank, test in zip(tanks, tests, strict=True):
        contents = slot(code, tank.property, tank.contents)
        with code.block(f"if {test}"):
            code.line(f"{contents} = max({contents} - {need} / {fed}, 0.0)")


def emit_flows(code: Code, tanks: Sequence[Tank]) -> None:
    """Emit flows from outside into tanks, and totals."""
    for tank in tanks:
        flow = given(code, f"propulsion/tank[{tank.index}]/external-flow-rate-pps", 0.0)
        contents = slot(code, tank.property, tank.contents)
        if flow != "0.0":
            code.line(f"{contents} = min(max({contents} + {flow} * dt, 0.0), {tank.capacity!r})")
        code.write(f"propulsion/tank[{tank.index}]/pct-full", f"100.0 * {contents} / {tank.capacity!r}")
    for kind, name in zip(KINDS, ("propulsion/total-fuel-lbs", "propulsion/total-oxidizer-lbs"), strict=True):
        contents_of = [code.read(tank.property) for tank in tanks if tank.kind == kind]
        code.write(name, " + ".join(contents_of) or "0.0")
