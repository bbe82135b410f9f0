"""Electric motors."""

from __future__ import annotations

from dataclasses import dataclass

from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench
from tussle.aircraft.propulsion.runtime import NEWTON_METRE
from tussle.aircraft.propulsion.thruster import Propeller

WATT_PER_HP = 745.7


@dataclass(frozen=True)
class Electric:
    """A motor whose power [W] is proportional to the throttle."""

    node: Element
    power: float
    burns = False

    def emit_start(self, bench: Bench, thruster: Propeller) -> None:
        """Nothing needs to be started."""

    def emit(self, bench: Bench, thruster: Propeller) -> tuple[str, str]:
        """Emit its step. Return the power [ft lbf/s] and the fuel that it needs [lb]."""
        n = bench.local
        rpm = thruster.engine_rpm(bench)
        bench.code.lines(f"""
{n("hp")} = {self.power!r} * {bench.throttle} / {WATT_PER_HP!r}
{n("power")} = {n("hp")} * 550.0 if {rpm} > 0.1 else max({n("hp")} * 550.0, 0.0)
""")
        bench.write("power-hp", n("hp"))
        return n("power"), "0.0"

    def emit_fed(self, bench: Bench) -> None:
        """It takes no fuel."""


@dataclass(frozen=True)
class Brushless:
    """A brushless motor: speed constant [1/min/V], resistance [ohm], current without load [A], greatest voltage [V]."""

    node: Element
    constants: tuple[float, float, float, float]
    burns = False

    def emit_start(self, bench: Bench, thruster: Propeller) -> None:
        """Nothing needs to be started."""

    def emit(self, bench: Bench, thruster: Propeller) -> tuple[str, str]:
        """Emit its step. Return the power [ft lbf/s] and the fuel that it needs [lb]."""
        n, (kv, resistance, idle, volts) = bench.local, self.constants
        constants, voltage = f"{kv!r}, {resistance!r}, {idle!r}", f"{volts!r} * {bench.throttle}"
        bench.code.line(
            f"{n('power')}, {n('current')} = brushless({constants}, {voltage}, {thruster.rpm_of(bench)})"
        )
        bench.write("power-hp", f"{n('power')} / {WATT_PER_HP / NEWTON_METRE!r}")
        bench.write("current-amperes", n("current"))
        return n("power"), "0.0"

    def emit_fed(self, bench: Bench) -> None:
        """It takes no fuel."""


def read_electric(node: Element) -> Electric:
    """Read an <electric_engine>.

    Raises:
        AircraftError: Its power is no number.
    """
    return Electric(node, node.value("power", WATT_PER_HP, "WATTS"))


def read_brushless(node: Element) -> Brushless:
    """Read a <brushless_dc_motor>.

    Raises:
        AircraftError: A constant is missing or not positive.
    """
    tags = ("velocityconstant", "coilresistance", "noloadcurrent", "maxvolts")
    kv, resistance, idle, volts = (node.need(tag).number() for tag in tags)
    if not (kv > 0.0 and resistance > 0.0 and volts > 0.0):
        raise node.error(f"{', '.join(tags)} must be positive")
    return Brushless(node, (kv, resistance, idle, volts))
