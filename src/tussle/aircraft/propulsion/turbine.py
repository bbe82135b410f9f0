"""Turbine engine, with augmentation and injection of water."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.functions import content, expression
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench
from tussle.aircraft.propulsion.runtime import OFF, RUN, SEIZE, SPIN_UP, STALL, START, TRIM
from tussle.aircraft.propulsion.thruster import Thruster

FUNCTIONS = (
    "IdleThrust",
    "MilThrust",
    "AugThrust",
    "Injection",
    "N1SpoolUp",
    "N1SpoolDown",
    "N2SpoolUp",
    "N2SpoolDown",
)


@dataclass(frozen=True)
class Turbine:
    """A turbine.

    Attributes:
        node: Its element, for its functions.
        thrust: Military and augmented [lbf].
        bypass: Ratio.
        bleed: Share of the thrust that bleed air costs.
        idle: Speeds of the spools [%].
        top: Greatest speeds of the spools [%].
        ignition: Speeds to which the starter turns the spools [%].
        rates: Of spin-up and of start of both spools in turn [%/s].
        spin_down: Of both spools [1/s, inverse].
        windmills: Whether it turns when it is off.
        augmented: Whether it has an augmentor.
        method: 0 none, 1 at full throttle, 2 by a throttle above 1.
        injected: Whether it has water injection.
        injection: Seconds of water; increments of the spools [%].
        has_water: Whether there is water at the start.
    """

    node: Element
    thrust: tuple[float, float]
    bypass: float
    bleed: float
    idle: tuple[float, float]
    top: tuple[float, float]
    ignition: tuple[float, float]
    rates: tuple[float, float, float, float]
    spin_down: tuple[float, float]
    windmills: bool
    augmented: bool
    method: int
    injected: bool
    injection: tuple[float, float, float]
    has_water: bool
    burns = True

    def emit_start(self, bench: Bench, thruster: Thruster) -> None:
        """Emit that it runs."""
        bench.code.lines(f"""
{bench.slot("set-running")} = 1.0
{bench.state("cutoff", 1.0)} = 0.0
""")

    def emit(self, bench: Bench, thruster: Thruster) -> tuple[str, str]:
        """Emit its step. Return the thrust [lbf] and the fuel that it needs [lb]."""
        code, n = bench.code, bench.local
        n1, n2, norm = bench.slot("n1"), bench.slot("n2"), bench.state("n2norm")
        running, phase = bench.command("set-running"), bench.state("phase")
        starter, cutoff = bench.state("starter"), bench.state("cutoff", 1.0)
        starved = bench.state("starved")
        stalled, seized = bench.command("stalled"), bench.command("seized")
        qbar, now = bench.read("aero/qbar-psf"), n("phase")
        throttle, sprays = n("throttle"), self._sprays(bench)
        factor1 = f"({self.top[0] - self.idle[0]!r} + ({self.injection[1]!r} if {sprays} else 0.0))"
        factor2 = f"({self.top[1] - self.idle[1]!r} + ({self.injection[2]!r} if {sprays} else 0.0))"
        if sprays == "False":
            factor1, factor2 = repr(self.top[0] - self.idle[0]), repr(self.top[1] - self.idle[1])
        at = code.constant((
            *self.idle, *self.ignition, *self.rates, *self.spin_down, 1.0 if self.windmills else 0.0,
        ))  # fmt: skip
        up1, down1, up2, down2 = self._rates(bench, norm)
        code.lines(f"""
{throttle} = min({bench.throttle}, 1.0)
if {phase} == {TRIM!r} and {bench.dt} > 0.0:
    if {running} != 0.0 and {starved} == 0.0:
        {phase} = {RUN!r}
        {n2} = {self.idle[1]!r} + {throttle} * {self.top[1] - self.idle[1]!r}
        {n1} = {self.idle[0]!r} + {throttle} * {self.top[0] - self.idle[0]!r}
        {cutoff} = 0.0
    else:
        {phase} = {OFF!r}
        {cutoff} = 1.0
{phase} = turbine_phase({bench.dt}, {phase}, {running}, {starter}, {cutoff}, {starved}, {stalled}, {seized}, {n2}, {qbar})
{now} = {phase}
{n("thrust")} = 0.0
{n("n2_before")} = {n2}
if {now} == {RUN!r}:
    {running} = 1.0
    {starter} = 0.0
    {n2} = approach({n2}, {self.idle[1]!r} + {throttle} * {factor2}, {up2}, {down2}, {bench.dt})
    {n1} = approach({n1}, {self.idle[0]!r} + {throttle} * {factor1}, {up1}, {down1}, {bench.dt})
    {norm} = ({n2} - {self.idle[1]!r}) / {factor2}
    {n("share")} = {norm}
elif {now} == {TRIM!r}:
    {n("share")} = {throttle}
else:
    {n1}, {n2} = spool_idle(tables, {at}, {bench.dt}, {now}, {qbar}, {n1}, {n2})
    {n("share")} = 0.0
