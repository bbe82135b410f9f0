"""What a mission file of MOOS says of its community."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from tussle import documents
from tussle.errors import ParameterError

HOST, PORT = "127.0.0.1", 9000
"""Host and port of a MOOSDB where neither parameters nor a mission file name them."""


@dataclass(frozen=True)
class MoosCommunity:
    """A community.

    Attributes:
        host: Where its MOOSDB is.
        port: Port of the MOOSDB.
        name: Name; empty for any.
        time_warp: Seconds of MOOS's time per second.
    """

    host: str
    port: int
    name: str
    time_warp: float


def community_of(values: dict[str, Any]) -> MoosCommunity:
    """The community that the parameters of a MOOSAutonomy and their mission file name.

    Raises:
        ParameterError: The file cannot be read, or a value in it is not allowed.
    """
    path = values["moos_mission_file"]
    settings = _read_settings(Path(path).expanduser()) if path else {}

    def number(key: str, least: float, most: float, usual: float) -> float:
        text = settings.get(key.lower(), str(usual))
        try:
            found = float(text)
        except ValueError:
            found = least - 1.0
        if not least <= found <= most:
            raise ParameterError(
                f"{path}: {key} = {text!r} is not allowed; it takes a number from {least:g} to {most:g}"
            )
        return found

    host = values["moos_host"] or settings.get("serverhost", HOST)
    return MoosCommunity(
        HOST if host.lower() == "localhost" else host,
        values["moos_port"] or int(number("ServerPort", 1, 65535, PORT)),
        values["moos_community"] or settings.get("community", ""),
        values["moos_time_warp"] or number("MOOSTimeWarp", 0.001, 1000.0, 1.0),
    )


def _read_settings(path: Path) -> dict[str, str]:
    """Values of a mission file outside of its blocks, by names in lower case; // begins a comment, and the first line counts."""
    settings: dict[str, str] = {}
    depth = 0
    for line in documents.read_text(path, ParameterError).splitlines():
        text = line.partition("//")[0].strip()
        key, is_value, value = text.partition("=")
        name = key.strip().lower()
        if is_value and not depth and name != "processconfig":
            settings.setdefault(name, value.strip().strip('"'))
        depth += text.count("{") - text.count("}")
    return settings
