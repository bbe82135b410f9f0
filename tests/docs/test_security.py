"""The page on security names tests that are there."""

import ast
import re

from pages import ROOT
from tree import parsed


def test_every_promise_names_tests_that_exist():
    text = (ROOT / "docs" / "security.md").read_text()
    rows = [line for line in text.splitlines() if line.startswith("| ") and "`test_" in line]
    named = {name for row in rows for name in re.findall(r"`(test_\w+)`", row)}
    defined = {
        node.name
        for path in (ROOT / "tests").rglob("test_*.py")
        for node in ast.walk(parsed(path))
        if isinstance(node, ast.FunctionDef)
    }
    assert len(rows) > 20
    assert named <= defined, named - defined
