"""Turboprop engine."""

from __future__ import annotations

from dataclasses import dataclass

from tussle.aircraft.functions import table, table_of_pairs
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench
from tussle.aircraft.propulsion.runtime import OFF, RUN, SPIN_UP, START, TRIM
from tussle.aircraft.propulsion.thruster import Propeller

# N1 [%], efficiency of the combustion.
COMBUSTION = (60.0, 12.0 / 52.0, 82.0, 12.0 / 30.0, 96.0, 12.0 / 16.0, 100.0, 1.0, 104.0, 1.5, 110.0, 6.0)
TABLES = ("EnginePowerVC", "EnginePowerRPM_N1", "ITT_N1", "CombustionEfficiency_N1")


@dataclass(frozen=True)
class Turboprop:
    """A turboprop.

    Attributes:
        node: Its element, for its functions and tables.
        idle: Speed of the spool [%].
        top: Greatest speed of the spool [%].
        beta_end: Throttle at the end of the range in which, in reverse, only the blade angle changes.
        reverse_power: Greatest share of the power in reverse.
        power: Greatest power [hp].
        consumption: Of fuel [lb/h/hp].
        delay: Time constants of spool and of temperature [s].
        start_time: Longest duration of a start [s].
        starter: Speed to which the starter turns the spool [%].
        torque: Above which the throttle is reduced [ft lbf]; none if it is not positive.
    """

    node: Element
    idle: float
    top: float
    beta_end: float
    reverse_power: float
    power: float
    consumption: float
    delay: tuple[float, float]
    start_time: float
    starter: float
    torque: float
    burns = True

    def emit_start(self, bench: Bench, thruster: Propeller) -> None:
        """Emit that it runs."""
        bench.code.lines(f"""
{bench.slot("set-running")} = 1.0
{bench.state("cutoff", 1.0)} = 0.0
""")

    def emit(self, bench: Bench, thruster: Propeller) -> tuple[str, str]:
        """Emit its step. Return the power [ft lbf/s] and the fuel that it needs [lb]."""
        code, n = bench.code, bench.local
        rpm, n1, flow = thruster.engine_rpm(bench), bench.slot("n1"), bench.state("flow")
        running, phase = bench.command("set-running"), bench.state("phase")
        starter, cutoff, starved = bench.state("starter"), bench.state("cutoff", 1.0), bench.state("starved")
        itt, heat = bench.slot("itt-c"), bench.slot("engtemp-c")
        outside, now, timer = bench.read("propulsion/tat-c"), n("phase"), bench.state("start-time", -1.0)
        self._emit_throttle(bench)
        code.lines(f"""
if {phase} == {TRIM!r} and {bench.dt} > 0.0:
    if {running} != 0.0 and {starved} == 0.0:
        {phase} = {RUN!r}
        {n1} = {self.idle!r}
        {cutoff} = 0.0
    else:
        {phase} = {OFF!r}
        {cutoff} = 1.0
        {itt} = {outside}
        {heat} = {outside}
if {running} == 0.0 and {starter} != 0.0 and {phase} == {OFF!r}:
    {timer} = max({timer}, 0.0)
{phase} = turboprop_phase({bench.dt}, {phase}, {running}, {starter}, {cutoff}, {starved}, {n1})
{now} = {phase}
""")
        if self.torque > 0.0:
            self._emit_limiter(bench)
        self._emit_spool(bench, now)
        self._emit_power(bench, now, rpm)
        self._emit_temperature(bench, now)
        code.lines(f"""
if {now} == {RUN!r}:
    {running} = 1.0
    {starter} = 0.0
    {phase} = {OFF!r} if {cutoff} != 0.0 or {starved} != 0.0 else {RUN!r}
elif {now} == {SPIN_UP!r}:
    {running} = 0.0
    {timer} += {bench.dt}
    if {self.start_time!r} > 0.0 and {timer} > {self.start_time!r}:
        {phase} = {OFF!r}
        {timer} = -1.0
elif {now} == {START!r}:
    {timer} = -1.0
    if {n("n1_before")} <= 15.0:
        {phase} = {OFF!r}
        {starter} = 0.0
    elif {n("n1_before")} >= {self.idle!r}:
        {phase} = {RUN!r}
        {running} = 1.0
        {starter} = 0.0
elif {now} == {OFF!r}:
    {running} = 0.0
{n("power")} = {n("hp")} * 550.0 if {rpm} > 0.1 else max({n("hp")} * 550.0, 0.0)
""")
        bench.write("power-hp", n("hp"))
        return n("power"), f"{flow} / 3600.0 * {bench.dt}"

    def emit_fed(self, bench: Bench) -> None:
        """Emit what changes where the engine gets fuel."""
        bench.write("fuel-flow-rate-pps", f"{bench.state('flow')} / 3600.0")

    def _emit_throttle(self, bench: Bench) -> None:
        """Emit the throttle and whether the propeller is reversed."""
        code, n = bench.code, bench.local
        bench.is_reversible = True
        code.lines(f"""
{n("is_reversed")} = {bench.command("reverser")} != 0.0
{n("reverse")} = {bench.throttle}
{n("throttle")} = {bench.throttle}
if {n("is_reversed")}:
    {n("throttle")} = max({n("throttle")} - {self.beta_end!r}, 0.0) / {1.0 - self.beta_end!r} * {self.reverse_power!r}
""")

    def _emit_limiter(self, bench: Bench) -> None:
        """Emit the reduction of the throttle at too much torque."""
        throttle, last, acts = bench.local("throttle"), bench.state("throttle"), bench.slot("ielu_intervent")
        torque = bench.slot("propeller-torque-ftlb")
        bench.code.lines(f"""
if abs({torque}) > {self.torque!r} and {throttle} >= {last}:
    {throttle} = {last} - 0.1 * {bench.dt}
    {acts} = 1.0
elif {acts} != 0.0 and {throttle} >= {last}:
    {throttle} = {last} + 0.05 * {bench.dt}
else:
    {acts} = 0.0
{last} = {throttle}
""")

    def _emit_spool(self, bench: Bench, now: str) -> None:
        """Emit the speed of the spool, at which the engine has its power, and whether it is starting."""
        n, n1, tau = bench.local, bench.slot("n1"), self.delay[0]
        bench.code.lines(f"""
{n("n1_before")} = {n1}
{n("lights")} = {now} == {START!r} and {n1} > 15.0 and {n1} < {self.idle!r}
if {now} == {RUN!r}:
    {n1} = decay({n1}, {self.idle!r} + {n("throttle")} * {self.top - self.idle!r}, {tau!r}, {tau * 2.4!r}, {bench.dt})
elif {now} == {SPIN_UP!r}:
    {n1} = decay({n1}, {self.starter!r}, {tau * 6.0!r}, {tau * 2.4!r}, {bench.dt})
elif {n("lights")}:
    {n1} = decay({n1}, {self.idle * 1.1!r}, {tau * 4.0!r}, {tau * 2.4!r}, {bench.dt})
elif {now} == {OFF!r}:
    {n1} = decay({n1}, {bench.read("aero/qbar-psf")} / 15.0, {tau * 2.5!r}, {tau * 5.0!r}, {bench.dt})
{n("n1")} = {n("n1_before")} if {n("lights")} else {n1}
""")

    def _emit_power(self, bench: Bench, now: str, rpm: str) -> None:
        code, n, flow, n1 = bench.code, bench.local, bench.state("flow"), bench.slot("n1")
        found = {each.get("name"): each for each in self.node.find_all("table")}
        efficiency = found.get("CombustionEfficiency_N1")
        code.line(f"{n('hp')} = 0.0")
        with code.block(f"if {now} == {RUN!r} or {now} == {SPIN_UP!r} or {n('lights')}"):
            power = table(code, found["EnginePowerRPM_N1"], keys=[rpm, n("n1")])
            name = bench.name("EnginePowerVC")
            has_function = any(
                each.get("name").endswith("/EnginePowerVC") for each in self.node.find_all("function")
            )
            weather = bench.read(name) if has_function else table(code, found["EnginePowerVC"])
            code.line(f"{n('hp')} = min({power} * {weather}, {self.power!r})")
        with code.block(f"elif {now} == {OFF!r} and {rpm} > 5.0"):
            code.line(f"{n('hp')} = -0.012")
        with code.block(f"if {now} == {RUN!r} or {n('lights')}"):
            burn = (
                table_of_pairs(code, list(COMBUSTION), n1, self.node)
                if efficiency is None
                else table(code, efficiency, keys=[n1])
            )
            code.line(f"{flow} = {self.consumption!r} / {burn} * {n('hp')}")
        with code.block(f"elif {now} == {OFF!r}"):
            code.line(f"{flow} = approach({flow}, 0.0, 800.0, 800.0, {bench.dt})")
        with code.block(f"elif {now} != {TRIM!r}"):
            code.line(f"{flow} = 0.0")

    def _emit_temperature(self, bench: Bench, now: str) -> None:
        """Emit the temperatures between the turbines and of the engine [C]."""
        code, n, n1 = bench.code, bench.local, bench.slot("n1")
        itt, heat = bench.slot("itt-c"), bench.slot("engtemp-c")
        node = next(each for each in self.node.find_all("table") if each.get("name") == "ITT_N1")
        value, tau = table(code, node, keys=[n("itt_n1"), n("itt_run")]), self.delay[1]
        code.lines(f"""
if {now} != {TRIM!r}:
    {n("hot")} = {now} == {RUN!r} or {now} == {START!r}
    {heat} = decay({heat}, {itt} if {n("hot")} else {bench.read("propulsion/tat-c")}, 300.0, 400.0, {bench.dt})
    {n("itt_n1")} = ({n1} - {n("n1_before")}) * 300.0 + {n1} if {n("hot")} else {n1}
    {n("itt_run")} = 1.0 if {n("hot")} else 0.1
    {n("goal")} = {value}
    if not {n("hot")} and {n1} <= 20.0:
        {n("goal")} += (20.0 - {n1}) / 20.0 * {heat}
    {itt} = decay({itt}, {n("goal")}, {tau!r}, {tau * 1.2!r}, {bench.dt})
""")


