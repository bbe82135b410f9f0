"""Thrusters: propeller, nozzle, and direct."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.functions import table
from tussle.aircraft.node import Element
from tussle.aircraft.propulsion.bench import Bench, given

Vector = tuple[float, float, float]
TABLES = ("C_THRUST", "C_POWER", "CT_MACH", "CP_MACH")


@dataclass(frozen=True)
class Mount:
    """Position and direction of a thruster.

    Attributes:
        location: In the structural frame [in].
        angles: Roll, pitch and yaw to the body [rad].
    """

    location: Vector
    angles: Vector

    def emit(self, bench: Bench) -> tuple[str, str, str]:
        """Emit the matrix from the thruster to the body, if it turns. Return the expressions of the thruster's axis in the body."""
        roll, pitch, yaw = self.angles
        turns = [
            bench.given("pitch-angle-rad", pitch),
            bench.given("yaw-angle-rad", yaw),
        ]
        if turns == [repr(pitch), repr(yaw)]:
            x, y, z = (repr(row[0]) for row in matrix(roll, pitch, yaw))
            return x, y, z
        cp, sp, cy, sy = (bench.local(each) for each in ("cp", "sp", "cy", "sy"))
        bench.code.lines(f"""
{cp} = cos({turns[0]})
{sp} = sin({turns[0]})
{cy} = cos({turns[1]})
{sy} = sin({turns[1]})
""")
        return f"{cp} * {cy}", f"{cp} * {sy}", f"-{sp}"

    def is_turned(self, bench: Bench) -> bool:
        """Return True if the thruster's frame is not that of the body."""
        _, pitch, yaw = self.angles
        turns = [bench.given("pitch-angle-rad", pitch), bench.given("yaw-angle-rad", yaw)]
        return any(self.angles) or turns != [repr(pitch), repr(yaw)]


def matrix(roll: float, pitch: float, yaw: float) -> tuple[Vector, Vector, Vector]:
    """Rotation from a frame with these angles to the body (Stevens & Lewis 2003, equation 1.4-3, transposed)."""
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    cy, sy = math.cos(yaw), math.sin(yaw)
    return (
        (cp * cy, sr * sp * cy - cr * sy, cr * sp * cy + sr * sy),
        (cp * sy, sr * sp * sy + cr * cy, cr * sp * sy - sr * cy),
        (-sp, sr * cp, cr * cp),
    )


@dataclass(frozen=True)
class Direct:
    """The engine's thrust acts as it is, turned by a reverser."""

    mount: Mount

    def emit(self, bench: Bench, push: str) -> None:
        """Emit thrust, force and moment from the engine's thrust [lbf]."""
        thrust = bench.slot("thrust-lbs")
        reverser = bench.given("reverser-angle-rad", 0.0)
        bench.code.line(f"{thrust} = {push}" if reverser == "0.0" else f"{thrust} = cos({reverser}) * {push}")
        emit_force(bench, self.mount, thrust)


@dataclass(frozen=True)
class Nozzle:
    """A rocket's nozzle.

    Attributes:
        mount: Where it sits.
        area: Of its exit [ft^2].
    """

    mount: Mount
    area: float

    def emit(self, bench: Bench, push: str) -> None:
        """Emit thrust, force and moment from the thrust in a vacuum [lbf] (Sutton & Biblarz 2010, equation 2-14)."""
        thrust = bench.slot("thrust-lbs")
        pressure = bench.read("atmosphere/P-psf")
        bench.code.line(f"{thrust} = max({push} - {pressure} * {self.area!r}, 0.0)")
        emit_force(bench, self.mount, thrust)


def emit_force(bench: Bench, mount: Mount, thrust: str, y: str = "", z: str = "") -> tuple[str, str, str]:
    """Add a thrust to force and moment of the propulsion; `y`, `z` are where it acts instead [in]. Return its axis in the body."""
    code = bench.code
    axis = mount.emit(bench)
    place = [repr(each) for each in mount.location]
    place = [place[0], y or place[1], z or place[2]]
    cg = [bench.read(f"inertia/cg-{each}-in") for each in "xyz"]
    fx, fy, fz, dx, dy, dz = (bench.local(each) for each in ("fx", "fy", "fz", "dx", "dy", "dz"))
    for name, share in zip((fx, fy, fz), axis, strict=True):
        code.line(f"{name} = {thrust}" if share == "1.0" else f"{name} = {share} * {thrust}")
    code.lines(f"""
{dx} = ({cg[0]} - {place[0]}) / 12.0
{dy} = ({place[1]} - {cg[1]}) / 12.0
{dz} = ({cg[2]} - {place[2]}) / 12.0
prop_fx += {fx}
prop_fy += {fy}
prop_fz += {fz}
prop_mx += {dy} * {fz} - {dz} * {fy}
prop_my += {dz} * {fx} - {dx} * {fz}
prop_mz += {dx} * {fy} - {dy} * {fx}
""")
    return axis


