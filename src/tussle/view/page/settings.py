"""The settings of recorded runs, and those that differ between two."""

from __future__ import annotations

from typing import Any

from tussle.mission import Mission
from tussle.mission.paths import values_of
from tussle.view.page.formatting import number
from tussle.view.recording import Recording

LEFT_OUT = "run.blocks", "run.scene", "run.limits", "run.name"


def differing_settings(a: Recording, b: Recording) -> list[tuple[str, str, str]]:
    """Return the settings that differ between two runs: path, value of the first, value of the second; "–" where one has no such setting.

    They are those of the missions where both can be read, else those that `run.json` lists.
    """
    one, other = a.mission, b.mission
    if one is not None and other is not None:
        settings = [{**_played(a), **_of_mission(one)}, {**_played(b), **_of_mission(other)}]
    else:
        settings = [{**_played(run), **_listed(run)} for run in (a, b)]
    paths = dict.fromkeys([*settings[0], *settings[1]])
    pairs = [(path, settings[0].get(path, "–"), settings[1].get(path, "–")) for path in paths]
    return [(path, x, y) for path, x, y in pairs if x != y]


def _played(run: Recording) -> dict[str, str]:
    """Seed, and the version that played it."""
    info, worlds = run.run.info, run.run.info.get("worlds", [])
    found = {"seed": str(worlds[run.world]["seed"])} if run.world < len(worlds) else {}
    version = info.get("versions", {}).get("tussle")
    return found | ({"tussle": str(version)} if version else {})


def _of_mission(mission: Mission) -> dict[str, str]:
    """Every value of a mission by its path, as text."""
    return {path: _text(value) for path, value in values_of(mission).items() if path not in LEFT_OUT}


def _text(value: Any) -> str:
    """A value in SI units, or the name of a class."""
    if isinstance(value, type):
        return value.__name__
    if isinstance(value, tuple):
        return " ".join(_text(each) for each in value)
    return "none" if value is None else number(value)


def _listed(run: Recording) -> dict[str, str]:
    """What `run.json` says of the mission."""
    said = run.run.info.get("mission", {})
    found = {
        f"run.{name}": _text(value) for name, value in said.items() if isinstance(value, (int, float, str))
    }
    for block in said.get("blocks", []):
        found |= {f"{block['name']}.{name}": str(block[name]) for name in ("team", "count")}
        found |= {f"{block['name']}.{plugin.partition('(')[0]}": plugin for plugin in block["plugins"]}
    return found | {plugin.partition("(")[0]: plugin for plugin in said.get("world_plugins", [])}
