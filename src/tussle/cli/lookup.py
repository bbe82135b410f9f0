"""Which plugin a name on the command line means."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from tussle.api import Plugin
from tussle.cli.terminal import say_note
from tussle.errors import MissionError, nearest_name
from tussle.mission import Catalogue, PluginFile, shipped_missions


def all_plugins(files: Iterable[Path]) -> tuple[dict[str, type[Plugin]], list[str], list[str]]:
    """All plugins by name, what is wrong with those that cannot be loaded, and which names hide others."""
    found: dict[str, type[Plugin]] = {}
    good, wrong = list[PluginFile](), list[str]()
    for path in files:
        try:
            file = PluginFile.of(path)
            file.load()
            good.append(file)
        except MissionError as error:
            wrong.append(str(error))
    catalogue = Catalogue(good)
    for name in catalogue.names:
        try:
            found[name] = catalogue.load(name)
        except MissionError as error:
            wrong.append(str(error))
    return found, wrong, [text for name in found if (text := catalogue.hides(name))]


def plugin_named(name: str, files: Iterable[Path]) -> type[Plugin] | None:
    """The plugin of this name; None where a mission is meant.

    Raises:
        MissionError: There is neither a plugin nor a mission of this name.
    """
    catalogue = Catalogue(files)
    if name in catalogue.names:
        if hides := catalogue.hides(name):
            say_note(hides)
        return catalogue.load(name)
    if name in shipped_missions() or Path(name).exists() or Path(name).suffix == ".xml":
        return None
    known = [*shipped_missions(), *catalogue.names]
    raise MissionError(
        f"there is no mission and no plugin {name!r}{nearest_name(name, known)}; "
        f"tussle missions and tussle plugins list what there is, and the name of a mission file ends with .xml"
    )
