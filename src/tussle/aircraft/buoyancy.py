"""Gas cells with ballonets, which carry airships and balloons."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.code import Code, normal
from tussle.aircraft.constants import SEA_LEVEL_PRESSURE, TEMPERATURES
from tussle.aircraft.functions import content, emit_function, expression
from tussle.aircraft.node import Element
from tussle.errors import clipped, listed, nearest_name
from tussle.numeric import total

GAS_CONSTANT = 3.4071  # [ft lbf/mol/R]
AIR = 0.0019186  # [slug/mol]
# Molar mass [slug/mol], heat capacity over the gas constant.
GASES = {"HYDROGEN": (0.00013841, 2.5), "HELIUM": (0.00027409, 1.5), "AIR": (AIR, 2.5)}
MOMENTS = ("x", "y", "z")
INERTIA = ("xx", "yy", "zz", "xy", "xz", "yz")


@dataclass(frozen=True)
class Bag:
    """A bag of gas.

    Attributes:
        node: Its element, for its functions.
        name: Beginning of the names of its properties.
        gas: Molar mass [slug/mol], heat capacity over the gas constant.
        location: Its centre in the structural frame [in].
        volume: At most [ft^3].
        height: [ft]
        overpressure: At which it vents [lbf/ft^2].
        valve: Flow [ft^4 s/slug].
        contents: At the start [mol].
        own: Its inertia over its mass [ft^2].
        ballonets: Bags of air in it.
    """

    node: Element
    name: str
    gas: tuple[float, float]
    location: tuple[float, float, float]
    volume: float
    height: float
    overpressure: float
    valve: float
    contents: float
    own: tuple[float, float, float]
    ballonets: tuple[Bag, ...]

    def slot(self, code: Code, leaf: str, initial: float) -> str:
        """Variable of a property of the bag that survives the step."""
        name = normal(f"{self.name}/{leaf}")
        code.initial.setdefault(name, initial)
        code.section.touched[name] = None
        return code.read(name)

    def variables(self, code: Code) -> tuple[str, str, str, str]:
        """Variables of contents [mol], temperature [R], pressure [lbf/ft^2] and volume [ft^3]."""
        full = self.contents * GAS_CONSTANT * TEMPERATURES[0] / SEA_LEVEL_PRESSURE
        return (
            self.slot(code, "contents-mol", self.contents),
            self.slot(code, "temp-R", TEMPERATURES[0]),
            self.slot(code, "pressure-psf", SEA_LEVEL_PRESSURE),
            self.slot(code, "volume-ft3", full),
        )

    def valve_open(self, code: Code) -> str:
        """Variable of the opening of its valve."""
        code.inputs.add(normal(f"{self.name}/valve_open"))
        return self.slot(code, "valve_open", 0.0)

    def state(self, code: Code, label: str) -> str:
        """Variable of other state of the bag."""
        name = f"state/{self.name} {label}"
        code.initial.setdefault(name, 0.0)
        return code.read(name)

    def emit_heat(self, code: Code) -> str:
        """Emit the functions of its heat. Return the heat flow [ft lbf/s]; "" if it has none."""
        heat = self.node.find("heat")
        return (
            " + ".join(emit_function(code, each) for each in heat.find_all("function"))
            if heat is not None
            else ""
        )


def read_bag(node: Element, name: str, ballonets: bool = True) -> Bag:
    """Read a <gas_cell>, or a <ballonet> in one.

    Raises:
        AircraftError: Its gas or its shape is not supported.
    """
    kind = node.get("type").upper() if ballonets else "AIR"
    if kind not in GASES:
        raise node.error(f"type {clipped(kind)!r} is not known{nearest_name(kind, GASES)}; {listed(GASES)}")
    rx, ry, rz = (node.value(f"{axis}_radius", 0.0, "FT") for axis in "xyz")
    wx, wy, wz = (node.value(f"{axis}_width", 0.0, "FT") for axis in "xyz")
    if rx > 0.0 and ry > 0.0 and rz > 0.0 and wx == wy == wz == 0.0:
        volume = 4.0 * math.pi * rx * ry * rz / 3.0
        own = (ry * ry + rz * rz) / 5.0, (rx * rx + rz * rz) / 5.0, (rx * rx + ry * ry) / 5.0
    elif rx == 0.0 and ry > 0.0 and rz > 0.0 and wx > 0.0 and wy == wz == 0.0:
        volume = math.pi * ry * rz * wx
        across = ry * rz / 4.0 + wx * wx / 12.0
        own = ry * rz / 2.0, across, across
    else:
        raise node.error(
            "its shape is not supported; there are: three radii, or x_width, y_radius and z_radius"
        )
    overpressure = node.value("max_overpressure", 0.0, "LBS/FT2")
    full = SEA_LEVEL_PRESSURE * volume / (GAS_CONSTANT * TEMPERATURES[0])
    most = (SEA_LEVEL_PRESSURE + overpressure) / SEA_LEVEL_PRESSURE
    share = node.value("fullness", 1.0) or 1.0
    return Bag(
        node=node,
        name=normal(name),
        gas=GASES[kind],
        location=node.need("location").vector("IN"),
        volume=volume,
        height=2.0 * rz + wz,
        overpressure=overpressure,
        valve=max(node.value("valve_coefficient", 0.0, "FT4*SEC/SLUG"), 0.0),
        contents=full * min(max(share, 0.0), most),
        own=own,
        ballonets=tuple(
            read_bag(each, f"{name}/ballonet[{k}]", False) for k, each in enumerate(node.find_all("ballonet"))
        )
        if ballonets
        else (),
    )


def read_buoyancy(node: Element | None) -> tuple[Bag, ...]:
    """Read <buoyant_forces>.

    Raises:
        AircraftError: A gas cell is not supported.
    """
    cells = node.find_all("gas_cell") if node is not None else ()
    return tuple(read_bag(each, f"buoyant_forces/gas-cell[{k}]") for k, each in enumerate(cells))


def gas_names() -> tuple[str, list[str], list[str]]:
    """Names of the state of the gas that the mass balance of the next step takes: mass, its moments, its inertia."""
    return (
        "state/gas mass",
        [f"state/gas {axis}" for axis in MOMENTS],
        [f"state/gas {axes}" for axes in INERTIA],
    )


def emit_gas_mass(code: Code, cells: tuple[Bag, ...]) -> tuple[str, list[str], list[str]]:
    """Variables of mass [slug], moments [slug in] and inertia [slug ft^2] of the gas in the last step."""
    mass, moments, inertia = gas_names()
    code.initial.setdefault(mass, total(cell.contents * cell.gas[0] for cell in cells))
    for name in (*moments, *inertia):
        code.initial.setdefault(name, 0.0)
    return code.read(mass), [code.read(each) for each in moments], [code.read(each) for each in inertia]


def emit_buoyancy(code: Code, node: Element | None, cells: tuple[Bag, ...]) -> None:
    """Emit force and moment of buoyancy, `buoy_fx` ... `buoy_mz`, and the state of the gas."""
    code.line("buoy_fx = buoy_fy = buoy_fz = buoy_mx = buoy_my = buoy_mz = 0.0")
    if node is None or not cells:
        return
    for each in node.find_all("function"):
        emit_function(code, each)
    mass, moments, inertia = emit_gas_mass(code, cells)
    code.line("gravity = math.sqrt(gx * gx + gy * gy + gz * gz)")
    code.line(f"{' = '.join((mass, *moments, *inertia))} = 0.0")
    for cell in cells:
        _emit_cell(code, cell)
        for bag in (cell, *cell.ballonets):
            _emit_mass(code, bag, mass, moments, inertia)
    for axis in "xyz":
        code.write(f"forces/fb{axis}-buoyancy-lbs", f"buoy_f{axis}")
    for axis, letter in zip("xyz", "lmn", strict=True):
        code.write(f"moments/{letter}-buoyancy-lbsft", f"buoy_m{axis}")


def _emit_cell(code: Code, cell: Bag) -> None:
    contents, temperature, pressure, volume = cell.variables(code)
    swelling, opened = cell.state(code, "swelling"), cell.valve_open(code)
    outside, air, warmth = (code.read(f"atmosphere/{each}") for each in ("P-psf", "rho-slugs_ft3", "T-R"))
    mass, capacity = cell.gas
    heat = cell.emit_heat(code)
    code.line(f"cell_before = {temperature} / {pressure}")
    flows = "".join(f" - {each.state(code, 'heat')}" for each in cell.ballonets)
    if heat:
        with code.block(f"if {contents} > 0.0"):
            code.line(
                f"{temperature} += (({heat}) * dt - {pressure} * {swelling}{flows}) / ({capacity!r} * {contents} * {GAS_CONSTANT!r})"
            )
        with code.block("else"):
            code.line(f"{temperature} = {warmth}")
    else:
        code.line(f"{temperature} = {warmth}")
    taken = "".join(f" - {each.variables(code)[3]}" for each in cell.ballonets)
    highest = f"({outside} + {cell.overpressure!r})"
    ideal = f"{contents} * {GAS_CONSTANT!r} * {temperature}"
    code.line(f"{pressure} = min(max({ideal} / ({cell.volume!r}{taken}), {outside}), {highest})")
    if cell.valve > 0.0:
        code.lines(f"""
