"""Reference lengths, aerodynamics, and other forces and moments from outside."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.code import Code
from tussle.aircraft.equations import offer
from tussle.aircraft.functions import emit_function, expression, only
from tussle.aircraft.node import Element
from tussle.errors import clipped
from tussle.numeric import total


@dataclass(frozen=True)
class Metrics:
    """Reference lengths [ft], areas [ft^2], incidence of the wing [rad], places in the structural frame [in]."""

    area: float
    span: float
    chord: float
    incidence: float
    tail_arm: float
    tail_area: float
    fin_arm: float
    fin_area: float
    reference: tuple[float, float, float]
    eye: tuple[float, float, float]
    visual: tuple[float, float, float]


def read_metrics(node: Element) -> Metrics:
    """Read <metrics>.

    Raises:
        AircraftError: A number is none.
    """
    places = {each.get("name"): each.vector("IN") for each in node.find_all("location")}
    zero = 0.0, 0.0, 0.0
    return Metrics(
        node.value("wingarea", 0.0, "FT2"), node.value("wingspan", 0.0, "FT"), node.value("chord", 0.0, "FT"),
        node.value("wing_incidence", 0.0, "RAD"), node.value("htailarm", 0.0, "FT"), node.value("htailarea", 0.0, "FT2"),
        node.value("vtailarm", 0.0, "FT"), node.value("vtailarea", 0.0, "FT2"),
        places.get("AERORP", zero), places.get("EYEPOINT", zero), places.get("VRP", zero),
    )  # fmt: skip


def offer_metrics(code: Code, m: Metrics) -> None:
    """Make the properties of the metrics constants."""
    code.constants |= {
        "metrics/Sw-sqft": m.area, "metrics/bw-ft": m.span, "metrics/cbarw-ft": m.chord, "metrics/iw-rad": m.incidence,
        "metrics/iw-deg": math.degrees(m.incidence), "metrics/lh-ft": m.tail_arm, "metrics/Sh-sqft": m.tail_area,
        "metrics/lv-ft": m.fin_arm, "metrics/Sv-sqft": m.fin_area,
        "metrics/aero-rp-x-in": m.reference[0], "metrics/aero-rp-y-in": m.reference[1], "metrics/aero-rp-z-in": m.reference[2],
        "metrics/eyepoint-x-in": m.eye[0], "metrics/eyepoint-y-in": m.eye[1], "metrics/eyepoint-z-in": m.eye[2],
        "metrics/visualrefpoint-x-in": m.visual[0], "metrics/visualrefpoint-y-in": m.visual[1], "metrics/visualrefpoint-z-in": m.visual[2],
    }  # fmt: skip
    if m.chord:
        code.constants |= {"metrics/lh-norm": m.tail_arm / m.chord, "metrics/lv-norm": m.fin_arm / m.chord}
        if m.area:
            code.constants["metrics/vbarh-norm"] = m.tail_arm * m.tail_area / (m.chord * m.area)
    if m.span and m.area:
        code.constants["metrics/vbarv-norm"] = m.fin_arm * m.fin_area / (m.span * m.area)


FORCES = {"DRAG": 0, "SIDE": 1, "LIFT": 2, "AXIAL": 0, "NORMAL": 2, "X": 0, "Y": 1, "Z": 2}
MOMENTS = {"ROLL": 0, "PITCH": 1, "YAW": 2}
FRAMES = ("BODY", "WIND", "STABILITY")
WIND_TO_BODY = (
    ("ca * cb", "-ca * sb", "-sa"),
    ("sb", "cb", "0.0"),
    ("sa * cb", "-sa * sb", "ca"),
)
STABILITY_TO_BODY = (("ca", "0.0", "-sa"), ("0.0", "1.0", "0.0"), ("sa", "0.0", "ca"))


def turned(rows: tuple[tuple[str, ...], ...], vector: tuple[str, str, str]) -> list[str]:
    """Expressions of a matrix times a vector."""
    made = []
    for row in rows:
        terms = [
            each if factor == "1.0" else f"{factor} * {each}"
            for factor, each in zip(row, vector, strict=True)
            if factor != "0.0" and each != "0.0"
        ]
        made.append(" + ".join(terms) or "0.0")
    return made


class Axes:
    """The axes of <aerodynamics>: their frames, and their functions in JSBSim's order."""

    def __init__(self, node: Element) -> None:
        self.forces, self.moments = "WIND", "BODY"
        self.by_axis: dict[int, Element] = {}
        for axis in node.find_all("axis"):
            name, frame = axis.get("name"), (axis.get("frame") or "BODY").upper()
            if frame not in FRAMES:
                raise axis.error(f"frame {clipped(frame)!r} is not known; there are: {', '.join(FRAMES)}")
            if name in MOMENTS:
                self.by_axis[3 + MOMENTS[name]] = axis
                self.moments = frame
            elif name in FORCES:
                self.by_axis[FORCES[name]] = axis
                if name in ("X", "Y", "Z"):
                    self.forces = frame
                elif name in ("AXIAL", "NORMAL"):
                    self.forces = "AXIAL"
            else:
                raise axis.error(
                    f"axis {clipped(name)!r} is not known; there are: {', '.join((*FORCES, *MOMENTS))}"
                )


