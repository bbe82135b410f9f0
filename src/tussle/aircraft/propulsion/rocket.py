"""Rocket engines, of solid or liquid propellant."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.functions import content, expression, table
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench
from tussle.aircraft.propulsion.thruster import Thruster


@dataclass(frozen=True)
class Rocket:
    """A rocket.

    Attributes:
        node: Its element, for its functions and its table of thrust.
        build_up: Duration of the ignition [s].
        least: Throttle below which it does not burn.
        flows: Of fuel and oxidizer at full throttle [lb/s].
        variations: Of thrust and of specific impulse, relative.
        oxidizer: Whether it takes oxidizer.
    """

    node: Element
    build_up: float
    least: float
    flows: tuple[float, float]
    variations: tuple[float, float]
    burns = True

    def emit_start(self, bench: Bench, thruster: Thruster) -> None:
        """The throttle starts it."""

    def emit(self, bench: Bench, thruster: Thruster) -> tuple[str, str]:
        """Emit its step. Return the thrust in a vacuum [lbf] and the fuel that it needs [lb]."""
        code, n = bench.code, bench.local
        fuel, oxidizer = bench.state("fuel"), bench.state("oxidizer")
        vacuum, starved = bench.slot("vacuum-thrust_lbs"), bench.state("starved")
        total, burnt = bench.state("total"), bench.state("burnt")
        node = self.node.find("thrust_table")
        with code.block(f"if {bench.dt} > 0.0"):
            impulse = self._impulse(bench)
            code.line(f"{total} += {fuel} + {oxidizer}")
            if node is None:
                code.lines(f"""
{n("power")} = 0.0 if {bench.throttle} < {self.least!r} or {starved} != 0.0 else {bench.throttle}
{vacuum} = 0.0 if {bench.throttle} < {self.least!r} or {starved} != 0.0 else {impulse} * (({fuel} + {oxidizer}) / {bench.dt})
{bench.state("power")} = {n("power")}
""")
            else:
                push, factor = (
                    table(code, node, keys=[total]),
                    (self.variations[0] + 1.0) * (self.variations[1] + 1.0),
                )
                with code.block(f"if ({bench.throttle} == 1.0 or {burnt} > 0.0) and {starved} == 0.0"):
                    code.line(f"{vacuum} = {push} * {factor!r}")
                    if self.build_up > 0.0:
                        with code.block(f"if {burnt} <= {self.build_up!r}"):
                            code.line(f"{vacuum} *= sin({burnt} / {self.build_up!r} * {math.pi / 2.0!r})")
                    code.line(f"{burnt} += {bench.dt}")
                with code.block("else"):
                    code.line(f"{vacuum} = 0.0")
        if node is None:
            need = f"{self.flows[0]!r} * {bench.state('power')} * {bench.dt}"
        else:
            need = f"{vacuum} / {self._impulse(bench)} / {self.variations[1] + 1.0!r} * {bench.dt}"
        return vacuum, need

    def emit_fed(self, bench: Bench) -> None:
        """Nothing but the tanks changes where the engine gets fuel."""

    def oxidizer_need(self, bench: Bench) -> str:
        """Expression of the oxidizer that it needs [lb]."""
        if self.node.find("thrust_table") is not None:
            return "0.0"
        return f"{self.flows[1]!r} * {bench.state('power')} * {bench.dt}"

    def _impulse(self, bench: Bench) -> str:
        """Expression of the specific impulse [s]."""
        node = self.node.need("isp")
        operands = content(node)
        if operands:
            return bench.code.temporary(expression(bench.code, operands[0]))
        return bench.given("isp", node.number())


def read_rocket(node: Element) -> Rocket:
    """Read a <rocket_engine>.

    Raises:
        AircraftError: It lacks its specific impulse, or has a part that is not supported.
    """
    for tag in ("propflowmax", "mixtureratio"):
        if node.find(tag) is not None:
            raise node.error(f"<{tag}> is not supported; give slfuelflowmax and sloxiflowmax")
    node.need("isp")
    variation = node.find("variation")
    return Rocket(
        node=node,
        build_up=node.value("builduptime", 0.0),
        least=node.value("minthrottle", 0.0),
        flows=(node.value("slfuelflowmax", 0.0, "LBS/SEC"), node.value("sloxiflowmax", 0.0, "LBS/SEC")),
        variations=(0.0, 0.0)
        if variation is None
        else (variation.value("thrust", 0.0), variation.value("total_isp", 0.0)),
    )
