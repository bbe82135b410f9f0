"""The propulsion of an aircraft: its tanks, engines and thrusters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

from tussle.aircraft.code import Code, normal
from tussle.aircraft.functions import emit_function
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench, numbered
from tussle.aircraft.propulsion.electric import Brushless, Electric, read_brushless, read_electric
from tussle.aircraft.propulsion.piston import Piston, read_piston
from tussle.aircraft.propulsion.rocket import Rocket, read_rocket
from tussle.aircraft.propulsion.tank import Tank, count_fed, drain, emit_flows, read_tank
from tussle.aircraft.propulsion.thruster import Propeller, Thruster, read_thruster
from tussle.aircraft.propulsion.turbine import Turbine, read_turbine
from tussle.aircraft.propulsion.turboprop import Turboprop, read_turboprop
from tussle.errors import listed

Find = Callable[[Element, str, str], Element]
Engine = Piston | Turbine | Turboprop | Electric | Brushless | Rocket
ENGINES: dict[str, Callable[[Element], Engine]] = {
    "piston_engine": read_piston,
    "turbine_engine": read_turbine,
    "turboprop_engine": read_turboprop,
    "electric_engine": read_electric,
    "brushless_dc_motor": read_brushless,
    "rocket_engine": read_rocket,
}
COMMANDS = {
    "magnetos": "propulsion/magneto_cmd",
    "starter": "propulsion/starter_cmd",
    "cutoff": "propulsion/cutoff_cmd",
}
NEEDS_PROPELLER = (Piston, Turboprop, Electric, Brushless)
SETTLING = 0.5  # [s], JSBSim's step when it lets an engine settle
MAX_SETTLING, SETTLED = 6000, 120


@dataclass(frozen=True)
class PowerUnit:
    """An engine with its thruster and the numbers of the tanks that feed it."""

    engine: Engine
    thruster: Thruster
    feeds: tuple[int, ...]


@dataclass(frozen=True)
class Propulsion:
    """The propulsion of an aircraft.

    Attributes:
        node: Its element, for its functions and properties.
        engines: The engines with their thrusters.
        tanks: The tanks.
    """

    node: Element
    engines: tuple[PowerUnit, ...]
    tanks: tuple[Tank, ...]

    def emit(self, code: Code) -> None:
        """Emit force [lbf] and moment [lbf ft] of the propulsion, `prop_fx` ... `prop_mz`, and the step of engines and tanks."""
        code.line("# Propulsion.")
        self._emit_commands(code)
        for each in self.node.find_all("property"):
            code.initial.setdefault(each.text, each.attribute_number("value", 0.0))
            code.inputs.add(each.text)
        for tank in self.tanks:
            code.initial[tank.property] = tank.contents
            code.inputs.add(tank.property)
            code.initial[normal(f"propulsion/tank[{tank.index}]/density-lbs_per_gal")] = tank.density
        self._emit_functions(code, "pre")
        code.line("prop_fx = prop_fy = prop_fz = prop_mx = prop_my = prop_mz = 0.0")
        for k, unit in enumerate(self.engines):
            throttle, mixture = (code.read(f"fcs/{each}-pos-norm[{k}]") for each in ("throttle", "mixture"))
            bench = Bench(code, k, "dt", throttle, mixture)
            code.line(f"# Engine {k}.")
            fuel = self._emit_unit(bench, unit)
            if unit.engine.burns:
                self._emit_feed(bench, unit, fuel)
        emit_flows(code, self.tanks)
        self._emit_functions(code, "post")

    def emit_start(self, code: Code) -> None:
        """Emit that all engines run and have settled: with open throttles, or where dt > 0 with throttle and mixture as they are."""
        code.line("settled_now = 0.0")
        code.line("prop_fx = prop_fy = prop_fz = prop_mx = prop_my = prop_mz = 0.0")
        for k, unit in enumerate(self.engines):
            is_piston, is_turbine = (
                isinstance(unit.engine, Piston),
                isinstance(unit.engine, Turbine | Turboprop),
            )
            mixture = f"{code.read('atmosphere/P-psf')} / 2116.228 * 1.3" if is_piston else "1.0"
            throttle_now, mixture_now = (
                code.read(f"fcs/{each}-pos-norm[{k}]") for each in ("throttle", "mixture")
            )
            throttle = f"(1.0 if dt == 0.0 else {throttle_now})"
            bench = Bench(code, k, "settling", throttle, f"({mixture} if dt == 0.0 else {mixture_now})")
            unit.engine.emit_start(bench, unit.thruster)  # type: ignore[arg-type]
            code.line("settled = 0")
            # turbines first take a step of no duration
            first = -1 if is_turbine else 0
            with code.block(f"for k in range({first}, {MAX_SETTLING})"):
                code.line(f"settling = {SETTLING!r} if k >= 0 else 0.0")
                self._emit_unit(bench, unit)
                thrust = bench.slot("thrust-lbs")
                code.lines(f"""
if k >= 0:
    settled_before = settled_now
    settled_now = {thrust}
    if k == 0 and {k} == 0:
        settled_before = 0.0
    settled = settled + 1 if abs(settled_before - settled_now) < 0.0001 else 0
    if settled > {SETTLED}:
        break