if {opened} > 0.0:
    cell_gas = {ideal} / {pressure}
    cell_height = {cell.height!r} * cell_gas / {cell.volume!r}
    cell_push = {pressure} + cell_height * gravity * ({air} - {contents} * {mass!r} / cell_gas) - {outside}
    cell_lost = {opened} * {cell.valve!r} * cell_push * dt
    {contents} = max({contents} - {pressure} * cell_lost / ({GAS_CONSTANT!r} * {temperature}), 0.0)
""")
    for each in cell.ballonets:
        _emit_ballonet(code, each, pressure, temperature)
    lift = cell.slot(code, "buoyancy-lbs", 0.0)
    x, y, z = cell.location
    code.lines(f"""
if {ideal} / ({cell.volume!r}{taken}) > {highest}:
    {contents} = {highest} * ({cell.volume!r}{taken}) / ({GAS_CONSTANT!r} * {temperature})
{volume} = {ideal} / {pressure}{taken.replace(" - ", " + ")}
{swelling} = {contents} * {GAS_CONSTANT!r} * ({temperature} / {pressure} - cell_before)
{lift} = {volume} * {air} * gravity
arm_x = (cg_x - ({x!r})) / 12.0
arm_y = (({y!r}) - cg_y) / 12.0
arm_z = (cg_z - ({z!r})) / 12.0
buoy_fx -= {lift} * l13
buoy_fy -= {lift} * l23
buoy_fz -= {lift} * l33
buoy_mx -= {lift} * (arm_y * l33 - arm_z * l23)
buoy_my -= {lift} * (arm_z * l13 - arm_x * l33)
buoy_mz -= {lift} * (arm_x * l23 - arm_y * l13)
""")
    code.write(f"{cell.name}/max_volume-ft3", repr(cell.volume))


def _emit_ballonet(code: Code, bag: Bag, around: str, warmth: str) -> None:
    """Emit a ballonet in a gas cell of a pressure and a temperature."""
    contents, temperature, pressure, volume = bag.variables(code)
    swelling, opened, flow = bag.state(code, "swelling"), bag.valve_open(code), bag.state(code, "heat")
    outside = code.read("atmosphere/P-psf")
    code.line(f"{flow} = {bag.emit_heat(code) or '0.0'}")
    code.lines(f"""
