"""Piston engine, with superchargers."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.constants import FOOT, SEA_LEVEL_PRESSURE
from tussle.aircraft.functions import table_of_pairs
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench, slot
from tussle.aircraft.propulsion.runtime import PASCAL_PER_PSF
from tussle.aircraft.propulsion.thruster import Propeller

PASCAL_PER_INHG = 3386.38
STANDARD = 101320.73  # [Pa]
PUMPING = 22371.0  # 60 * 745.7 / 2, of min, W/hp, and cycles
# Fuel to air, efficiency.
MIXTURE = (
    0.05, 0.0, 0.05137, 0.00862, 0.05179, 0.21552, 0.0543, 0.48276, 0.05842, 0.7069, 0.06312, 0.83621, 0.06942, 0.93103,
    0.07786, 1.0, 0.08845, 1.0, 0.0927, 0.98276, 0.1012, 0.93103, 0.11455, 0.72414, 0.12158, 0.4569, 0.12435, 0.23276,
    0.125, 0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Gear:
    """A gear of a supercharger: pressure ratio at its rated speed [1/min]; rated, takeoff and shifting pressure [Pa]."""

    gain: float
    rpm: float
    rated: float
    takeoff: float
    shift: float


@dataclass(frozen=True)
class Piston:
    """A piston engine.

    Attributes:
        node: Its element, for its functions.
        idle_rpm: [1/min]
        displacement: [m^3]
        cycles: 2 or 4.
        stroke: [in]
        compression: Ratio.
        efficiency: Volumetric.
        consumption: Of fuel for indicated power [lb/h/hp].
        friction: Power to turn it [hp].
        losses: Mean pressures of friction: per piston speed [Pa s/m], and constant [Pa].
        impedance: Of the throttle, of the air box.
        peak_speed: Mean piston speed at which the intake chokes [ft/s].
        ram: Share of dynamic pressure that the intake recovers.
        lag: Time constant of the manifold [s].
        one_magneto: Power with one magneto, relative.
        starter: Torque [ft lbf] and speed without load [1/min].
        mixture: Ratio of fuel to air and efficiency, in turn.
        gears: Of the supercharger.
        is_manual: Whether the gears are shifted by `boost-speed`.
        is_unlimited: Whether nothing limits the boost.
        boost_loss: Factor of the power that the supercharger takes.
    """

    node: Element
    idle_rpm: float
    displacement: float
    cycles: float
    stroke: float
    compression: float
    efficiency: float
    consumption: float
    friction: float
    losses: tuple[float, float]
    impedance: tuple[float, float]
    peak_speed: float
    ram: float
    lag: float
    one_magneto: float
    starter: tuple[float, float]
    mixture: tuple[float, ...]
    gears: tuple[Gear, ...]
    is_manual: bool
    is_unlimited: bool
    boost_loss: float
    burns = True

    def emit_start(self, bench: Bench, thruster: Propeller) -> None:
        """Emit that it runs at twice its idle speed, and that its mixture is rich from now on."""
        bench.code.lines(f"""
{slot(bench.code, f"fcs/mixture-cmd-norm[{bench.index}]", 0.0)} = 1.0
{bench.state("magnetos")} = 3.0
{bench.slot("set-running")} = 1.0
{thruster.rpm_of(bench)} = {2.0 * self.idle_rpm / thruster.gear!r}
""")

    def emit(self, bench: Bench, thruster: Propeller) -> tuple[str, str]:
        """Emit its step. Return the power [ft lbf/s] and the fuel that it needs [lb]."""
        code, n = bench.code, bench.local
        rpm = thruster.engine_rpm(bench)
        ambient, running = bench.read("atmosphere/P-psf"), bench.command("set-running")
        flow, magnetos = bench.slot("fuel-flow-rate-pps"), bench.state("magnetos")
        parameters = (*self.impedance, self.peak_speed, self.ram, self.lag)
        at = code.constant(parameters)
        pressure = bench.state("manifold", SEA_LEVEL_PRESSURE * PASCAL_PER_PSF)
        efficiency = bench.given("volumetric-efficiency", self.efficiency)
        total = bench.read("propulsion/pt-lbs_sqft")
        code.lines(f"""
{n("speed")} = {rpm} * {self.stroke / 360.0!r}
{n("can_burn")} = {magnetos} != 0.0 and {flow} > 0.0
if {running} != 0.0:
    {running} = 1.0 if {n("can_burn")} and {rpm} >= {self.idle_rpm * 0.8!r} else 0.0