def read_turboprop(node: Element) -> Turboprop:
    """Read a <turboprop_engine>.

    Raises:
        AircraftError: It lacks a table, or a number is wrong.
    """
    functions = [each.get("name") for each in node.find_all("function")]
    tables = [each.get("name") for each in node.find_all("table")]
    for name in TABLES[:3]:
        if name not in tables and not (name == TABLES[0] and any(each.endswith(name) for each in functions)):
            raise node.error(f"it needs a table {name!r}")
    children = []
    for each in node:
        attributes = dict(each.attributes)
        if each.tag == "function" and each.get("name") == TABLES[0]:
            attributes["name"] = f"propulsion/engine[#]/{TABLES[0]}"
        children.append(Element(each.tag, each.place, attributes, each.chunks, each.children))
    return Turboprop(
        node=Element(node.tag, node.place, node.attributes, node.chunks, children),
        idle=node.value("idlen1", 30.0),
        top=node.value("maxn1", 100.0),
        beta_end=min(max(node.value("betarangeend", 0.0) / 100.0, 0.0), 0.99999),
        reverse_power=node.value("reversemaxpower", 0.0) / 100.0,
        power=node.need("maxpower").number(),
        consumption=node.value("psfc", 0.0),
        delay=(node.value("n1idle_max_delay", 1.0), node.value("itt_delay", 0.05)),
        start_time=node.value("maxstartingtime", 999999.0),
        starter=node.value("startern1", 20.0),
        torque=node.value("ielumaxtorque", -1.0),
    )