def emit_aerodynamics(code: Code, node: Element | None, metrics: Metrics) -> None:
    """Emit the locals aero_fx, _fy, _fz [lbf] and aero_mx, _my, _mz [lbf ft].

    Raises:
        AircraftError: Something is not supported.
    """
    area, span, chord = metrics.area, metrics.span, metrics.chord
    lift, squared = code.state("lift"), code.state("lift-squared")
    with code.block("if dynamic > 1.0"):
        code.line(f"{squared} = {lift} / ({area or 1.0!r} * dynamic)")
        code.line(f"{squared} *= {squared}")
    by_span, by_chord = code.state("span-by-two-speeds"), code.state("chord-by-two-speeds")
    with code.block("if speed != 0.0"):
        code.line(f"{by_span} = {span!r} / (2.0 * speed)")
        code.line(f"{by_chord} = {chord!r} / (2.0 * speed)")
    offer(code, {
        "forces/load-factor": f"{lift} / weight",
        "aero/cl-squared": squared, "aero/bi2vel": by_span, "aero/ci2vel": by_chord, "aero/qbar-area": f"dynamic * {area!r}",
        "aero/alpha-wing-rad": f"alpha + {metrics.incidence!r}",
    })  # fmt: skip
    sums = ["0.0"] * 6
    at_center = ["0.0"] * 3
    axes = None if node is None else Axes(node)
    if node is not None and axes is not None:
        for each in node.find_all("function"):
            emit_function(code, each)
        _emit_hysteresis(code, node)
        for k in range(6):
            if k in axes.by_axis:
                plain, central = _axis_sums(code, axes.by_axis[k], k)
                sums[k] = plain
                if k < 3:
                    at_center[k] = central
        shift = node.find("aero_ref_pt_shift_x")
        if shift is not None:
            code.line(f"ref_x -= {chord!r} * ({expression(code, only(shift.need('function')))})")
    _emit_sum(code, axes, sums, at_center, lift)


def _axis_sums(code: Code, axis: Element, k: int) -> tuple[str, str]:
    """Emit the functions of an axis; return their sums, and those that act at the centre of gravity."""
    plain: list[str] = []
    central: list[str] = []
    for each in axis.find_all("function"):
        (central if each.get("apply_at_cg") == "true" and k < 3 else plain).append(emit_function(code, each))
    code.line(f"axis_{k} = {' + '.join(plain) or '0.0'}")
    return f"axis_{k}", " + ".join(central) or "0.0"


def _emit_hysteresis(code: Code, node: Element) -> None:
    limits = node.find("hysteresis_limits")
    name = "aero/stall-hyst-norm"
    stalled = code.state("stalled")
    if limits is not None:
        low, high = limits.value("min", 0.0, "RAD"), limits.value("max", 0.0, "RAD")
        if low and high:
            with code.block(f"if alpha > {high!r}"):
                code.line(f"{stalled} = 1.0")
            with code.block(f"elif alpha < {low!r}"):
                code.line(f"{stalled} = 0.0")
    code.write(name, stalled)


def _emit_sum(code: Code, axes: Axes | None, sums: list[str], at_center: list[str], lift: str) -> None:
    def to_body(vector: list[str]) -> list[str]:
        x, y, z = vector
        match axes.forces if axes else "WIND":
            case "WIND":
                return turned(WIND_TO_BODY, (f"(-{x})", y, f"(-{z})"))
            case "STABILITY":
                return turned(STABILITY_TO_BODY, (f"(-{x})", y, f"(-{z})"))
            case "AXIAL":
                return [f"-{x}", y, f"-{z}"]
        return vector

    for axis, text in zip("xyz", to_body(sums[:3]), strict=True):
        code.line(f"aero_f{axis} = {text}")
    moments = (sums[3], sums[4], sums[5])
    turns = {"WIND": WIND_TO_BODY, "STABILITY": STABILITY_TO_BODY}.get(axes.moments if axes else "")
    mx, my, mz = turned(turns, moments) if turns else moments
    code.lines(f"""
aero_mx = {mx} + ref_y * aero_fz - ref_z * aero_fy
aero_my = {my} + ref_z * aero_fx - ref_x * aero_fz
aero_mz = {mz} + ref_x * aero_fy - ref_y * aero_fx
""")
    if any(each != "0.0" for each in at_center):
        for axis, each in zip("xyz", at_center, strict=True):
            code.line(f"center_{axis} = {each}")
        for axis, text in zip("xyz", to_body(["center_x", "center_y", "center_z"]), strict=True):
            code.line(f"aero_f{axis} += {text}")
    code.line(f"{lift} = sa * aero_fx - ca * aero_fz")
    code.line("wind_fx = ca * cb * aero_fx + sb * aero_fy + sa * cb * aero_fz")
    code.line("wind_fy = -ca * sb * aero_fx + cb * aero_fy - sa * sb * aero_fz")
    offer(code, {
        "forces/fbx-aero-lbs": "aero_fx", "forces/fby-aero-lbs": "aero_fy", "forces/fbz-aero-lbs": "aero_fz",
        "moments/l-aero-lbsft": "aero_mx", "moments/m-aero-lbsft": "aero_my", "moments/n-aero-lbsft": "aero_mz",
        "forces/fwx-aero-lbs": "-wind_fx", "forces/fwy-aero-lbs": "wind_fy", "forces/fwz-aero-lbs": lift,
        "forces/lod-norm": f"quotient({lift}, -wind_fx)",
    })  # fmt: skip