elif {n("can_burn")} and {rpm} > {self.idle_rpm * 0.8!r}:
    {running} = 1.0
{n("outside")} = {ambient} * {PASCAL_PER_PSF!r}
{pressure} = manifold(tables, {at}, {bench.dt}, {bench.throttle}, {n("speed")}, {ambient}, {total}, {pressure})
""")
        intake = self._emit_boost(bench, rpm, pressure) if self.gears else pressure
        starved = bench.state("starved")
        mixture = table_of_pairs(code, list(self.mixture), "0.0", self.node)
        place, count = mixture.split(", ")[1:3]
        temperature = bench.read("atmosphere/T-R")
        starter = bench.state("starter")
        torque = f"{self.starter[0]!r} * {bench.given('starter-norm', 1.0)}, {self.starter[1]!r}"
        consumption = bench.given("bsfc-lbs_hphr", self.consumption)
        magneto = f"({consumption} if {magnetos} == 3.0 else {consumption} / {self.one_magneto!r})"
        cylinders = f"tables, {place}, {count}, {running}, {n('fuel')}, {n('air')}, {magneto}"
        code.lines(f"""
{n("air")} = air_flow({self.compression!r}, {efficiency}, {self.displacement!r}, {rpm}, {n("outside")}, {intake})
{n("volume")} = {n("air")}
{n("air")} = {n("air")} * ({intake} / ({287.3!r} * ({temperature} / 1.8)))
{n("fuel")} = 0.0 if {starved} != 0.0 else {n("air")} * (1.3 * {bench.mixture} * 101325.0 / {n("outside")}) / 14.7
{flow} = {n("fuel")} * 2.2046
{n("indicated")} = indicated_power({cylinders}, {self.friction!r}, {starter}, {torque}, {rpm})
{n("pumping")} = ({pressure} - {n("outside")}) * {efficiency}
if {running} != 0.0:
    {n("pumping")} -= {self.losses[0] * FOOT!r} * {n("speed")} + {self.losses[1]!r}
{n("hp")} = {n("indicated")} + {n("pumping")} * {self.displacement!r} * {rpm} / {self.cycles * PUMPING!r}
if {n("indicated")} < 0.125:
    {running} = 0.0
