"""Mass, centre of gravity and inertia."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from tussle.aircraft.buoyancy import Bag, emit_gas_mass
from tussle.aircraft.code import Code
from tussle.aircraft.constants import POUND_PER_SLUG
from tussle.aircraft.equations import offer
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import given
from tussle.errors import clipped
from tussle.numeric import total

Inertia = tuple[float, float, float, float, float, float]
"""xx, yy, zz, xy, xz, yz elements of the inertia matrix [slug ft^2]."""
FORMS = ("tube", "cylinder", "sphere", "ball")


@dataclass(frozen=True)
class PointMass:
    """A mass at a place: weight [lb], place in the structural frame [in], inertia of its own per slug (x, y, z) [ft^2]."""

    weight: float
    location: tuple[float, float, float]
    own: tuple[float, float, float]


@dataclass(frozen=True)
class Mass:
    """Empty weight [lb], its centre [in], its inertia, and point masses."""

    empty_weight: float
    center: tuple[float, float, float]
    inertia: Inertia
    points: tuple[PointMass, ...]


def indexed(name: str, k: int) -> str:
    """Name of a property of the k-th of several; the first has no index."""
    return f"{name}[{k}]" if k else name


def read_mass(node: Element) -> Mass:
    """Read <mass_balance>.

    Raises:
        AircraftError: It has no positive weight, or something that is not supported.
    """
    center = next((each for each in node.find_all("location") if each.get("name") == "CG"), None)
    weight = node.value("emptywt", 0.0, "LBS")
    inertia = _inertia(node)
    points = []
    for each in node.find_all("pointmass"):
        points.append(_point(each))
        if each.find("form") is None:
            own = _inertia(each)
            inertia = tuple(a + b for a, b in zip(inertia, own, strict=True))  # type: ignore[assignment]
    if not weight + total(each.weight for each in points) > 0.0:
        raise node.error("the aircraft has no weight")
    return Mass(weight, center.vector("IN") if center else (0.0, 0.0, 0.0), inertia, tuple(points))


def _inertia(node: Element) -> Inertia:
    x, y, z, xy, xz, yz = (
        node.value(f"i{axes}", 0.0, "SLUG*FT2") for axes in ("xx", "yy", "zz", "xy", "xz", "yz")
    )
    if node.get("negated_crossproduct_inertia") == "false":
        xy, xz, yz = -xy, -xz, -yz
    return x, y, z, -xy, xz, -yz


def _point(node: Element) -> PointMass:
    weight, form = node.value("weight", 0.0, "LBS"), node.find("form")
    location = node.need("location").vector("IN")
    if form is None:
        return PointMass(weight, location, (0.0, 0.0, 0.0))
    r, length = form.value("radius", 0.0, "FT"), form.value("length", 0.0, "FT")
    match form.get("shape"):
        case "tube":
            own = r * r, (6.0 * r * r + length * length) / 12.0
        case "cylinder":
            own = r * r / 2.0, (3.0 * r * r + length * length) / 12.0
        case "sphere":
            own = r * r * 2.0 / 3.0, r * r * 2.0 / 3.0
        case "ball":
            own = r * r * 0.4, r * r * 0.4
        case shape:
            raise form.error(f"shape {clipped(shape)!r} is not known; there are: {', '.join(FORMS)}")
    return PointMass(weight, location, (own[0], own[1], own[1]))


def emit_mass(code: Code, mass: Mass, tanks: Any, cells: tuple[Bag, ...] = ()) -> None:
    """Emit weight, centre of gravity and inertia; `tanks` are those of the propulsion, `cells` those of gas."""
    parts: list[tuple[str, Sequence[str], Sequence[str] | None]]
    parts = [(repr(mass.empty_weight), list(map(repr, mass.center)), None)]
    for k, point in enumerate(mass.points):
        name = indexed("inertia/pointmass-weight-lbs", k)
        code.initial[name] = point.weight
        code.inputs.add(name)
        weight = code.read(name)
        own = [f"{weight} * {each / POUND_PER_SLUG!r}" for each in point.own]
        names = [indexed(f"inertia/pointmass-location-{axis}-inches", k) for axis in "XYZ"]
        location = [given(code, each, inches) for each, inches in zip(names, point.location, strict=True)]
        parts.append((weight, location, own if any(point.own) else None))
    fixed = len(parts)
    for tank in tanks:
        weight = code.read(tank.property)
        parts.append((weight, [code.short(each) for each in tank.place(weight)], tank.inertia(weight)))
    # JSBSim takes the arms of tanks from the last centre of gravity.
    last = [code.state(f"center of gravity {axis}") for axis in "xyz"]
    for axis, name in zip("xyz", last, strict=True):
        if tanks:
            code.line(f"last_{axis} = {name}")
    code.line("# Mass, centre of gravity [in], inertia with its signs.")
    gas, gas_moments, gas_inertia = emit_gas_mass(code, cells) if cells else ("", [], [])
    more = f" + {gas} * {POUND_PER_SLUG!r}" if cells else ""
    code.line(f"weight = {' + '.join(weight for weight, _, _ in parts)}{more}")
    code.line(f"mass = weight / {POUND_PER_SLUG!r}")
    for k, axis in enumerate("xyz"):
        moments = [f"{weight} * {place[k]}" for weight, place, _ in parts]
        if cells:
            moments.append(f"{gas_moments[k]} * {POUND_PER_SLUG!r}")
        code.line(f"cg_{axis} = ({' + '.join(moments)}) / weight")
    for axes, value in zip(("xx", "yy", "zz", "xy", "xz", "yz"), mass.inertia, strict=True):
        code.line(f"j{axes} = {value!r}")
    for k, (weight, (x, y, z), around) in enumerate(parts):
        center = "cg" if k < fixed else "last"
        code.lines(f"""
m = {weight} / {POUND_PER_SLUG!r}
arm_x = ({center}_x - ({x})) / 12.0
arm_y = (({y}) - {center}_y) / 12.0
arm_z = ({center}_z - ({z})) / 12.0
jxx += m * (arm_y * arm_y + arm_z * arm_z)
jyy += m * (arm_x * arm_x + arm_z * arm_z)
jzz += m * (arm_x * arm_x + arm_y * arm_y)
jxy -= m * arm_x * arm_y
jxz -= m * arm_x * arm_z
jyz -= m * arm_y * arm_z
""")
        for axes, more in zip(("xx", "yy", "zz"), around or (), strict=False):
            code.line(f"j{axes} += {more}")
    for axes, more in zip(("xx", "yy", "zz", "xy", "xz", "yz"), gas_inertia, strict=False):
        code.line(f"j{axes} += {more}")
    for axis, name in zip("xyz", last, strict=True):
        code.line(f"{name} = cg_{axis}")
    offer(code, {
        "inertia/weight-lbs": "weight", "inertia/mass-slugs": "mass", "inertia/cg-x-in": "cg_x", "inertia/cg-y-in": "cg_y",
        "inertia/cg-z-in": "cg_z", "inertia/ixx-slugs_ft2": "jxx", "inertia/iyy-slugs_ft2": "jyy", "inertia/izz-slugs_ft2": "jzz",
        "inertia/ixy-slugs_ft2": "-jxy", "inertia/ixz-slugs_ft2": "-jxz", "inertia/iyz-slugs_ft2": "-jyz",
        "inertia/empty-weight-lbs": repr(mass.empty_weight),
    })  # fmt: skip