""")

    def _emit_unit(self, bench: Bench, unit: PowerUnit) -> str:
        """Emit an engine and its thruster. Return the fuel that it needs [lb]."""
        engine = unit.engine
        bench.has_levers = not isinstance(engine, Turbine | Rocket)
        bench.functions(engine.node, "pre")
        push, fuel = engine.emit(bench, unit.thruster)  # type: ignore[arg-type]
        unit.thruster.emit(bench, push)
        bench.functions(engine.node, "post")
        return fuel

    def _emit_feed(self, bench: Bench, unit: PowerUnit, fuel: str) -> None:
        code, n, starved, engine = bench.code, bench.local, bench.state("starved"), unit.engine
        tanks = {
            kind: [self.tanks[k] for k in unit.feeds if self.tanks[k].kind == kind]
            for kind in ("FUEL", "OXIDIZER")
        }
        fed, tests = count_fed(code, tanks["FUEL"], len(self.tanks), n("fuel"))
        enough = f"{fed} > 0"
        if isinstance(engine, Rocket) and tanks["OXIDIZER"]:
            fed_oxidizer, oxidizer_tests = count_fed(code, tanks["OXIDIZER"], len(self.tanks), n("oxidizer"))
            enough += f" and {fed_oxidizer} > 0"
        code.line(f"{starved} = 0.0 if {enough} else 1.0")
        with code.block(f"if {enough}"):
            code.line(f"{n('need')} = {fuel}")
            engine.emit_fed(bench)
            drain(code, tanks["FUEL"], tests, n("need"), fed)
            if isinstance(engine, Rocket):
                code.line(f"{bench.state('fuel')} = {n('need')}")
                if tanks["OXIDIZER"]:
                    code.line(f"{n('oxidizer')} = {engine.oxidizer_need(bench)}")
                    drain(code, tanks["OXIDIZER"], oxidizer_tests, n("oxidizer"), fed_oxidizer)
                    code.line(f"{bench.state('oxidizer')} = {n('oxidizer')}")

    def _emit_commands(self, code: Code) -> None:
        """Emit that a changed command for all engines reaches each of them."""
        kinds = {"magnetos": Piston, "starter": Piston | Turbine | Turboprop, "cutoff": Turbine | Turboprop}
        for leaf, name in COMMANDS.items():
            engines = [k for k, unit in enumerate(self.engines) if isinstance(unit.engine, kinds[leaf])]
            if not engines:
                continue
            initial = 1.0 if leaf == "cutoff" else 0.0
            code.inputs.add(name)
            code.initial.setdefault(name, initial)
            code.initial.setdefault(f"state/last-{leaf}", initial)
            command, last = code.read(name), code.read(f"state/last-{leaf}")
            with code.block(f"if {command} != {last}"):
                for k in engines:
                    code.line(f"{Bench(code, k, '', '', '').state(leaf, initial)} = {command}")
                code.line(f"{last} = {command}")

    def _emit_functions(self, code: Code, kind: str) -> None:
        for each in self.node.find_all("function"):
            if (each.get("type") or "pre") == kind:
                emit_function(code, each)


def read_propulsion(node: Element, find: Find) -> Propulsion:
    """Read <propulsion>.

    Args:
        node: The element.
        find: Returns the content of a file by the node that names it, its name and kind ("engine").

    Raises:
        AircraftError: Something is wrong or not supported.
    """
    if node.get("file"):
        node = find(node, node.get("file"), "engine")
    tanks = tuple(read_tank(each, k) for k, each in enumerate(node.find_all("tank")))
    units = tuple(_unit(each, k, len(tanks), find) for k, each in enumerate(node.find_all("engine")))
    return Propulsion(node, units, tanks)


def _unit(node: Element, index: int, n_tanks: int, find: Find) -> PowerUnit:
    file = _content(node, find, tuple(ENGINES))
    if file.tag not in ENGINES:
        raise file.error(f"this engine is not supported; {listed(ENGINES)}")
    engine = ENGINES[file.tag](file)
    engine = replace(engine, node=numbered(engine.node, index))
    mount = node.need("thruster")
    thruster = read_thruster(
        mount, numbered(_content(mount, find, ("direct", "nozzle", "propeller", "rotor")), index)
    )
    if isinstance(engine, NEEDS_PROPELLER) and not isinstance(thruster, Propeller):
        raise mount.error(f"<{file.tag}> needs a propeller")
    feeds = []
    for each in node.find_all("feed"):
        number = each.number()
        if not (0 <= number < n_tanks and number == int(number)):
            raise each.error(f"there is no tank {number:g}; the tanks are 0 to {n_tanks - 1}")
        feeds.append(int(number))
    return PowerUnit(engine, thruster, tuple(feeds))


def _content(node: Element, find: Find, tags: tuple[str, ...]) -> Element:
    """Return the content of an engine or a thruster: that of its file, or its own."""
    if node.get("file"):
        return find(node, node.get("file"), "engine")
    found = next((each for each in node if each.tag in tags), None)
    if found is None:
        raise node.error(f"it needs a file, or one of: {', '.join(tags)}")
    return found
