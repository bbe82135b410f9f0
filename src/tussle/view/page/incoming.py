"""What a page takes from a browser: messages of these types, with these fields, and the values that its controls offer."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

Check = Callable[[Any], bool]

FARTHEST = 1e12
"""Of any coordinate and length [m]."""
NEAREST = 1e-9
"""That a camera may be to what it looks at [m]."""
LONGEST = 200
"""Of any name."""
BY_TURNS = {"Run": ("Play", "Pause")}
"""Label of a control -> what it offers by turns: who clicks as it changes means what was read."""
SHOWN = 40
"""Characters of a refused value in the words about it."""


def number(low: float = -FARTHEST, high: float = FARTHEST) -> Check:
    """A number in a range; nan is in none."""
    return lambda value: type(value) in (int, float) and low <= value <= high


def whole_number(low: int, high: int) -> Check:
    """A whole number in a range, however it is written."""
    return lambda value: number(low, high)(value) and value == int(value)


def one_of(*values: Any) -> Check:
    """One of these, and of the same type."""
    return lambda value: any(type(value) is type(v) and value == v for v in values)


def text(value: Any) -> bool:
    """A text that may be a name."""
    return isinstance(value, str) and len(value) <= LONGEST


def vector(n: int, part: Check | None = None) -> Check:
    """A list of n, numbers unless said otherwise."""
    part = part or number()
    return lambda value: isinstance(value, list) and len(value) == n and all(part(item) for item in value)


def optional(check: Check) -> Check:
    """That, or nothing."""
    return lambda value: value is None or check(value)


def _value_alone(updates: Any) -> bool:
    return isinstance(updates, dict) and list(updates) == ["value"]


RAY: dict[str, Check] = {"ray_origin": vector(3), "ray_direction": vector(3), "modifier": optional(text)}
FIELDS: Mapping[str, Mapping[str, Check]] = {
    "ViewerCameraMessage": {
        "wxyz": vector(4), "position": vector(3), "look_at": vector(3), "up_direction": vector(3),
        "fov": number(1e-3, 3.15), "near": number(0.0), "far": number(0.0), "image_height": whole_number(0, 100_000),
        "image_width": whole_number(0, 100_000),
    },
    "GuiUpdateMessage": {"uuid": text, "updates": _value_alone},
    "CommandTriggerMessage": {"uuid": text},
    "SceneNodeClickMessage": {
        **RAY, "name": text, "instance_index": optional(whole_number(0, 2**31 - 1)), "screen_pos": vector(2), "owner": text,
    },
    "ScenePointerMessage": {**RAY, "event_type": one_of("click"), "screen_pos": vector(1, vector(2))},
}  # fmt: skip
"""Type of a message -> its fields, all of which it has, and what each may hold."""


def is_taken(message: Any) -> bool:
    """Whether the page takes a message of this type with these fields."""
    kind = message.get("type") if isinstance(message, dict) else None
    fields = FIELDS.get(kind) if isinstance(kind, str) else None
    if fields is None or message.keys() != {"type", *fields}:
        return False
    return all(check(message[name]) for name, check in fields.items()) and (
        kind != "ViewerCameraMessage" or _looks_somewhere(message)
    )


def _looks_somewhere(camera: Mapping[str, Any]) -> bool:
    """Whether a camera has a direction and an attitude."""
    lengths = (
        math.dist(camera["position"], camera["look_at"]),
        *(math.hypot(*camera[k]) for k in ("wxyz", "up_direction")),
    )
    return min(lengths) > NEAREST


def refusal(control: Any, value: Any) -> str:
    """Why a control does not take a value; "" where it does.

    Args:
        control: With its present value; numbers with their bounds `min` and `max`, choices with their `options`.
        value: The value.
    """
    check, allowed = _rule(control)
    if check(value):
        return ""
    shown = repr(value) if len(repr(value)) <= SHOWN else f"{repr(value)[:SHOWN]} …"
    return f"{shown} is not allowed; it takes {allowed}"


def _rule(control: Any) -> tuple[Check, str]:
    """What a control takes, as a check and in words."""
    if hasattr(control, "options"):
        return one_of(*control.options, *BY_TURNS.get(control.label, ())), "what it offers"
    if isinstance(control.value, bool):
        return one_of(True, False), "on or off"
    low, high = control.min, control.max
    if isinstance(control.value, int):
        return whole_number(low, high), f"a whole number from {low} to {high}"
    return number(low, high), f"a number from {low:g} to {high:g}"