LOCAL_TO_BODY = (("l11", "l12", "l13"), ("l21", "l22", "l23"), ("l31", "l32", "l33"))
INERTIAL_TO_BODY = (("m11", "m12", "m13"), ("m21", "m22", "m23"), ("m31", "m32", "m33"))
BODY = (("1.0", "0.0", "0.0"), ("0.0", "1.0", "0.0"), ("0.0", "0.0", "1.0"))
FORCE_FRAMES = {"BODY": BODY, "LOCAL": LOCAL_TO_BODY, "WIND": WIND_TO_BODY, "INERTIAL": INERTIAL_TO_BODY}


def emit_external(code: Code, node: Element | None) -> None:
    """Emit the locals ext_fx ... ext_mz of <external_reactions>.

    Raises:
        AircraftError: A frame is not known.
    """
    code.line("ext_fx = ext_fy = ext_fz = ext_mx = ext_my = ext_mz = 0.0")
    for each in node or ():
        if each.tag == "property":
            code.initial.setdefault(each.text, each.attribute_number("value", 0.0))
            code.inputs.add(each.text)
        elif each.tag == "function":
            emit_function(code, each)
        elif each.tag in ("force", "moment"):
            _emit_one(code, each)
        elif each.tag not in ("description", "documentation"):
            raise each.error("it is not supported; there are: force, moment, function, property")


def _emit_one(code: Code, node: Element) -> None:
    is_moment = node.tag == "moment"
    name, letters = f"external_reactions/{node.get('name')}", "lmn" if is_moment else "xyz"
    frame = (node.get("frame") or "BODY").upper()
    if frame not in FORCE_FRAMES:
        raise node.error(f"frame {clipped(frame)!r} is not known; there are: {', '.join(FORCE_FRAMES)}")
    function = node.find("function")
    size = f"{name}/magnitude-lbsft" if is_moment else f"{name}/magnitude"
    if function is not None:
        amount = emit_function(code, function)
    else:
        code.initial.setdefault(size, 0.0)
        code.inputs.add(size)
        amount = code.read(size)
    direction = node.find("direction")
    ways = direction.vector("IN") if direction else (0.0, 0.0, 0.0)
    length = math.sqrt(total(way * way for way in ways)) or 1.0
    vector = []
    for letter, way in zip(letters, ways, strict=True):
        code.initial.setdefault(f"{name}/{letter}", way / length)
        code.inputs.add(f"{name}/{letter}")
        vector.append(code.temporary(f"{amount} * {code.read(f'{name}/{letter}')}"))
    x, y, z = (
        code.temporary(each) for each in turned(FORCE_FRAMES[frame], (vector[0], vector[1], vector[2]))
    )
    if is_moment:
        code.line(f"ext_mx += {x}")
        code.line(f"ext_my += {y}")
        code.line(f"ext_mz += {z}")
        return
    place = node.find("location")
    arm = []
    for letter, inches in zip("xyz", place.vector("IN") if place else (0.0, 0.0, 0.0), strict=True):
        full = f"{name}/location-{letter}-in"
        code.initial.setdefault(full, inches)
        code.inputs.add(full)
        arm.append(code.read(full))
    code.lines(f"""
arm_x = (cg_x - {arm[0]}) / 12.0
arm_y = ({arm[1]} - cg_y) / 12.0
arm_z = (cg_z - {arm[2]}) / 12.0
ext_fx += {x}
ext_fy += {y}
ext_fz += {z}
ext_mx += arm_y * {z} - arm_z * {y}
ext_my += arm_z * {x} - arm_x * {z}
ext_mz += arm_x * {y} - arm_y * {x}
""")
