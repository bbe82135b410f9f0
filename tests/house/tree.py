"""The files of the repository, as the house rules look at them."""

from __future__ import annotations

import ast
import subprocess
from functools import cache, lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
SOURCE_TREES = ("src", "tests", "examples", "benchmarks")


@lru_cache
def kept_files() -> tuple[Path, ...]:
    """Files that git keeps or would keep; in a copy without git, all of them."""
    try:
        listing = subprocess.run(
            ["git", "ls-files", "--cached", "--others", "--exclude-standard", "-z"],
            cwd=ROOT,
            capture_output=True,
            check=True,
            text=True,
        ).stdout
        files = [ROOT / name for name in listing.split("\0") if name]
    except (OSError, subprocess.CalledProcessError):
        files = list(ROOT.rglob("*"))
    return tuple(sorted(f for f in files if f.is_file() and "__pycache__" not in f.parts))


def python_files(*trees: str) -> list[Path]:
    """Python files below some of the top folders."""
    return [f for f in kept_files() if f.suffix == ".py" and f.relative_to(ROOT).parts[0] in trees]


def relative(path: Path) -> str:
    """A path as messages and test names show it."""
    return str(path.relative_to(ROOT))


@cache
def parsed(path: Path) -> ast.Module:
    """The syntax tree of a file."""
    return ast.parse(path.read_text(), str(path))


def imported_modules(tree: ast.AST) -> list[tuple[int, str]]:
    """Line and dotted name of each import in it, those inside functions included."""
    found: list[tuple[int, str]] = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [(node.lineno, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            found += [(node.lineno, f"{node.module}.{alias.name}") for alias in node.names]
    return found
