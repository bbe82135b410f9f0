"""Landing gear and other contacts of an aircraft with the ground."""

from __future__ import annotations

import math
from dataclasses import dataclass

from tussle.aircraft.code import Code
from tussle.aircraft.contact import MEMORY
from tussle.aircraft.equations import offer
from tussle.aircraft.functions import emit_function
from tussle.aircraft.mass import indexed
from tussle.aircraft.node import Element
from tussle.errors import clipped

MAX_CONTACTS = 64
BRAKES = {"LEFT": "left", "RIGHT": "right", "CENTER": "center"}
CASTERS = 360.0


@dataclass(frozen=True)
class Contact:
    """A contact: its numbers in the order of `contact.PARAMETERS`, largest steering angle [deg], brake, and whether it retracts."""

    numbers: tuple[float, ...]
    steering: float
    brake: str
    retracts: bool
    strut: Element | None = None

    @property
    def is_wheel(self) -> bool:
        return self.numbers[3] != 0.0


def read_ground(node: Element | None) -> list[Contact]:
    """Read <ground_reactions>.

    Raises:
        AircraftError: Something is not supported, or there are too many contacts.
    """
    if node is None:
        return []
    contacts = [_contact(each) for each in node.find_all("contact")]
    if len(contacts) > MAX_CONTACTS:
        raise node.error(f"it has {len(contacts)} contacts; the limit is {MAX_CONTACTS}")
    return contacts


def _contact(node: Element) -> Contact:
    kind = node.get("type")
    if kind not in ("BOGEY", "STRUCTURE"):
        raise node.error(f"contact type {clipped(kind)!r} is not known; there are: BOGEY, STRUCTURE")
    for tag in ("table", "orientation"):
        if node.find(tag) is not None:
            raise node.need(tag).error("it is not supported in a contact")
    damping, rebound = node.find("damping_coeff"), node.find("damping_coeff_rebound")
    rebound = rebound or damping
    numbers = (
        *node.need("location").vector("IN"), float(kind == "BOGEY"), node.value("spring_coeff", 1.0, "LBS/FT"),
        *_damping(damping), *_damping(rebound), node.value("static_friction", 0.0), node.value("dynamic_friction", 0.0),
        node.value("rolling_friction", 0.0), node.value("maximum_force", math.inf) or math.inf,
    )  # fmt: skip
    retracts = node.find("retractable")
    group = node.find("brake_group")
    steer = node.find("max_steer")
    return Contact(
        tuple(min(number, 1e300) for number in numbers), steer.number("DEG") if steer else 0.0,
        BRAKES.get(group.text.upper() if group else "", ""),
        retracts is not None and retracts.number() > 0.0, node.find("strut_force"),
    )  # fmt: skip


def _damping(node: Element | None) -> tuple[float, float]:
    if node is None:
        return 1.0, 0.0
    is_square = node.get("type").upper() == "SQUARE"
    return node.number("LBS/FT2/SEC2" if is_square else "LBS/FT/SEC"), float(is_square)


def offer_steering(code: Code, contacts: list[Contact]) -> None:
    """Emit the steering angles that the command gives, before the flight control may change them."""
    command = code.read("fcs/steer-cmd-norm")
    for k, each in enumerate(contacts):
        if each.is_wheel and 0.0 < each.steering < CASTERS:
            code.write(indexed("fcs/steer-pos-deg", k), f"{command} * {each.steering!r}")