@dataclass(frozen=True)
class Propeller:
    """A propeller, of fixed pitch or with a governor.

    Attributes:
        node: Its element, for its tables.
        mount: Where it sits.
        inertia: About its axis [slug ft^2].
        diameter: [ft]
        gear: Revolutions of the engine for one of the propeller.
        pitch: Least and greatest blade angle [deg].
        reverse_pitch: Blade angle at full reverse [deg].
        rpm: Least and greatest speed that the governor is set to [1/min].
        is_governed: Whether a governor sets the blade angle.
        factors: Factors of thrust and power.
        sense: 1 clockwise seen from behind, else -1.
        p_factor: Shift of the thrust by oblique flow [in/rad].
        gyroscopic: Sign of the angular momentum; files of a version above 1 have it right.
    """

    node: Element
    mount: Mount
    inertia: float
    diameter: float
    gear: float
    pitch: tuple[float, float]
    reverse_pitch: float
    rpm: tuple[float, float]
    is_governed: bool
    factors: tuple[float, float]
    sense: float
    p_factor: float
    gyroscopic: float

    @property
    def is_variable(self) -> bool:
        """True if the blade angle can change."""
        return self.pitch[0] != self.pitch[1]

    def rpm_of(self, bench: Bench) -> str:
        """Variable of the propeller's speed [1/min]."""
        return bench.slot("propeller-rpm")

    def engine_rpm(self, bench: Bench) -> str:
        """Emit the engine's speed [1/min] at the begin of the step; return it."""
        name = bench.local("rpm")
        bench.code.line(f"{name} = {self.rpm_of(bench)} * {self.gear!r}")
        return name

    def emit(self, bench: Bench, power: str) -> None:
        """Emit thrust, force, moment and the propeller's speed from the power that the engine gives it [ft lbf/s]."""
        code, n = bench.code, bench.local
        rpm, thrust, torque = (
            self.rpm_of(bench),
            bench.slot("thrust-lbs"),
            bench.slot("propeller-torque-ftlb"),
        )
        rho = bench.read("atmosphere/rho-slugs_ft3")
        self._emit_flow(bench, rpm)
        if self.is_variable:
            pitch = bench.slot("blade-angle", self.pitch[0])
            self._emit_governor(bench, rpm, pitch)
            keys = [n("advance"), pitch]
        else:
            keys = [n("advance")]
        found = {each.get("name"): each for each in self.node.find_all("table")}
        values = []
        for letter, scale in zip("TP", self.factors, strict=True):
            value = table(code, found["C_THRUST" if letter == "T" else "C_POWER"], keys=keys)
            if scale != 1.0:
                value = f"{value} * {scale!r}"
            if f"C{letter}_MACH" in found:
                value += f" * {table(code, found[f'C{letter}_MACH'], keys=[n('tip')])}"
            values.append(value)
        d4 = self.diameter**4
        area = 0.25 * self.diameter * self.diameter * math.pi
        rps, u, total, induced = n("rps"), n("u"), n("total"), bench.slot("prop-induced-velocity_fps")
        code.lines(f"""
{n("ct")} = {values[0]}
{n("turns")} = max({rps}, 0.01)
{n("required")} = {values[1]} * {n("turns")} * {n("turns")} * {n("turns")} * {d4 * self.diameter!r} * {rho}
{thrust} = {n("ct")} * {rps} * {rps} * {d4!r} * {rho}
{total} = {u} * abs({u}) + 2.0 * {thrust} / ({rho} * {area!r})
{induced} = 0.5 * (-{u} + math.sqrt({total})) if {total} > 0.0 else 0.5 * (-{u} - math.sqrt(-{total}))
""")
        y, z = self._emit_oblique_flow(bench, induced)
        axis = emit_force(bench, self.mount, thrust, y, z)
        omega = n("omega")
        code.lines(f"""
{omega} = {rps} * {2.0 * math.pi!r}
{torque} = {-self.sense!r} * {power} / max(0.01, {omega})
{n("momentum")} = {self.inertia * self.sense * self.gyroscopic!r} * {omega}
{n("excess")} = ({power} - {n("required")}) / ({omega} if {omega} > 0.01 else 1.0)
{rpm} = max(({rps} + {n("excess")} / {self.inertia!r} / {2.0 * math.pi!r} * {bench.dt}) * 60.0, 0.0)
""")
        spins = [bench.read(f"velocities/{each}i-rad_sec") for each in "pqr"]
        h = [code.temporary(f"({share}) * {n('momentum')}") if share != "0.0" else "0.0" for share in axis]
        for k, (share, moment) in enumerate(zip(axis, ("prop_mx", "prop_my", "prop_mz"), strict=True)):
            i, j = (k + 1) % 3, (k + 2) % 3
            code.line(f"{moment} += {spins[i]} * {h[j]} - {spins[j]} * {h[i]} + ({share}) * {torque}")
        bench.write("engine-rpm", f"{rpm} * {self.gear!r}")
        bench.write("advance-ratio", n("advance"))
        bench.write("thrust-coefficient", n("ct"))
        bench.write("helical-tip-Mach", n("tip"))
        bench.write("propeller-power-ftlbps", n("required"))

    def _emit_flow(self, bench: Bench, rpm: str) -> None:
        """Emit the air's velocity at the hub (Stevens & Lewis 2003, equation 8.2-1), the advance ratio and the Mach number of the tips."""
        code, n = bench.code, bench.local
        cg = [bench.read(f"inertia/cg-{each}-in") for each in "xyz"]
        x, y, z = self.mount.location
        u, v, w = (bench.read(f"velocities/{each}-aero-fps") for each in "uvw")
        p, q, r = (bench.read(f"velocities/{each}-aero-rad_sec") for each in "pqr")
        code.lines(f"""
{n("dx")} = ({cg[0]} - {x!r}) / 12.0
{n("dy")} = ({y!r} - {cg[1]}) / 12.0
{n("dz")} = ({cg[2]} - {z!r}) / 12.0
{n("u")} = {u} + {q} * {n("dz")} - {r} * {n("dy")}
{n("v")} = {v} + {r} * {n("dx")} - {p} * {n("dz")}
{n("w")} = {w} + {p} * {n("dy")} - {q} * {n("dx")}
""")
        if self.mount.is_turned(bench):
            self._emit_turn(bench)
        d, rps = self.diameter, n("rps")
        code.lines(f"""
{rps} = {rpm} / 60.0
{n("advance")} = {n("u")} / ({d!r} * {rps}) if {rps} > 0.01 else {n("u")} / {d!r}
{n("blade")} = {rps} * {d * math.pi!r}
{n("tip")} = math.sqrt({n("blade")} * {n("blade")} + {n("u")} * {n("u")}) / {bench.read("atmosphere/a-fps")}
""")

    def _emit_turn(self, bench: Bench) -> None:
        code, n = bench.code, bench.local
        roll, pitch, yaw = self.mount.angles
        angles = [bench.given("pitch-angle-rad", pitch), bench.given("yaw-angle-rad", yaw)]
        if angles == [repr(pitch), repr(yaw)]:
            m = [[repr(each) for each in row] for row in matrix(roll, pitch, yaw)]
        else:
            self.mount.emit(bench)
            cp, sp, cy, sy = (n(each) for each in ("cp", "sp", "cy", "sy"))
            cr, sr = repr(math.cos(roll)), repr(math.sin(roll))
            m = [
                [
                    f"{cp} * {cy}",
                    f"({sr} * {sp} * {cy} - {cr} * {sy})",
                    f"({cr} * {sp} * {cy} + {sr} * {sy})",
                ],
                [
                    f"{cp} * {sy}",
                    f"({sr} * {sp} * {sy} + {cr} * {cy})",
                    f"({cr} * {sp} * {sy} - {sr} * {cy})",
                ],
                [f"-{sp}", f"{sr} * {cp}", f"{cr} * {cp}"],
            ]
        names = [n("u"), n("v"), n("w")]
        turned = [code.temporary(" + ".join(f"{m[i][k]} * {names[i]}" for i in range(3))) for k in range(3)]
        for name, value in zip(names, turned, strict=True):
            code.line(f"{name} = {value}")

    def _emit_governor(self, bench: Bench, rpm: str, pitch: str) -> None:
        """Emit the blade angle: set by a governor, by the throttle in reverse, or to feather."""
        code = bench.code
        low, high = self.pitch
        mode = bench.given("constant-speed-mode", 1.0 if self.is_governed else 0.0)
        if mode == "0.0":
            return
        i = bench.index
        advance = bench.read(f"fcs/advance-pos-norm[{i}]") if bench.has_levers else "0.0"
        feather = given(code, f"fcs/feather-pos-norm[{i}]", 0.0) if bench.has_levers else "0.0"
        with code.block(f"if {mode} == 0.0"):
            code.line("pass")
        with code.block(f"elif {feather} != 0.0"):
            code.line(f"{pitch} += ({high!r} - {pitch}) / 300.0")
        reversed_, coefficient = bench.local("is_reversed"), bench.local("reverse")
        if bench.is_reversible:
            with code.block(f"elif {reversed_}"):
                code.lines(f"""
if {rpm} > 200.0:
    {pitch} += ({low!r} - {low - self.reverse_pitch!r} * {coefficient} - {pitch}) / 200.0
if {rpm} > {self.rpm[1]!r}:
    {pitch} += ({self.rpm[1]!r} - {rpm}) / 50.0
    {pitch} = min(max({pitch}, {self.reverse_pitch!r}), {high!r})
""")
        with code.block("else"):
            code.lines(f"""
if {rpm} > 200.0:
    {pitch} -= ({self.rpm[0]!r} + {self.rpm[1] - self.rpm[0]!r} * {advance} - {rpm}) * {bench.dt}
{pitch} = min(max({pitch}, {low!r}), {high!r})
""")

    def _emit_oblique_flow(self, bench: Bench, induced: str) -> tuple[str, str]:
        """Emit where the thrust acts [in]: oblique flow shifts it."""
        if not self.p_factor > 0.0001:
            return "", ""
        code, n = bench.code, bench.local
        _, y, z = self.mount.location
        code.lines(f"""
{n("y")} = {y!r}
{n("z")} = {z!r}
{n("across")} = math.sqrt({n("v")} * {n("v")} + {n("w")} * {n("w")})
if {n("across")} > 0.0001:
    {n("shift")} = {self.sense * self.p_factor!r} * atan2({n("across")}, {n("u")} + {induced}) / {n("across")}
    {n("y")} += {n("shift")} * {n("w")}
    {n("z")} += {n("shift")} * {n("v")}
""")
        return n("y"), n("z")


