"""What a game depends on is added by `tussle.numeric.total` and limited by `tussle.numeric.clip`.

Python's `sum` of floats compensates for rounding since 3.12; zeros of `np.clip` have another sign in groups of one.
"""

import ast
from pathlib import Path

from tree import ROOT, parsed

PLACES = ("aircraft", "numeric", "plugins", "world")
WHOLE = {
    "src/tussle/world/rays/files.py": "vertices of the faces of a file",
    "src/tussle/plugins/stock/autonomy/moos/wire.py": "lengths of messages",
    "src/tussle/plugins/stock/autonomy/rl_simple/actors.py": "actors with whole actions",
}
"""Modules that sum whole numbers."""


def sums(path: Path) -> bool:
    """Return whether a module calls Python's `sum`."""
    calls = (node for node in ast.walk(parsed(path)) if isinstance(node, ast.Call))
    return any(isinstance(call.func, ast.Name) and call.func.id == "sum" for call in calls)


def test_no_law_calls_the_sum_whose_rounding_depends_on_the_version_of_python() -> None:
    package = ROOT / "src" / "tussle"
    files = [
        file
        for place in PLACES
        for file in ([package / place] if place.endswith(".py") else (package / place).rglob("*.py"))
    ]
    found = {str(file.relative_to(ROOT)) for file in files if sums(file)}
    assert found == set(WHOLE), "take tussle.numeric.total"


def test_no_plugin_calls_the_clip_whose_zeros_depend_on_the_number_of_entities() -> None:
    package = ROOT / "src" / "tussle"
    files = [file for place in ("api", "plugins") for file in (package / place).rglob("*.py")]
    found = [
        f"{file.relative_to(ROOT)}:{node.lineno}"
        for file in files
        for node in ast.walk(parsed(file))
        if isinstance(node, ast.Attribute) and ast.unparse(node) == "np.clip" and file.parent.name != "plan"
    ]
    assert not found, "take tussle.numeric.clip"