""")
        self._emit_thrust(bench, now, sprays)
        self._emit_others(bench, now)
        return n("thrust"), f"{bench.state('flow')} / 3600.0 * {bench.dt}"

    def emit_fed(self, bench: Bench) -> None:
        """Emit what changes where the engine gets fuel."""
        bench.write("fuel-flow-rate-pps", f"{bench.state('flow')} / 3600.0")

    def _sprays(self, bench: Bench) -> str:
        if not self.injected:
            return "False"
        water = bench.slot("InjWaterNorm", 1.0 if self.has_water else 0.0)
        return f"({bench.command('injection_cmd')} != 0.0 and {water} > 0.0)"

    def _rates(self, bench: Bench, norm: str) -> list[str]:
        """Emit the rates of the spools: N1 up and down, N2 up and down [%/s]."""
        names = [bench.name(each) for each in FUNCTIONS[4:]]
        given = [each.get("name") for each in self.node.find_all("function")]
        own = [any(each.endswith(leaf) for each in given) for leaf in FUNCTIONS[4:]]
        rate = bench.local("rate")
        if not all(own):
            sigma = bench.read("atmosphere/sigma")
            bench.code.line(f"{rate} = spool_rate({norm}, {self.bypass!r}, {sigma})")
        return [
            bench.read(name) if has else f"{rate} * {scale!r}"
            for name, has, scale in zip(names, own, (1.0, 2.4, 1.0, 3.0), strict=True)
        ]

    def _emit_thrust(self, bench: Bench, now: str, sprays: str) -> None:
        code, n = bench.code, bench.local
        flow, augments = bench.state("flow"), bench.state("augments")
        mil, most = self.thrust
        thrust, share = n("thrust"), n("share")
        bleed = bench.given("bleed-factor", self.bleed)
        least = math.pow(mil, 0.2) * 107.0
        with code.block(f"if {now} == {RUN!r} or {now} == {TRIM!r}"):
            code.lines(f"""
{n("idle")} = {mil!r} * {bench.read(bench.name("IdleThrust"))}
{thrust} = {n("idle")} + ({mil!r} - {n("idle")}) * {bench.read(bench.name("MilThrust"))} * {share} * {share}
if {now} == {TRIM!r}:
    {thrust} *= 1.0 - {bleed}
""")
            with code.block(f"elif {augments} == 0.0"):
                tsfc = self._consumption(bench)
                code.lines(f"""
{flow} = max(approach({flow}, {thrust} * {tsfc}, 1000.0, 10000.0, {bench.dt}), {least!r})
{thrust} *= 1.0 - {bleed}
""")
            self._emit_augmentation(bench, now, most)
            if self.injected:
                self._emit_injection(bench, now, sprays)

    def _emit_augmentation(self, bench: Bench, now: str, most: float) -> None:
        code, n = bench.code, bench.local
        flow, augments, thrust = bench.state("flow"), bench.state("augments"), n("thrust")
        if self.method == 1:
            speed = f"({self.idle[1]!r} + {n('throttle')} * {self.top[1] - self.idle[1]!r} if {now} == {TRIM!r} else {bench.slot('n2')})"
            code.line(f"{augments} = 1.0 if {n('throttle')} > 0.99 and {speed} > 97.0 else 0.0")
            if self.augmented:
                code.lines(f"""
if {augments} != 0.0:
    {thrust} = {most!r} * {bench.read(bench.name("AugThrust"))}
""")
        elif self.method == 2:
            code.lines(f"""
{n("augment")} = min(max({bench.throttle} - 1.0, 0.0), 1.0)
if {now} == {RUN!r}:
    {augments} = 1.0 if {n("augment")} > 0.0 else 0.0
{thrust} += ({most!r} * {bench.read(bench.name("AugThrust"))} - {thrust}) * {n("augment")}
""")
        else:
            return
        if self.method == 2 or self.augmented:
            with code.block(f"if {now} == {RUN!r} and {augments} != 0.0"):
                rate = _value(bench, self.node.find("atsfc"), 1.7)
                code.line(f"{flow} = approach({flow}, {thrust} * {rate}, 5000.0, 10000.0, {bench.dt})")

    def _emit_injection(self, bench: Bench, now: str, sprays: str) -> None:
        timer, water = (
            bench.slot("InjectionTimer"),
            bench.slot("InjWaterNorm", 1.0 if self.has_water else 0.0),
        )
        command, thrust = bench.command("injection_cmd"), bench.local("thrust")
        seconds = self.injection[0]
        names = [each.get("name") for each in self.node.find_all("function")]
        factor = bench.read(bench.name("Injection")) if any("Injection" in each for each in names) else "1.0"
        bench.code.lines(f"""
if {now} == {TRIM!r}:
    if {command} != 0.0:
        {thrust} *= {factor}
elif {sprays}:
    {timer} += {bench.dt}
    if {timer} < {seconds!r}:
        {thrust} *= {factor}
        {water} = 1.0 - {timer} / {seconds!r}
    else:
        {command} = 0.0
        {water} = 0.0
