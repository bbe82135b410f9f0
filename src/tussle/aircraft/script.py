"""Reader of JSBSim scripts that name an aircraft and set properties at the start."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from tussle.aircraft.files import NAME
from tussle.aircraft.node import AircraftError, Element, read_file
from tussle.errors import clipped

START = ("simulation/sim-time-sec", "ge", "0")
COMPARISONS = {">=": "ge", "ge": "ge", "gt": "ge", ">": "ge"}


class Script(NamedTuple):
    """The aircraft of a script, and the properties that it sets at the start."""

    aircraft: str
    settings: tuple[tuple[str, float], ...]


def read_script(root: Path, name: str) -> Script:
    """Read a script.

    Raises:
        AircraftError: It cannot be read, or does anything but set properties at the start.
    """
    if not NAME.fullmatch(name):
        raise AircraftError(f"script_name {clipped(name)!r} is no name of a file below {root / 'scripts'}")
    top = read_file(root / "scripts" / name)
    settings: list[tuple[str, float]] = []
    run = top.find("run")
    for event in run.find_all("event") if run is not None else ():
        if not _is_at_start(event):
            raise event.error(
                "only events at the start (simulation/sim-time-sec ge 0) are compiled; motion=JSBSimControl plays all"
            )
        for each in event.find_all("set"):
            if each.find("function") is not None or each.get("action", "FG_STEP") != "FG_STEP":
                raise each.error("only a constant value can be set; motion=JSBSimControl plays all")
            settings.append((each.get("name"), each.attribute_number("value", 0.0)))
    return Script(top.need("use").get("aircraft"), tuple(settings))


def _is_at_start(event: Element) -> bool:
    words = event.need("condition").text.split()
    if len(words) != 3 or words[1] not in COMPARISONS:
        return False
    try:
        return (words[0], COMPARISONS[words[1]], float(words[2])) == (*START[:2], 0.0)
    except ValueError:
        return False
