"""External forces and moments."""

from __future__ import annotations

import math

from tussle.aircraft.aerodynamics import WIND_TO_BODY, turned
from tussle.aircraft.code import Code
from tussle.aircraft.functions import emit_function
from tussle.aircraft.node import Element
from tussle.errors import clipped
from tussle.numeric import total

LOCAL_TO_BODY = (("l11", "l12", "l13"), ("l21", "l22", "l23"), ("l31", "l32", "l33"))
INERTIAL_TO_BODY = (("m11", "m12", "m13"), ("m21", "m22", "m23"), ("m31", "m32", "m33"))
BODY = (("1.0", "0.0", "0.0"), ("0.0", "1.0", "0.0"), ("0.0", "0.0", "1.0"))
FRAMES = {"BODY": BODY, "LOCAL": LOCAL_TO_BODY, "WIND": WIND_TO_BODY, "INERTIAL": INERTIAL_TO_BODY}


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
    if frame not in FRAMES:
        raise node.error(f"frame {clipped(frame)!r} is not known; there are: {', '.join(FRAMES)}")
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
    x, y, z = (code.temporary(each) for each in turned(FRAMES[frame], (vector[0], vector[1], vector[2])))
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