bag_before = {temperature} / {pressure}
if {contents} > 0.0:
    {temperature} += ({flow} * dt - {pressure} * {swelling}) / ({bag.gas[1]!r} * {contents} * {GAS_CONSTANT!r})
else:
    {temperature} = {warmth}
{pressure} = max({contents} * {GAS_CONSTANT!r} * {temperature} / {bag.volume!r}, {around})
""")
    blower = bag.node.find("blower_input")
    if blower is not None:
        inflow = expression(code, content(blower)[0])
        code.line(f"{contents} += {pressure} * max({inflow} * dt, 0.0) / ({GAS_CONSTANT!r} * {temperature})")
    if bag.valve > 0.0:
        code.lines(f"""
bag_open = 1.0 if {pressure} > {outside} + {bag.overpressure!r} else {opened}
if bag_open > 0.0:
    bag_lost = bag_open * {bag.valve!r} * ({pressure} - {outside}) * dt
    {contents} = max({contents} - {pressure} * bag_lost / ({GAS_CONSTANT!r} * {temperature}), 1.0)
""")
    code.lines(f"""
{volume} = {contents} * {GAS_CONSTANT!r} * {temperature} / {pressure}
{swelling} = {contents} * {GAS_CONSTANT!r} * ({temperature} / {pressure} - bag_before)
""")
    code.write(f"{bag.name}/max_volume-ft3", repr(bag.volume))


def _emit_mass(code: Code, bag: Bag, mass: str, moments: list[str], inertia: list[str]) -> None:
    """Add a bag to mass, moments and inertia of the gas."""
    x, y, z = bag.location
    code.lines(f"""
m = {bag.variables(code)[0]} * {bag.gas[0]!r}
arm_x = (cg_x - ({x!r})) / 12.0
arm_y = (({y!r}) - cg_y) / 12.0
arm_z = (cg_z - ({z!r})) / 12.0
{mass} += m
{moments[0]} += m * ({x!r})
{moments[1]} += m * ({y!r})
{moments[2]} += m * ({z!r})
{inertia[0]} += m * ({bag.own[0]!r} + arm_y * arm_y + arm_z * arm_z)
{inertia[1]} += m * ({bag.own[1]!r} + arm_x * arm_x + arm_z * arm_z)
{inertia[2]} += m * ({bag.own[2]!r} + arm_x * arm_x + arm_y * arm_y)
{inertia[3]} -= m * arm_x * arm_y
{inertia[4]} -= m * arm_x * arm_z
{inertia[5]} -= m * arm_y * arm_z
""")
