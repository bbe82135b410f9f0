"""Which plugin a name on the command line means."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

from tussle.errors import MissionError, nearest_name
from tussle.mission import shipped_missions
from tussle.mission.catalogue import Catalogue

if TYPE_CHECKING:
    from tussle.api import Plugin


def plugins_of(files: Iterable[Path]) -> dict[str, type[Plugin]]:
    """The plugins that some Python files define.

    Raises:
        MissionError: A file cannot be imported.
    """
    return Catalogue(files).own


def plugin_named(name: str, files: Iterable[Path]) -> type[Plugin] | None:
    """The plugin of this name; None where a mission is meant.

    Raises:
        MissionError: There is neither a plugin nor a mission of this name.
    """
    catalogue = Catalogue(files)
    if name in catalogue.names:
        return catalogue.load(name)
    if name in shipped_missions() or Path(name).exists() or Path(name).suffix == ".xml":
        return None
    known = [*shipped_missions(), *catalogue.names]
    raise MissionError(
        f"there is no mission and no plugin {name!r}{nearest_name(name, known)}; "
        f"tussle missions and tussle plugins list what there is, and the name of a mission file ends with .xml"
    )