""")
        if self.gears and self.boost_loss > 0.0:
            code.line(f"{n('hp')} -= {n('loss')}")
            code.line(f"{bench.state('volume')} = {n('volume')}")
        code.line(f"{n('power')} = {n('hp')} * 550.0 if {rpm} > 0.1 else max({n('hp')} * 550.0, 0.0)")
        bench.write("power-hp", n("hp"))
        bench.write("map-pa", intake)
        bench.write("map-inhg", f"{intake} / {PASCAL_PER_INHG!r}")
        bench.write("fuel-flow-rate-gph", f"{flow} * 3600.0 / 6.6")
        bench.write("AFR", f"{n('air')} / {n('fuel')} if {n('fuel')} > 0.0 else math.inf")
        return n("power"), f"{flow} * {bench.dt}"

    def emit_fed(self, bench: Bench) -> None:
        """Nothing changes where the engine gets fuel."""

    def _emit_boost(self, bench: Bench, rpm: str, pressure: str) -> str:
        """Emit the supercharger. Return the pressure behind it [Pa]."""
        code, n = bench.code, bench.local
        gear = bench.slot("boost-speed")
        last = float(len(self.gears) - 1)
        if self.is_manual:
            bench.code.inputs.add(bench.name("boost-speed"))
            code.line(f"{gear} = min(max(float(int({gear})), 0.0), {last!r})")
        elif last:
            at = code.constant([each.shift for each in self.gears])
            code.line(f"{gear} = gear_of_boost(tables, {at}, {len(self.gears)}, {n('outside')}, {gear})")
        rows = [((each.gain - 1.0) / each.rpm, each.rated, each.takeoff) for each in self.gears]
        at = code.constant([number for row in rows for number in row])
        code.line(
            f"{n('map')} = boosted(tables, {at}, {gear}, {not self.is_unlimited}, {bench.throttle} > 0.98, {rpm}, {pressure})"
        )
        if self.boost_loss > 0.0:
            code.line(
                f"{n('loss')} = boost_loss({pressure}, {n('map')}, {bench.state('volume')}, {self.boost_loss!r})"
            )
        return n("map")


def read_piston(node: Element) -> Piston:
    """Read a <piston_engine>.

    Raises:
        AircraftError: A number is wrong, or its table is none of pairs.
    """
    max_rpm, stroke = node.value("maxrpm", 2800.0), node.value("stroke", 4.375, "IN")
    low = node.value("minmp", 6.5, "INHG")
    high = node.value("maxmp", 28.5, "INHG")
    size = node.value("displacement", 360.0, "IN3")
    max_hp, friction = node.value("maxhp", 200.0, "HP"), node.value("static-friction", 1.5, "HP")
    cycles, idle = node.value("cycles", 4.0), node.value("idlerpm", 600.0)
    efficiency = node.value("volumetric-efficiency", 0.85)
    losses = node.value("dynamic-fmep", 18400.0, "PA"), node.value("static-fmep", 46500.0, "PA")
    displacement = size * (FOOT / 12.0) ** 3
    rated_speed = max_rpm * stroke / 360.0
    peak = node.value("peak-piston-speed", 100.0)
    consumption = node.value("bsfc", -1.0, "LBS/HP*HR")
    for tag, number in (
        ("maxrpm", max_rpm),
        ("stroke", stroke),
        ("idlerpm", idle),
        ("minmp", low),
        ("maxmp", high),
        ("cycles", cycles),
    ):
        if not number > 0.0:
            raise node.error(f"<{tag}> must be positive")
    if consumption < 0.0:
        pumping = (29.92 - high) * PASCAL_PER_INHG * efficiency
        drag = losses[0] * rated_speed * FOOT + losses[1]
        lost = (pumping + drag) * displacement * max_rpm / (cycles * PUMPING)
        consumption = (
            1.1 * size * max_rpm * efficiency * (high / 29.92) / (9411.0 * (max_hp + lost - friction))
        )
    high = min(high, 29.9)
    box = node.value("air-intake-impedance-factor", -999.0)
    if box < 0.0:
        engine = peak / rated_speed
        box = STANDARD * engine / (high * PASCAL_PER_INHG) - engine
    closed = peak / (idle * stroke / 360.0) * (STANDARD / (low * PASCAL_PER_INHG) - 1.0) - box
    return Piston(
        node=node,
        idle_rpm=idle,
        displacement=displacement,
        cycles=cycles,
        stroke=stroke,
        compression=node.value("compression-ratio", 8.5),
        efficiency=efficiency,
        consumption=consumption,
        friction=friction,
        losses=losses,
        impedance=(closed, box),
        peak_speed=peak,
        ram=node.value("ram-air-factor", 1.0),
        lag=node.value("man-press-lag", 1.0),
        one_magneto=min(max(1.0 - node.value("sparkfaildrop", 0.0), 0.0), 1.0) or 1e-300,
        starter=(
            _positive(node, "starter-torque", max_hp * 0.4),
            _positive(node, "starter-rpm", 2.0 * idle),
        ),
        mixture=_mixture(node),
        gears=_gears(node),
        is_manual=int(node.value("boostmanual", 0.0)) == 1,
        is_unlimited=int(node.value("boostoverride", 0.0)) == 1,
        boost_loss=node.value("boost-loss-factor", 0.0),
    )


def _positive(node: Element, tag: str, default: float) -> float:
    value = node.value(tag, -1.0)
    return default if value < 0.0 else value


def _mixture(node: Element) -> tuple[float, ...]:
    found = next((each for each in node.find_all("table") if each.get("name") == "MIXTURE"), None)
    if found is None:
        return MIXTURE
    data = found.need("tableData")
    try:
        numbers = tuple(float(word) for word in data.text.split())
    except ValueError as reason:
        raise data.error(str(reason)) from None
    if not all(map(math.isfinite, numbers)):
        raise data.error("a number is not finite")
    return numbers


def _gears(node: Element) -> tuple[Gear, ...]:
    n = int(node.value("numboostspeeds", 0.0))
    if not 0 <= n <= 3:
        raise node.error("numboostspeeds is 0 to 3")
    takeoff, gears = node.value("takeoffboost", 0.0, "PSI"), []
    first, last = node.value("ratedboost1", 0.0, "PSI"), -1.0
    for k in range(1, n + 1):
        boost, height = node.value(f"ratedboost{k}", 0.0, "PSI"), node.value(f"ratedaltitude{k}", 0.0, "FT")
        if boost <= 0.0 or node.value(f"ratedpower{k}", 0.0, "HP") <= 0.0 or height < 0.0 or height < last:
            break  # JSBSim too uses the gears before it only
        rated = STANDARD + boost * 6895.0
        extra = (takeoff - first) * 6895.0 if takeoff > first else 0.0
        shift = _standard_pressure(height + 1000.0 if height else 0.0) * PASCAL_PER_PSF
        gain = rated / (_standard_pressure(height) * PASCAL_PER_PSF)
        gears.append(Gear(gain, node.value(f"ratedrpm{k}", 2500.0), rated, rated + extra, shift))
        last = height
    return tuple(gears)


def _standard_pressure(height: float) -> float:
    """JSBSim's polynomial of the standard atmosphere [lbf/ft^2] over altitude [ft]."""
    h = min(height, 100000.0)
    return 2116.217 + h * (
        -7.648932746e-2 + h * (1.0925498604e-6 + h * (-7.1135726027e-12 + h * 1.7470331356e-17))
    )