def emit_ground(code: Code, contacts: list[Contact]) -> str:
    """Emit the locals gear_fx ... gear_mz; return the text of the friction, which belongs between the rates and the accelerations."""
    names = ("gear_fx", "gear_fy", "gear_fz", "gear_mx", "gear_my", "gear_mz")
    code.line(f"{' = '.join(names)} = 0.0")
    code.line("touching = 0.0")
    if not contacts:
        offer(code, {"gear/wow": "touching"})
        return ""
    code.line("# Contacts, if one may be near the ground.")
    reach = max(math.dist((0.0, 0.0, 0.0), each.numbers[:3]) for each in contacts) / 12.0
    code.line(
        f"near_ground = above_ground < {reach!r} + math.sqrt(cg_x * cg_x + cg_y * cg_y + cg_z * cg_z) / 12.0"
    )
    memory = [[code.state(f"contact {k} {what}") for what in MEMORY] for k in range(len(contacts))]
    at = code.constant([number for each in contacts for number in each.numbers])
    with code.block("if near_ground"):
        for k, each in enumerate(contacts):
            values = [*memory[k], *_settings(code, k, each)]
            for j, value in enumerate(values):
                code.line(f"gear[{k}, {j}] = {value}")
            code.line(f"gear[{k}, 10] = math.nan")
        code.line("motion = (u, v, w, p, q, r)")
        call = (f"{', '.join(names)}, touching = touch_all(tables, {at}, work, gear, (cg_x, cg_y, cg_z), (rx, ry, rz), "
                "(m11, m12, m13, m21, m22, m23, m31, m32, m33), (down_x, down_y, -sin_lat), motion, dt)")  # fmt: skip
        functions = {k: each.strut for k, each in enumerate(contacts) if each.strut is not None}
        if functions:
            code.line(call)
            for k, strut in functions.items():
                unit = indexed("gear/unit", k)
                code.write(f"{unit}/compression-ft", f"gear[{k}, 5]")
                code.write(f"{unit}/compression-velocity-fps", f"gear[{k}, 6]")
                code.line(f"gear[{k}, 10] = min({emit_function(code, strut.need('function'))}, 0.0)")
        code.line(call)
        for k, kept in enumerate(memory):
            for j in range(3, len(MEMORY)):
                code.line(f"{kept[j]} = gear[{k}, {j}]")
    with code.block("else"):
        for kept in memory:
            code.line(f"{' = '.join(kept)} = 0.0")
    for k, (_, _, _, slip, touches, length, speed) in enumerate(memory):
        unit = indexed("gear/unit" if contacts[k].is_wheel else "contact/unit", k)
        offer(code, {f"{unit}/WOW": touches, f"{unit}/compression-ft": length, f"{unit}/slip-angle-deg": slip,
                     f"{unit}/compression-velocity-fps": speed})  # fmt: skip
    offer(code, {"gear/wow": "touching"})
    return _friction(memory)


def _settings(code: Code, k: int, contact: Contact) -> tuple[str, str, str]:
    """Expressions of steering angle [rad], brake, and altitude of the ground [ft]."""
    steering = "0.0"
    if contact.is_wheel and contact.steering >= CASTERS:
        steering = "math.nan"
    elif contact.is_wheel and contact.steering:
        steering = f"{code.read(indexed('fcs/steer-pos-deg', k))} * {math.pi / 180.0!r}"
    brake = code.read(f"fcs/{contact.brake}-brake-cmd-norm") if contact.brake else "0.0"
    level = code.read("position/terrain-elevation-asl-ft")
    if contact.retracts:
        level = f"{level} if {code.read('gear/gear-pos-norm')} > 0.99 else -1e9"
    return steering, brake, level


def _friction(memory: list[list[str]]) -> str:
    lines = ["if near_ground and touching != 0.0:",
             "    rates = (udot_free, vdot_free, wdot_free, pdot, qdot, rdot)",
             "    hold = friction(work, matrix, mass, (i11, i12, i13, i22, i23, i33), rates, motion, dt)",
             "    bx += hold[0] / mass", "    by += hold[1] / mass", "    bz += hold[2] / mass",
             "    turn_x = i11 * hold[3] + i12 * hold[4] + i13 * hold[5]",
             "    turn_y = i12 * hold[3] + i22 * hold[4] + i23 * hold[5]",
             "    turn_z = i13 * hold[3] + i23 * hold[4] + i33 * hold[5]",
             "    pidot += turn_x", "    qidot += turn_y", "    ridot += turn_z",
             "    pdot += turn_x", "    qdot += turn_y", "    rdot += turn_z", "    remember(work, gear)"]  # fmt: skip
    for k, axis in enumerate("xyz"):
        for kind, j in (("f", k), ("m", k + 3)):
            lines.append(f"    gear_{kind}{axis} += hold[{j}]")
            lines.append(f"    {'force' if kind == 'f' else 'moment'}_{axis} += hold[{j}]")
    lines += [f"    {kept[j]} = gear[{k}, {j}]" for k, kept in enumerate(memory) for j in range(3)]
    return "\n".join(lines)
