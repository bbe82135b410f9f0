"""What users get: the files of the wheel."""

from __future__ import annotations

import re
from functools import cache

import pytest
from tree import ROOT, kept_files

OUTSIDE = ("tests/", "docs/", "examples/", "benchmarks/", "changelog/", "sha" + "red/", ".")


@cache
def shipped() -> frozenset[str]:
    """Paths of the files of the wheel, apart from its metadata."""
    wheel = pytest.importorskip("hatchling.builders.wheel", reason="needs hatchling: pip install '.[test]'")
    files = wheel.WheelBuilder(str(ROOT)).recurse_included_files()
    return frozenset(file.distribution_path.replace("\\", "/") for file in files)


def test_every_file_of_the_package_ships_but_declarations_for_the_type_checker_of_javascript():
    """Plugin files, missions, examples, assets of pages, templates, py.typed: whatever lies in the package is read at run time."""
    package = {f.relative_to(ROOT / "src").as_posix() for f in kept_files() if f.is_relative_to(ROOT / "src")}
    wanted = {name for name in package if not name.endswith(".d.ts")}
    assert package - wanted
    assert shipped() == wanted


@pytest.mark.parametrize(
    "pattern",
    [
        r"tussle/py\.typed",
        r"tussle/mission/library/predator_prey\.xml",
        r"tussle/plugins/stock/manifest\.toml",
        r"tussle/plugins/stock/motion/unicycle/(__init__\.py|example\.xml)",
        r"tussle/cli/scaffold/templates/\w+\.py",
        r"tussle/view/.*\.js",
        r"tussle/view/.*\.css",
        r"tussle/batch/report/page\.html\.j2",
    ],
)
def test_what_is_read_at_run_time_ships(pattern):
    assert any(re.fullmatch(pattern, name) for name in shipped())


def test_nothing_from_outside_the_package_ships():
    names = shipped()
    assert all(name.startswith("tussle/") for name in names)
    assert not [
        name
        for name in names
        if name.startswith(OUTSIDE) or re.search(r"(^|/)(test_\w+|conftest)\.py$", name)
    ]