Thruster = Direct | Nozzle | Propeller


def read_thruster(node: Element, file: Element) -> Thruster:
    """Read a <thruster> and the content of its file.

    Raises:
        AircraftError: Its kind is not supported, or it lacks something.
    """
    location, orient = node.find("location"), node.find("orient")
    if node.find("pointing") is not None:
        raise node.error("<pointing> is not supported; give <orient>")
    mount = Mount(
        (0.0, 0.0, 0.0) if location is None else location.vector("IN"),
        (0.0, 0.0, 0.0) if orient is None else orient.vector("RAD", ("roll", "pitch", "yaw")),
    )
    match file.tag:
        case "direct":
            return Direct(mount)
        case "nozzle":
            file.need("area")
            return Nozzle(mount, file.value("area", 0.0, "FT2"))
        case "propeller":
            return _read_propeller(node, file, mount)
    raise file.error("this thruster is not supported; there are: direct, nozzle, propeller")


def _read_propeller(node: Element, file: Element, mount: Mount) -> Propeller:
    names = [each.get("name") for each in file.find_all("table")]
    missing = [name for name in TABLES[:2] if name not in names]
    if missing:
        raise file.error(f"it needs a table {missing[0]!r}")
    file.need("diameter")
    p_factor = node.value("p_factor", 0.0)
    if p_factor < 0.0:
        raise node.error("p_factor is negative")
    max_rpm = file.find("maxrpm")
    return Propeller(
        node=file,
        mount=mount,
        inertia=max(file.value("ixx", 0.0, "SLUG*FT2"), 1e-6),
        diameter=max(file.value("diameter", 0.0, "FT"), 0.001),
        gear=max(file.value("gearratio", 1.0), 0.001),
        pitch=(file.value("minpitch", 0.0), file.value("maxpitch", 0.0)),
        reverse_pitch=file.value("reversepitch", 0.0),
        rpm=(file.value("minrpm", 0.0), file.value("maxrpm", 0.0)),
        is_governed=int(file.value("constspeed", 0.0 if max_rpm is None else 1.0)) != 0,
        factors=(file.value("ct_factor", 1.0), file.value("cp_factor", 1.0)),
        sense=1.0 if node.value("sense", 1.0) >= 0.0 else -1.0,
        p_factor=p_factor,
        gyroscopic=-1.0 if file.attribute_number("version", 1.0) > 1.0 else 1.0,
    )