""")

    def _consumption(self, bench: Bench) -> str:
        """Expression of the fuel per thrust [lb/h/lbf]."""
        node = self.node.find("tsfc")
        if node is not None and content(node):
            return _value(bench, node, 0.8)
        value = 0.8 if node is None else node.number()
        norm, temperature = bench.state("n2norm"), bench.read("atmosphere/T-R")
        return f"{value!r} * math.sqrt({temperature} / 389.7) * (0.84 + (1.0 - {norm}) * (1.0 - {norm}))"

    def _emit_others(self, bench: Bench, now: str) -> None:
        """Emit flow and flags of the phases in which it does not run, and what follows one."""
        flow, augments, phase = bench.state("flow"), bench.state("augments"), bench.state("phase")
        running, starter, cutoff = (
            bench.slot("set-running"),
            bench.state("starter"),
            bench.state("cutoff", 1.0),
        )
        least, n2 = math.pow(self.thrust[0], 0.2) * 107.0, bench.slot("n2")
        stalled, before = bench.slot("stalled"), bench.local("n2_before")
        bench.code.lines(f"""
if {now} == {RUN!r}:
    {phase} = {OFF!r} if {cutoff} != 0.0 or {bench.state("starved")} != 0.0 else {RUN!r}
elif {now} == {OFF!r}:
    {running} = 0.0
    {flow} = approach({flow}, 0.0, 1000.0, 10000.0, {bench.dt})
    {augments} = 0.0
elif {now} == {SPIN_UP!r}:
    {running} = 0.0
    {flow} = 0.0
    {phase} = {SPIN_UP!r} if {starter} != 0.0 else {OFF!r}
elif {now} == {START!r}:
    if {before} <= 15.0:
        {phase} = {OFF!r}
        {starter} = 0.0
    elif {before} < {self.idle[1]!r}:
        {flow} = {least!r} * {n2} / {self.idle[1]!r}
        {phase} = {OFF!r} if {starter} == 0.0 and {bench.read("aero/qbar-psf")} < 30.0 else {START!r}
    else:
        {phase} = {RUN!r}
        {running} = 1.0
        {starter} = 0.0
elif {now} == {STALL!r}:
    {flow} = {least!r}
    if {bench.local("throttle")} < 0.01:
        {phase} = {RUN!r}
        {stalled} = 0.0
elif {now} == {SEIZE!r}:
    {flow} = 0.0 if {cutoff} != 0.0 else {least!r}
    {running} = 0.0
""")


def _value(bench: Bench, node: Element | None, default: float) -> str:
    if node is None:
        return repr(default)
    operands = content(node)
    return expression(bench.code, operands[0]) if operands else repr(node.number())


def read_turbine(node: Element) -> Turbine:
    """Read a <turbine_engine>.

    Raises:
        AircraftError: It lacks a function, or a number is wrong.
    """
    method, augmented = int(node.value("augmethod", 0.0)), int(node.value("augmented", 0.0)) == 1
    names = [each.get("name").split("/")[-1] for each in node.find_all("function")]
    needed = [
        "IdleThrust",
        "MilThrust",
        *(["AugThrust"] if method == 2 or (method == 1 and augmented) else []),
    ]
    for name in needed:
        if name not in names:
            raise node.error(f"it needs a function {name!r}")
    water = node.find("injection-time")
    idle = node.value("idlen1", 30.0), node.value("idlen2", 60.0)
    top = node.value("maxn1", 100.0), node.value("maxn2", 100.0)
    mil = node.value("milthrust", 10000.0, "LBS")
    if not (top[0] > idle[0] and top[1] > idle[1] and mil > 0.0):
        raise node.error("maxn1 and maxn2 must exceed idlen1 and idlen2, and milthrust 0")
    return Turbine(
        node=_renamed(node),
        thrust=(mil, node.value("maxthrust", 10000.0, "LBS")),
        bypass=node.value("bypassratio", 0.0),
        bleed=node.value("bleed", 0.0),
        idle=idle,
        top=top,
        ignition=(node.value("ignitionn1", 5.21), node.value("ignitionn2", 25.18)),
        rates=(
            node.value("n1spinup", 1.0),
            node.value("n2spinup", 3.0),
            node.value("n1startrate", 1.4),
            node.value("n2startrate", 2.0),
        ),
        spin_down=(node.value("n1spindown", 2.0), node.value("n2spindown", 2.0)),
        windmills=(
            node.find("disable-windmill") is None or node.need("disable-windmill").text not in ("1", "true")
        ),
        augmented=augmented,
        method=method,
        injected=int(node.value("injected", 0.0)) == 1,
        injection=(
            node.value("injection-time", 30.0),
            node.value("injection-N1-inc", 0.0),
            node.value("injection-N2-inc", 0.0),
        ),
        has_water=water is not None,
    )


def _renamed(node: Element) -> Element:
    """A copy whose functions of known names become properties of the engine."""
    children = []
    for each in node:
        attributes = dict(each.attributes)
        if each.tag == "function" and each.get("name") in FUNCTIONS:
            attributes["name"] = f"propulsion/engine[#]/{each.get('name')}"
        children.append(Element(each.tag, each.place, attributes, each.chunks, each.children))
    return Element(node.tag, node.place, node.attributes, node.chunks, children)
