"""The laws of SCRIMMAGE, where tussle's differ: plugins of the same names, which missions with `compat="scrimmage"` use.

`from tussle.historic import SimpleAircraft` imports one of them. Each docstring says how the law differs from tussle's.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

from tussle.errors import nearest_name
from tussle.plugins import stock


@cache
def manifest() -> dict[str, str]:
    """Map the name of each plugin to "module:class"."""
    return stock.read_manifest(Path(__file__).parent)


def load(name: str) -> Any:
    """Return the plugin class of this name, with SCRIMMAGE's law if it differs, else the stock plugin.

    Raises:
        ParameterError: No plugin has this name.
    """
    return stock.import_class(manifest()[name]) if name in manifest() else stock.load(name)


def __getattr__(name: str) -> Any:
    if name == "__all__":
        return __dir__()  # for `from tussle.historic import *`
    if not name.startswith("_") and name in manifest():
        return load(name)
    hint = "" if name.startswith("_") else nearest_name(name, manifest())
    raise AttributeError(f"module 'tussle.historic' has no attribute {name!r}{hint}")


def __dir__() -> list[str]:
    return sorted(name for name in manifest() if name.isidentifier())
